"""Naming: effects and their places as verdicts name them, with fitted values and their spread."""

from __future__ import annotations

from diagnosis.estimation.covariance import quantities_of
from diagnosis.estimation.estimate import Estimate
from diagnosis.model.placed_effect import PlacedEffect, effect_names, place_path
from diagnosis.result.verdict import NamedEffect
from language.model.automaton import Automaton

VERDICT_ALIASES = {
    "second_gap": ("backlash", "on an elastic element that has a gap"),
    "added_inertia": ("compliance", "on an inertia"),
}
"""Names that verdicts use: of which effect, and where."""


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
