"""Gains: of an observer, made from a candidate near where each of its modes was seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.candidate import Candidate
from diagnosis.joined import burnt
from diagnosis.linear import Linear, linearised
from diagnosis.prediction import Gains, Noises, Outcome
from diagnosis.series import Series

Reals = NDArray[np.float64]
Wholes = NDArray[np.int64]
SHORT_STAY = 5
"""Samples: a mode that is left sooner has the gain of the mode that lasts longest."""
START_PART = 0.01
"""Standard deviation of a state at the start, as a part of its range."""
KEPT = 0.999
"""Part of itself that an integral keeps over a sample, and what decays does not."""
SMALL = 1e-5
"""Change of a state for a difference, as a part of its range."""
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

    Delays are left out of it: what is shown late would seem to know nothing of the states.
    """
    prompt = dict.fromkeys(candidate.recipe.delays, 0.0)
    page = candidate.page({**values, **prompt}, series[0])
    found = {}
    for mode, point in points_of(candidate, series, outcome).items():
        linear = near(candidate, page, mode, point.states, point.inputs)
        if linear is not None:
            unsure = np.where(_turns(candidate, linear), 0.0, candidate.spans)
            q = _process_noise(candidate, linear, noises, float(series[0].period), unsure)
            found[mode] = Local(linear, q, START_PART * unsure, point.stay)
    return found


def near(
    candidate: Candidate, page: Reals, mode: int, states: Reals, inputs: Reals
) -> Linear | None:
    """Return a candidate over one sample, linearised in a mode near a point; None if unstable."""
    substeps, sizes = candidate.recipe.substeps, SMALL * candidate.spans
    return linearised(candidate.predictor, page, mode, substeps, states, inputs, sizes)


def _turns(candidate: Candidate, linear: Linear) -> NDArray[np.bool_]:
    """Tell which states (states,) are an effect's integrals, such as an angle.

    What such a one shows changes its sign as it turns: a gain made at one angle would be wrong.
    """
    keeps = np.diag(linear.phi) > KEPT
    return np.asarray(keeps & np.array(candidate.recipe.brought), dtype=np.bool_)


def _process_noise(
    candidate: Candidate, linear: Linear, noises: Noises, period: float, unsure: Reals
) -> Reals:
    """Return Q: the noise of the inputs, of the drifts, and next to none of what is `unsure`."""
    q = linear.b @ np.diag(noises.inputs**2) @ linear.b.T
    q = q + np.diag((MODEL_NOISE * unsure) ** 2)
    for name, memory in zip(candidate.drifts, candidate.recipe.memories, strict=True):
        place = candidate.predictor.states.index(name)
        kept = np.exp(-period / memory)
        q[place, place] = noises.drifts.get(name, 0.0) ** 2 * (1.0 - kept**2)
    return q


@dataclass(frozen=True)
class Seen:
    """Where a mode was seen: `states` and `inputs` there, and the usual `stay` in it [samples]."""

    states: Reals
    inputs: Reals
    stay: int


def points_of(
    candidate: Candidate, series: Sequence[Series], outcome: Outcome | None
) -> dict[int, Seen]:
    """Return where each mode was seen, in its longest stay; the mode with the longest first.

    Where the first compared signal is largest: friction is steep near rest alone.
    """
    if outcome is None:
        return _first_seen(candidate, series[0])
    found = {}
    lows, highs, modes, of = _stays(outcome)
    for mode in np.unique(modes).tolist():
        here = np.flatnonzero(modes == mode)
        lengths = highs[here] - lows[here]
        best = here[np.argmax(lengths)]
        if np.max(lengths) >= SHORT_STAY:
            one, states = series[of[best]], outcome.predictions[of[best]].states
            k = _away(one.measured, int(lows[best]), int(highs[best]))
            usual = max(1, round(float(np.median(lengths))))
            found[mode] = int(np.max(lengths)), Seen(states[k].copy(), one.inputs[k].copy(), usual)
    ordered = sorted(found.items(), key=lambda item: -item[1][0])
    return {mode: seen for mode, (_, seen) in ordered}


def _stays(outcome: Outcome) -> tuple[Wholes, Wholes, Wholes, Wholes]:
    """Return the first sample of each stay in a mode, the one behind it, its mode and recording."""
    found = []
    for r, run in enumerate(outcome.predictions):
        modes = run.modes[: run.done]
        edges = np.flatnonzero(modes[1:] != modes[:-1]) + 1
        if len(modes):
            lows, highs = np.append(0, edges), np.append(edges, len(modes))
            found.append((lows, highs, modes[lows], np.full(len(lows), r)))
    none = np.zeros(0, dtype=np.int64)
    whole = [np.concatenate(parts) for parts in zip(*found, strict=True)] if found else [none] * 4
    return whole[0], whole[1], whole[2], whole[3]


def _first_seen(candidate: Candidate, series: Series) -> dict[int, Seen]:
    """Return where a recording starts."""
    predictor = candidate.predictor
    page = candidate.page({}, series)
    none = np.zeros((len(predictor.modes), len(predictor.states), len(predictor.seen)))
    short, measured = series.inputs[:2].copy(), series.measured[:2].copy()
    run = predictor.predict(page, short, measured, none[:0], none, candidate.recipe.substeps, False)
    return {int(run.modes[0]): Seen(run.states[0].copy(), short[0], 1)}


def _away(measured: Reals, low: int, high: int) -> int:
    """Return the sample of a stay, not near its ends, at which the first signal is largest."""
    margin = (high - low) // 5
    inner = np.abs(measured[low + margin : high - margin, 0])
    known = np.where(np.isfinite(inner), inner, -1.0)
    return low + margin + int(np.argmax(known)) if len(known) else (low + high) // 2
