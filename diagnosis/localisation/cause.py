"""Cause attribution: the input or body that causes a disturbance in a balance.

A disturbance that correlates with the acceleration belongs to a mass. One that is periodic in the
angle belongs to an input: machines have ripple, losses do not. So does a constant: friction changes
with the sign of the speed, and a road load differs between recordings.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.correlate import order_features
from diagnosis.localisation.location import Location
from language.expressions.text_rewrite import names_in_text
from language.overlays.name_types import formula_entries

RIPPLE_CORRELATION = 0.6
"""Correlation with an order of an angle above which a disturbance is a ripple."""
MASS_CORRELATION, MASS_FRACTION = 0.6, 0.45
"""Correlation with the acceleration, and fraction of the accelerating torque, that indicate a mass.

A tyre and a third inertia have at least 0.73 and 0.6; loads have, but for one, at most 0.44 and
0.29.
"""
CONSTANT_FRACTION = 0.95
"""Fraction of the squares that a constant and a line over the speed must explain."""
CONSTANT_MARGIN = 0.3
"""Fraction that the constant must explain beyond the line: a line through zero is friction."""

INACTIVE_AMPLITUDE, INACTIVE_ENERGY = 0.02, 0.5
"""Fraction of an input's largest magnitude that is inactive, and of squares that is most of them.
"""


def attribute_causes(model_set: ModelSet, location: Location) -> Iterator[str]:
    """Yield the paths of inputs or elements of a location's balance that fit its disturbance.

    They are the elements for a large disturbance that follows the acceleration, else the inputs
    with both signs for a constant, else all inputs for a ripple.
    """
    paths = [f"inputs.{name}" for name in model_set.automaton.inputs]
    strongest, part = location.correlates[0] if location.correlates else ("", 0.0)
    is_ripple = strongest in order_features(location.place) and part > RIPPLE_CORRELATION
    if _follows_acceleration(model_set, location):
        paths = [f"elements.{name}" for name in model_set.automaton.elements]
    elif _is_constant(location):
        paths = [path for path in paths if _has_both_signs(model_set, path)]
    elif not is_ripple:
        paths = []
    yield from (path for path in paths if balance_of(model_set, *path.split(".")) == location.path)


def is_inactive(model_set: ModelSet, location: Location, path: str) -> bool:
    """Return whether an input is below `INACTIVE_AMPLITUDE` during most of a disturbance."""
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
    inactive = float(np.sum(squares[size < INACTIVE_AMPLITUDE * size.max()]))
    return inactive > INACTIVE_ENERGY * float(np.sum(squares))


def balance_of(model_set: ModelSet, section: str, place: str) -> str:
    """Return `flow.state` of the balance in which an input or inertia acts, else the place."""
    element = model_set.automaton.elements.get(place)
    if section == "elements" and element is not None and "speed" in element.parts:
        return f"flow.{'.'.join(element.parts['speed'].reads)}"
    balances = {placed_effect.place for placed_effect in model_set.disturbances}
    for state, scalar in formula_entries(model_set.document.root, "flow"):
        if section == "inputs" and state in balances and place in names_in_text(scalar.text):
            return f"flow.{state}"
    return f"{section}.{place}"


def _follows_acceleration(model_set: ModelSet, location: Location) -> bool:
    """Return whether a disturbance is large and correlates with the acceleration of its balance."""
    speeds = _balance_states(location)
    if not speeds or location.fraction < MASS_FRACTION:
        return False
    rates = np.concatenate([np.gradient(speed) for speed in speeds]) / float(model_set.period)
    return bool(np.corrcoef(rates, _stacked_disturbance(location))[0, 1] > MASS_CORRELATION)


def _is_constant(location: Location) -> bool:
    """Return whether a disturbance is a constant rather than the sign of the speed.

    A line over the speed is allowed: a fit may have changed the friction of the base.
    """
    speeds = _balance_states(location)
    if not speeds:
        return False
    speed, unknown = np.concatenate(speeds), _stacked_disturbance(location)
    whole = float(unknown @ unknown)

    def explained(form: Reals) -> float:
        """Return the fraction of the squares that `form` and the speed explain by least squares."""
        columns = np.stack([form, speed], axis=1)
        left = unknown - columns @ np.linalg.lstsq(columns, unknown, rcond=None)[0]
        return 1.0 - float(left @ left) / whole

    constant, line = explained(np.ones_like(speed)), explained(speed)
    is_all = constant > max(CONSTANT_FRACTION, explained(np.sign(speed)))
    return is_all and constant - line > CONSTANT_MARGIN


def _has_both_signs(model_set: ModelSet, path: str) -> bool:
    """Return whether an input takes both signs; a brake does not and is no constant at rest."""
    column = list(model_set.automaton.inputs).index(path.partition(".")[2])
    values = np.concatenate([one.inputs[:, column] for one in model_set.series])
    return bool(values.min() < 0.0 < values.max())


def _balance_states(location: Location) -> list[Reals]:
    """Return the state of the balance beside its disturbance, by recording; else empty."""
    if location.section != "flow" or location.free_model is None or not location.disturbances:
        return []
    column = location.free_model.candidate.predictor.states.index(location.place)
    runs = zip(location.free_model.prediction.predictions, location.disturbances, strict=True)
    return [
        run.states[run.completed - len(one.values) : run.completed, column] for run, one in runs
    ]


def _stacked_disturbance(location: Location) -> Reals:
    """Return the disturbance of all recordings, concatenated."""
    return np.concatenate([one.values for one in location.disturbances])
