"""Effect names: names and places of effects in verdicts, with fitted values."""

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
"""Names of verdicts that differ from the effect's: the effect, and where it has this name."""


def verdict_id(placed_effect: PlacedEffect, automaton: Automaton) -> str:
    """Return the name of an effect in a verdict, which may be a key of `VERDICT_ALIASES`."""
    element, name = automaton.elements.get(placed_effect.place), placed_effect.effect.name
    if element is not None and name == "backlash" and "gap" in element.parts:
        return "second_gap"
    if element is not None and name == "compliance" and element.kind == "inertia":
        return "added_inertia"
    return name


def named_effect_of(
    placed_effect: PlacedEffect, model: Estimate, automaton: Automaton
) -> NamedEffect:
    """Return an effect with its fitted parameters, under their names in the effect file."""
    original_names = effect_names(placed_effect)
    own = {
        original_names[name]: quantity
        for name, quantity in quantities_of(model).items()
        if name in original_names and name not in automaton.parameters
    }
    return NamedEffect(verdict_id(placed_effect, automaton), place_path(placed_effect), own)
