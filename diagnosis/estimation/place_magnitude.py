"""Place magnitude: the size of the force, signal, inertia and time at a place, from recordings.

A disturbance is compared with what acts at its place, and parameters of effects start at multiples
of such magnitudes.
"""

from __future__ import annotations

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.parameter import declared_value
from diagnosis.model.placed_effect import disturbance_effect
from language.overlays.effect_place import PlaceMismatch, find_effect_place

DISTURBANCE_KIND_BY_SECTION = {"flow": "balance", "elements": "element", "outputs": "output"}
"""The kind of disturbance for each section of a document."""


def acting_rms(model_set: ModelSet, section: str, place: str, model: Estimate) -> float:
    """Return the root mean square [SI] of what acts at a place; 0 if it cannot be determined.

    For a balance ("flow") this is its inertia times the rate of the predicted state, for an element
    its elastic torque (stiffness times twist without the gap), both after the burn-in; for an
    output the standard deviation of the measurements, NaN excluded. It is 0 if the inertia or
    stiffness has no value, or the rate or twist is no state.
    """
    if section == "outputs":
        column = model_set.output_names.index(place)
        return float(
            np.nanstd(np.concatenate([one.measured[:, column] for one in model_set.series]))
        )
    holes = place_bindings(model_set, section, place)
    factor = coefficient_value(
        model_set, model, holes.get("inertia" if section == "flow" else "stiffness", "")
    )
    name = place if section == "flow" else holes.get("twist", "")
    states = model.candidate.predictor.states
    if factor is None or name not in states:
        return 0.0
    runs = zip(model_set.series, model.prediction.predictions, strict=True)
    rows = [run.states[burn_in_samples(one) : run.completed] for one, run in runs]
    if section == "flow":
        period = float(model_set.period)
        moved = [np.diff(one[:, states.index(name)]) / period for one in rows]
        return factor * rms(np.concatenate(moved))
    gap = holes.get("gap", "")
    slack = [one[:, states.index(gap)] if gap in states else 0.0 for one in rows]
    twist = [one[:, states.index(name)] - free for one, free in zip(rows, slack, strict=True)]
    return factor * rms(np.concatenate(twist))


def disturbance_unit(model_set: ModelSet, section: str, place: str) -> str:
    """Return the unit of a disturbance at a place: of an output's signal, else of a force.

    The result is "" if no disturbance can be placed there.
    """
    return place_bindings(model_set, section, place).get(
        "unit" if section == "outputs" else "force", ""
    )


def place_bindings(model_set: ModelSet, section: str, place: str) -> dict[str, str]:
    """Return the names and texts that a disturbance effect binds at a place, by placeholder.

    Only bindings that are strings are included, such as `inertia` or `twist`. Empty if the section
    has no disturbance or the place does not match.
    """
    kind = DISTURBANCE_KIND_BY_SECTION.get(section)
    if kind is None:
        return {}
    found = find_effect_place(
        model_set.document.root, disturbance_effect(kind, place).effect, place
    )
    if isinstance(found, PlaceMismatch):
        return {}
    return {name: value for name, value in found.holes.items() if isinstance(value, str)}


def coefficient_value(model_set: ModelSet, model: Estimate, text: str) -> float | None:
    """Return the value of a coefficient [SI]: fitted if it is a parameter, else at declared
    parameters and the median states and inputs; None if it has no value.
    """
    fitted = model.values(0).get(text)
    if fitted is not None:
        return fitted
    states = np.concatenate([run.states[: run.completed] for run in model.prediction.predictions])
    inputs = np.concatenate([one.inputs for one in model_set.series])
    middle = np.concatenate([np.median(states, axis=0), np.median(inputs, axis=0)])
    names = [*model.candidate.predictor.states, *model_set.automaton.inputs]
    point = dict(zip(names, middle.tolist(), strict=True))
    return declared_value(model_set.automaton, text, point)


def rms(values: Reals) -> float:
    """Return the root mean square; 0 for no values."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else 0.0
