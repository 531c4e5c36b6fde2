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

from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.correlate import order_features
from diagnosis.localisation.location import Location
from language.expressions.text_rewrite import names_in_text
from language.overlays.tree_types import formula_entries

Reals = NDArray[np.float64]
RIPPLE_CORRELATION = 0.6
"""Correlation with an order of an angle from which on a drift ripples."""
MASS_CORRELATION, MASS_FRACTION = 0.6, 0.45
"""Correlation with the acceleration, and part of what accelerates, from which on it is a mass: a
tyre and a third inertia have 0.73 and 0.6 at least, loads 0.44 and 0.29 at most but for one."""
CONSTANT_FRACTION = 0.95
"""Part of its squares that a constant and a line over the speed have of what is steady."""
CONSTANT_MARGIN = 0.3
"""Part of them that the constant has alone: a line through zero is a friction."""

INACTIVE_AMPLITUDE, INACTIVE_ENERGY = 0.02, 0.5
"""Part of its largest amount below which an input rests, and part of the squares of a drift that is
most of it."""


def attribute_causes(model_set: ModelSet, location: Location) -> Iterator[str]:
    """Yield the paths of what acts in the balance of a place, as its drift tells."""
    paths = [f"inputs.{name}" for name in model_set.automaton.inputs]
    if _follows_acceleration(model_set, location):
        paths = [f"elements.{name}" for name in model_set.automaton.elements]
    elif _is_constant(model_set, location):
        paths = [path for path in paths if _has_both_signs(model_set, path)]
    elif not _is_ripple(location):
        paths = []
    yield from (path for path in paths if balance_of(model_set, *path.split(".")) == location.path)


def is_inactive(model_set: ModelSet, location: Location, path: str) -> bool:
    """Tell whether an input rests while most of what is missing at a place is there: it is not the
    error of that one.
    """
    section, _, name = path.partition(".")
    if section != "inputs" or not location.disturbances:
        return False
    column = list(model_set.automaton.inputs).index(name)
    input_values = [
        one.inputs[len(one.inputs) - len(known.values) :, column]
        for one, known in zip(model_set.series, location.disturbances, strict=True)
    ]
    size = np.abs(np.concatenate(input_values))
    squares = _stacked_disturbance(location) ** 2
    return float(np.sum(squares[size < INACTIVE_AMPLITUDE * size.max()])) > INACTIVE_ENERGY * float(
        np.sum(squares)
    )


def balance_of(model_set: ModelSet, section: str, place: str) -> str:
    """Return the balance in which what is at an input or at an inertia acts."""
    element = model_set.automaton.elements.get(place)
    if section == "elements" and element is not None and "speed" in element.parts:
        return f"flow.{'.'.join(element.parts['speed'].reads)}"
    balances = {placed_effect.place for placed_effect in model_set.disturbances}
    for state, scalar in formula_entries(model_set.document.root, "flow"):
        if section == "inputs" and state in balances and place in names_in_text(scalar.text):
            return f"flow.{state}"
    return f"{section}.{place}"


def _is_ripple(location: Location) -> bool:
    name, part = location.correlates[0] if location.correlates else ("", 0.0)
    return name in order_features(location.place) and part > RIPPLE_CORRELATION


def _follows_acceleration(model_set: ModelSet, location: Location) -> bool:
    speeds = _balance_states(location)
    if not speeds or location.fraction < MASS_FRACTION:
        return False
    rates = np.concatenate([np.gradient(speed) for speed in speeds]) / float(model_set.period)
    return bool(np.corrcoef(rates, _stacked_disturbance(location))[0, 1] > MASS_CORRELATION)


def _is_constant(model_set: ModelSet, location: Location) -> bool:
    """Tell whether what is missing is a constant, more than it is a sign of the speed; a line over
    the speed is what a friction of the base has been bent by.
    """
    speeds = _balance_states(location)
    if not speeds:
        return False
    speed, unknown = np.concatenate(speeds), _stacked_disturbance(location)
    whole = float(unknown @ unknown)

    def explained(form: Reals) -> float:
        columns = np.stack([form, speed], axis=1)
        left = unknown - columns @ np.linalg.lstsq(columns, unknown, rcond=None)[0]
        return 1.0 - float(left @ left) / whole

    constant, line = explained(np.ones_like(speed)), explained(speed)
    is_all = constant > max(CONSTANT_FRACTION, explained(np.sign(speed)))
    return is_all and constant - line > CONSTANT_MARGIN


def _has_both_signs(model_set: ModelSet, path: str) -> bool:
    """Tell whether an input has both signs: a brake, which has one, is no constant at rest."""
    column = list(model_set.automaton.inputs).index(path.partition(".")[2])
    values = np.concatenate([one.inputs[:, column] for one in model_set.series])
    return bool(values.min() < 0.0 < values.max())


def _balance_states(location: Location) -> list[Reals]:
    """Return the state of a place's balance in each recording where its unknown is known."""
    if location.section != "flow" or location.free_model is None or not location.disturbances:
        return []
    column = location.free_model.candidate.predictor.states.index(location.place)
    runs = zip(location.free_model.prediction.predictions, location.disturbances, strict=True)
    return [
        run.states[run.completed - len(one.values) : run.completed, column] for run, one in runs
    ]


def _stacked_disturbance(location: Location) -> Reals:
    return np.concatenate([one.values for one in location.disturbances])
