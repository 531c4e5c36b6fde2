"""Actor: what acts in the balance in which something is missing - a body, an input.

A drift in a balance is as well one of what acts there, and what it does over time tells which. What
goes along with the acceleration is a mass's. What turns with the angle is an input's: machines and
discs ripple, losses do not. So is what does not change with the speed, its sign, or the recording:
a friction turns with the sign, a load on the road is another one in each recording.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from diagnosis.bench import Bench
from diagnosis.companion import orders_of
from diagnosis.locus import Locus
from language.known import entries_of
from language.rewrite import reads

Reals = NDArray[np.float64]
RIPPLE = 0.6
"""Correlation with an order of an angle from which on a drift ripples."""
MASS, MASS_PART = 0.6, 0.45
"""Correlation with the acceleration, and part of what accelerates, from which on it is a mass: a
tyre and a third inertia have 0.73 and 0.6 at least, loads 0.44 and 0.29 at most but for one."""
STEADY = 0.95
"""Part of its squares that a constant and a line over the speed have of what is steady."""
AT_REST = 0.3
"""Part of them that the constant has alone: a line through zero is a friction."""

RESTING, MOST = 0.02, 0.5
"""Part of its largest amount below which an input rests, and part of the squares of a drift that is
most of it."""


def actors(bench: Bench, locus: Locus) -> Iterator[str]:
    """Yield the paths of what acts in the balance of a place, as its drift tells."""
    paths = [f"inputs.{name}" for name in bench.automaton.inputs]
    if _goes_with_acceleration(bench, locus):
        paths = [f"elements.{name}" for name in bench.automaton.elements]
    elif _is_steady(bench, locus):
        paths = [path for path in paths if _pushes_both_ways(bench, path)]
    elif not _ripples(locus):
        paths = []
    yield from (path for path in paths if acting(bench, *path.split(".")) == locus.path)


def rests(bench: Bench, locus: Locus, path: str) -> bool:
    """Tell whether an input rests while most of what is missing at a place is there: it is not the
    error of that one.
    """
    section, _, name = path.partition(".")
    if section != "inputs" or not locus.unknown:
        return False
    column = list(bench.automaton.inputs).index(name)
    given = [
        one.inputs[len(one.inputs) - len(known.values) :, column]
        for one, known in zip(bench.series, locus.unknown, strict=True)
    ]
    size = np.abs(np.concatenate(given))
    squares = _unknown(locus) ** 2
    return float(np.sum(squares[size < RESTING * size.max()])) > MOST * float(np.sum(squares))


def acting(bench: Bench, section: str, place: str) -> str:
    """Return the balance in which what is at an input or at an inertia acts."""
    element = bench.automaton.elements.get(place)
    if section == "elements" and element is not None and "speed" in element.parts:
        return f"flow.{'.'.join(element.parts['speed'].reads)}"
    balances = {layer.place for layer in bench.drifts}
    for state, scalar in entries_of(bench.document.root, "flow"):
        if section == "inputs" and state in balances and place in reads(scalar.text):
            return f"flow.{state}"
    return f"{section}.{place}"


def _ripples(locus: Locus) -> bool:
    name, part = locus.along[0] if locus.along else ("", 0.0)
    return name in orders_of(locus.place) and part > RIPPLE


def _goes_with_acceleration(bench: Bench, locus: Locus) -> bool:
    speeds = _speeds(locus)
    if not speeds or locus.part < MASS_PART:
        return False
    rates = np.concatenate([np.gradient(speed) for speed in speeds]) / float(bench.period)
    return bool(np.corrcoef(rates, _unknown(locus))[0, 1] > MASS)


def _is_steady(bench: Bench, locus: Locus) -> bool:
    """Tell whether what is missing is a constant, more than it is a sign of the speed; a line over
    the speed is what a friction of the base has been bent by.
    """
    speeds = _speeds(locus)
    if not speeds:
        return False
    speed, unknown = np.concatenate(speeds), _unknown(locus)
    whole = float(unknown @ unknown)

    def explained(form: Reals) -> float:
        columns = np.stack([form, speed], axis=1)
        left = unknown - columns @ np.linalg.lstsq(columns, unknown, rcond=None)[0]
        return 1.0 - float(left @ left) / whole

    constant, line = explained(np.ones_like(speed)), explained(speed)
    is_all = constant > max(STEADY, explained(np.sign(speed)))
    return is_all and constant - line > AT_REST


def _pushes_both_ways(bench: Bench, path: str) -> bool:
    """Tell whether an input has both signs: a brake, which has one, is no constant at rest."""
    column = list(bench.automaton.inputs).index(path.partition(".")[2])
    values = np.concatenate([one.inputs[:, column] for one in bench.series])
    return bool(values.min() < 0.0 < values.max())


def _speeds(locus: Locus) -> list[Reals]:
    """Return the state of a place's balance in each recording where its unknown is known."""
    if locus.section != "flow" or locus.free is None or not locus.unknown:
        return []
    column = locus.free.candidate.predictor.states.index(locus.place)
    runs = zip(locus.free.outcome.predictions, locus.unknown, strict=True)
    return [run.states[run.done - len(one.values) : run.done, column] for run, one in runs]


def _unknown(locus: Locus) -> Reals:
    return np.concatenate([one.values for one in locus.unknown])
