"""Gains: of an observer, made from a candidate near where each of its modes was seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.candidate import Candidate
from diagnosis.joined import burnt
from diagnosis.linear import Linear
from diagnosis.modes import models_of
from diagnosis.prediction import Gains, Noises, Outcome
from diagnosis.series import Series

Reals = NDArray[np.float64]
START_PART = 0.01
"""Standard deviation of a state at the start, as a part of its range."""
KEPT = 0.999
"""Part of itself that an integral keeps over a sample, and what decays does not."""
MODEL_NOISE = 1e-7
"""Process noise of every state per sample, as a part of its range: no gain is ever quite 0."""


@dataclass(frozen=True)
class Local:
    """A candidate in one mode near where that was seen: `linear` over one sample with its process
    noise `q` (states, states), the standard deviations `start` (states,) that its states begin
    with, and the usual `stay` in it [samples].
    """

    linear: Linear
    q: Reals
    start: Reals
    stay: int


def gains_of(
    candidate: Candidate,
    series: Sequence[Series],
    values: Mapping[str, float],
    noises: Noises,
    outcome: Outcome | None = None,
) -> Gains:
    """Return the gains of a candidate at `values`, near where `outcome` saw each mode.

    In another mode than the one that lasts longest the gain is that at the usual length of a stay,
    which began with what was known before: in a gap it would never be steady.
    """
    count = burnt(series[0])
    found: dict[int, Reals] = {}
    first = np.zeros((0, len(candidate.spans), len(noises.seen)))
    before = np.zeros(0)
    for mode, local in locals_of(candidate, series, values, noises, outcome).items():
        given = local.linear.phi, local.linear.c, local.q, noises.seen**2
        if found:
            gains = candidate.predictor.gains(*given, before, 0, local.stay)
        else:
            gains = candidate.predictor.gains(*given, np.diag(local.start**2), count)
        if gains is not None:
            first, before = (first, before) if found else (gains[0], gains[2])
            found[mode] = gains[1]
    nothing = np.zeros((len(candidate.spans), len(noises.seen)))
    usual = next(iter(found.values()), nothing)
    modes = candidate.predictor.modes
    steady = np.array([nothing if noises.is_alone else found.get(mode, usual) for mode in modes])
    return Gains(first, np.ascontiguousarray(steady))


def locals_of(
    candidate: Candidate,
    series: Sequence[Series],
    values: Mapping[str, float],
    noises: Noises,
    outcome: Outcome | None = None,
) -> dict[int, Local]:
    """Return a candidate at `values` near where `outcome` saw each mode, the longest stay first.

    Its process noise is that of the inputs, of the drifts, and next to none of what is unsure.
    Delays are left out of it: what is shown late would seem to know nothing of the states.
    """
    prompt = dict.fromkeys(candidate.recipe.delays, 0.0)
    page = candidate.page({**values, **prompt}, series[0])
    pushed, found = np.diag(noises.inputs**2), {}
    moved = _drift_noise(candidate, noises, float(series[0].period))
    for mode, (linear, stay) in models_of(candidate, series, page, outcome).items():
        unsure = np.where(_turns(candidate, linear), 0.0, candidate.spans)
        q = linear.b @ pushed @ linear.b.T + np.diag((MODEL_NOISE * unsure) ** 2)
        for place, variance in moved.items():
            q[place, place] = variance
        found[mode] = Local(linear, q, START_PART * unsure, stay)
    return found


def _turns(candidate: Candidate, linear: Linear) -> NDArray[np.bool_]:
    """Tell which states (states,) are an effect's integrals, such as an angle.

    What such a one shows changes its sign as it turns: a gain made at one angle would be wrong.
    """
    keeps = linear.phi.diagonal() > KEPT
    return np.asarray(keeps & candidate.brought, dtype=np.bool_)


def _drift_noise(candidate: Candidate, noises: Noises, period: float) -> dict[int, float]:
    """Return the process noise of each state that drifts, by its place."""
    found = {}
    for name, memory in zip(candidate.drifts, candidate.recipe.memories, strict=True):
        kept = np.exp(-period / memory)
        place = candidate.predictor.states.index(name)
        found[place] = noises.drifts.get(name, 0.0) ** 2 * (1.0 - kept**2)
    return found
