"""Naming: effects and their places as verdicts name them, with fitted values and their spread."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimate import Estimate
from diagnosis.layers import Layer
from diagnosis.normal import solution
from diagnosis.verdict import Named, Quantity
from language.effect import own_names
from language.model import Automaton

Reals = NDArray[np.float64]
OTHER_NAMES = {
    "second_gap": ("backlash", "on an elastic element that has a gap"),
    "added_inertia": ("compliance", "on an inertia"),
}
"""Names that verdicts use: of which effect, and where."""
SECTIONS = {"balance": "flow", "input": "inputs", "output": "outputs", "element": "elements"}


def verdict_id(layer: Layer, automaton: Automaton) -> str:
    """Return the name of an effect: a second gap and an added inertia have one of their own."""
    element = automaton.elements.get(layer.place)
    if element is not None and layer.effect.name == "backlash" and "gap" in element.parts:
        return "second_gap"
    if element is not None and layer.effect.name == "compliance" and element.kind == "inertia":
        return "added_inertia"
    return layer.effect.name


def place_path(layer: Layer) -> str:
    """Return `section.name` of where an effect is laid."""
    return f"{SECTIONS[layer.effect.fits[0].kind]}.{layer.place}"


def brought_by(layer: Layer) -> dict[str, str]:
    """Return the names that an effect brings into a model, with those that it has for them."""
    return {layer.named(name): name for name in own_names(layer.effect.body)}


def named(layer: Layer, model: Estimate, automaton: Automaton) -> Named:
    """Return an effect of a model with its parameters, named as the effect names them."""
    quantities = quantities_of(model)
    brought = brought_by(layer)
    own = {
        brought[name]: quantity
        for name, quantity in quantities.items()
        if name in brought and name not in automaton.parameters
    }
    return Named(verdict_id(layer, automaton), place_path(layer), own)


def quantities_of(model: Estimate) -> dict[str, Quantity]:
    """Return all fitted parameters [SI]; those per recording as their mean."""
    spread = _spreads(model)
    recordings = len(model.point.own)
    each = [model.values(k) for k in range(recordings)]
    found = {}
    for k, one in enumerate(model.candidate.uncertain):
        value = float(np.mean([values[one.name] for values in each]))
        slope = one.sd * (value if one.is_log else 1.0)
        found[one.name] = Quantity(value, one.unit, abs(slope) * float(spread[k]))
    return found


def correlations_of(model: Estimate) -> Mapping[tuple[str, str], float]:
    """Return the correlations of the shared parameters of a fit, the strongest first."""
    covariance, names = covariance_of(model)
    sizes = np.sqrt(np.diag(covariance))
    found = {}
    for i, first in enumerate(names):
        for j in range(i):
            found[names[j], first] = float(covariance[i, j] / (sizes[i] * sizes[j]))
    return dict(sorted(found.items(), key=lambda item: -abs(item[1])))


def covariance_of(model: Estimate) -> tuple[Reals, list[str]]:
    """The covariance of the shared coordinates: the inverse of the normal equations with priors."""
    assert model.normal is not None
    free = ~model.normal.own
    whole = np.sum(model.normal.a, axis=0)[np.ix_(free, free)] + np.eye(int(free.sum()))
    names = [name for name, one in zip(model.candidate.names, free, strict=True) if one]
    return solution(whole, np.eye(len(whole))), names


def _spreads(model: Estimate) -> Reals:
    assert model.normal is not None
    covariance, _ = covariance_of(model)
    own = model.normal.own
    found = np.zeros(len(own))
    found[~own] = np.sqrt(np.diag(covariance))
    for k in np.flatnonzero(own):
        found[k] = 1.0 / np.sqrt(1.0 + float(np.mean(model.normal.a[:, k, k])))
    return found
