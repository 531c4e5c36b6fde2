"""Constancy: whether the parameters of an effect are the same in each recording.

Physics is: a constant of a machine does not change with the manoeuvre. What imitates an effect that
the library lacks finds another value in each that comes nearest to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimate import Estimate
from diagnosis.evidence import PARTS, inflation
from diagnosis.layers import SECONDS, Layer
from diagnosis.naming import brought_by
from diagnosis.point import bounds_of
from diagnosis.prediction import Outcome, predicted
from diagnosis.search import Tried
from diagnosis.series import Series
from language.document import Scalar, Table
from language.units import parse_unit

Reals = NDArray[np.float64]
Wholes = NDArray[np.int64]
VARIED, VARIED_PART = 20.0, 0.012
"""Nats that values of its own in each recording would gain for an effect, and part of what it
gained, from which on its parameters vary."""
OTHER_PART, LATE_PART = 0.2, 0.06
"""The same part from which on they are no constants of a machine: right ones have 0.17 at most. A
lag or a delay alone has 0.01 (two of fifty 0.03 and 0.05): nothing beside it makes its time
another."""


def differs(model: Estimate, tried: Tried, series: Sequence[Series], is_alone: bool) -> bool:
    """Tell whether they differ so much that the effect is another one: the normal equations foresee
    it, and runs with values of their own show it.
    """
    part = LATE_PART if is_alone and comes_late(tried.layer) else OTHER_PART
    most = max(VARIED, part * tried.gained)
    if not variation(model, tried.layer, series) > most:
        return False
    return shown_variation(model, tried.layer, series) > most


def comes_late(layer: Layer) -> bool:
    """Tell whether an effect is a lag or a delay: it has a time, without which it is absent."""
    known = layer.effect.body.get("parameters")
    entries = known if isinstance(known, Table) else ()
    return any(isinstance(one.node, Table) and _is_absent_time(one.node) for one in entries)


def _is_absent_time(parameter: Table) -> bool:
    neutral, value = parameter.get("neutral"), parameter.get("value")
    if not isinstance(neutral, Scalar) or not isinstance(value, Scalar) or neutral.text != "absent":
        return False
    unit = value.text.partition(" ")[2]
    return bool(unit) and parse_unit(unit).dimension.powers == SECONDS


def varies(model: Estimate, tried: Tried, series: Sequence[Series]) -> bool:
    """Tell whether the parameters of an effect that a model holds are not the same in each."""
    return variation(model, tried.layer, series) > max(VARIED, VARIED_PART * tried.gained)


def variation(model: Estimate, layer: Layer, series: Sequence[Series]) -> float:
    """Return what values of their own in each recording would gain [nats] for the parameters of an
    effect, beyond what noise gives them: the normal equations foresee it, all else held.

    (The score test of Rao 1948, of parameters that are the same against some that are not.)
    """
    steps = _own_steps(model, layer, series)
    return sum(step.foreseen - step.by_chance for step in steps)


def shown_variation(model: Estimate, layer: Layer, series: Sequence[Series]) -> float:
    """Return what they gain [nats] where the recordings are run with them, beyond what noise gives.

    A step that does a recording no good is shortened: what bends is not foreseen far.
    """
    steps = _own_steps(model, layer, series)
    if not steps:
        return 0.0
    shrink = 1.0 / inflation(model, series)
    before, best = _costs(model, model.outcome), np.zeros(len(steps))
    for part in PARTS:
        moved = [step.cut(part) for step in steps]
        values = [step.values(model, z) for step, z in zip(steps, moved, strict=True)]
        run = predicted(model.candidate, series, values, model.gains, model.noises.limits)
        far = np.array(
            [0.5 * float(np.sum((z - s.at) ** 2)) for s, z in zip(steps, moved, strict=True)]
        )
        best = np.maximum(best, shrink * (before - _costs(model, run)) - far)
    return float(np.sum(best)) - sum(step.by_chance for step in steps)


@dataclass(frozen=True)
class _OwnStep:
    """How far an effect's parameters, the `places` of a model, would go in one recording from where
    they are `at` in all; what that is foreseen to gain [nats], and what noise gives it by chance.
    """

    recording: int
    places: Wholes
    at: Reals
    step: Reals
    foreseen: float
    by_chance: float
    bounds: Reals

    def cut(self, part: float) -> Reals:
        """Return where a part of the step leads, within the ranges (parameters,)."""
        low, high = self.bounds
        return np.clip(self.at + part * self.step, low, high)

    def values(self, model: Estimate, z: Reals) -> dict[str, float]:
        """Return the parameters [SI] of the recording with those of the effect at some point."""
        known = [model.candidate.uncertain[k] for k in self.places]
        own = {one.name: one.value(float(at)) for one, at in zip(known, z, strict=True)}
        return {**model.values(self.recording), **own}


def _own_steps(model: Estimate, layer: Layer, series: Sequence[Series]) -> list[_OwnStep]:
    """Return how far the parameters that all share of an effect would go in each recording."""
    if model.normal is None:
        return []
    brought = brought_by(layer)
    is_brought = np.array([name in brought for name in model.candidate.names], dtype=bool)
    own = np.flatnonzero(is_brought & ~model.normal.own)
    shrink, found = 1.0 / inflation(model, series), []
    at, bounds = model.point.shared[own], bounds_of(model.candidate)[own].T
    for recording in np.unique(model.normal.of).tolist():
        here = model.normal.of == recording
        known = shrink * model.normal.a[here].sum(axis=0)[np.ix_(own, own)]
        slope = shrink * model.normal.g[here].sum(axis=0)[own]
        whole = known + np.eye(len(own))
        by_chance = 0.5 * float(np.trace(np.linalg.solve(whole, known)))
        step = -np.linalg.solve(whole, slope)
        gain = -0.5 * float(slope @ step)
        found.append(_OwnStep(recording, own, at, step, gain, by_chance, bounds))
    return found


def _costs(model: Estimate, run: Outcome) -> Reals:
    """Return half the squares of each recording, over what a model leaves (recordings,); without
    bound where one leaves all bounds.
    """
    costs = 0.5 * np.sum(run.runs.squares / model.outcome.variances, axis=1)
    return np.where(run.runs.done == np.diff(run.runs.starts), costs, np.inf)
