"""Naming: effects and their places as verdicts name them, with fitted values and their spread."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from diagnosis.estimate import Estimate
from diagnosis.layers import PlacedEffect
from diagnosis.normal import solve
from diagnosis.verdict import NamedEffect, Quantity
from language.model.automaton import Automaton
from language.overlays.effect_reader import added_names

Reals = NDArray[np.float64]
VERDICT_ALIASES = {
    "second_gap": ("backlash", "on an elastic element that has a gap"),
    "added_inertia": ("compliance", "on an inertia"),
}
"""Names that verdicts use: of which effect, and where."""
SECTION_BY_PLACE_KIND = {
    "balance": "flow",
    "input": "inputs",
    "output": "outputs",
    "element": "elements",
}


def verdict_id(placed_effect: PlacedEffect, automaton: Automaton) -> str:
    """Return the name of an effect: a second gap and an added inertia have one of their own."""
    element = automaton.elements.get(placed_effect.place)
    if element is not None and placed_effect.effect.name == "backlash" and "gap" in element.parts:
        return "second_gap"
    if (
        element is not None
        and placed_effect.effect.name == "compliance"
        and element.kind == "inertia"
    ):
        return "added_inertia"
    return placed_effect.effect.name


def place_path(placed_effect: PlacedEffect) -> str:
    """Return `section.name` of where an effect is laid."""
    return f"{SECTION_BY_PLACE_KIND[placed_effect.effect.place_patterns[0].kind]}.{placed_effect.place}"


def effect_names(placed_effect: PlacedEffect) -> dict[str, str]:
    """Return the names that an effect brings into a model, with those that it has for them."""
    return {
        placed_effect.qualified_name(name): name for name in added_names(placed_effect.effect.body)
    }


def named_effect_of(
    placed_effect: PlacedEffect, model: Estimate, automaton: Automaton
) -> NamedEffect:
    """Return an effect of a model with its parameters, named as the effect names them."""
    quantities = quantities_of(model)
    brought = effect_names(placed_effect)
    own = {
        brought[name]: quantity
        for name, quantity in quantities.items()
        if name in brought and name not in automaton.parameters
    }
    return NamedEffect(verdict_id(placed_effect, automaton), place_path(placed_effect), own)


def quantities_of(model: Estimate) -> dict[str, Quantity]:
    """Return all fitted parameters [SI]; those per recording as their mean."""
    spread = _coordinate_stds(model)
    recordings = len(model.point.per_recording)
    each = [model.values(k) for k in range(recordings)]
    quantities = {}
    for k, one in enumerate(model.candidate.free_parameters):
        value = float(np.mean([values[one.name] for values in each]))
        slope = one.sd * (value if one.is_log else 1.0)
        quantities[one.name] = Quantity(value, one.unit, abs(slope) * float(spread[k]))
    return quantities


def correlations_of(model: Estimate) -> Mapping[tuple[str, str], float]:
    """Return the correlations of the shared parameters of a fit, the strongest first."""
    covariance, names = covariance_of(model)
    sizes = np.sqrt(np.diag(covariance))
    correlations = {}
    for i, first in enumerate(names):
        for j in range(i):
            correlations[names[j], first] = float(covariance[i, j] / (sizes[i] * sizes[j]))
    return dict(sorted(correlations.items(), key=lambda item: -abs(item[1])))


def covariance_of(model: Estimate) -> tuple[Reals, list[str]]:
    """The covariance of the shared coordinates: the inverse of the normal equations with priors."""
    assert model.normal_equations is not None
    free = ~model.normal_equations.own
    whole = np.sum(model.normal_equations.a, axis=0)[np.ix_(free, free)] + np.eye(int(free.sum()))
    names = [name for name, one in zip(model.candidate.names, free, strict=True) if one]
    return solve(whole, np.eye(len(whole))), names


def _coordinate_stds(model: Estimate) -> Reals:
    assert model.normal_equations is not None
    covariance, _ = covariance_of(model)
    own = model.normal_equations.own
    stds = np.zeros(len(own))
    stds[~own] = np.sqrt(np.diag(covariance))
    for k in np.flatnonzero(own):
        stds[k] = 1.0 / np.sqrt(1.0 + float(np.mean(model.normal_equations.a[:, k, k])))
    return stds
