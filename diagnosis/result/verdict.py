"""Verdict: the result of a diagnosis as data; its JSON has the format `modewright-verdict/1`."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from diagnosis.estimation.covariance import quantities_of
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.quantity import Quantity
from diagnosis.localisation.location import Location
from diagnosis.model.placed_effect import PlacedEffect, effect_names, place_path
from diagnosis.validation.free_simulation import Misfit
from language.model.automaton import Automaton

FORMAT = "modewright-verdict/1"

DecisionOutcome = Literal["effect", "nothing_missing", "unknown", "ambiguous"]


@dataclass(frozen=True)
class NamedEffect:
    """An effect at a place (`section.name`) with its fitted parameters."""

    id: str
    place: str
    parameters: Mapping[str, Quantity]


@dataclass(frozen=True)
class RankedCandidate:
    """A candidate with its probability and its penalised gain [nats] ± `std`."""

    id: str
    place: str
    probability: float
    train_gain: float
    std: float


@dataclass(frozen=True)
class Verdict:
    """The result of a diagnosis; docs/diagnosis.md describes each part.

    `fit` gives misfits by set and signal, `base` parameters before and after effects.
    """

    verdict: DecisionOutcome
    effects: tuple[NamedEffect, ...]
    candidates: tuple[RankedCandidate, ...]
    other: float
    ambiguous_with: tuple[NamedEffect, ...]
    location: tuple[Location, ...]
    fit: Mapping[str, Mapping[str, Misfit]]
    base: Mapping[str, tuple[Quantity, Quantity]]
    confirmed: bool | None
    runtime_s: float
    messages: tuple[str, ...] = ()
    inputs: Mapping[str, str] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return the content of `verdict.json`, with the locations that gain or are accepted.

        Numbers that are not finite are None.
        """
        locations = [one for one in self.location if one.gain > 0.0 or one.is_accepted]
        worst = locations[0] if locations else None
        found = {
            "format": FORMAT,
            "verdict": self.verdict,
            "effects": [dataclasses.asdict(one) for one in self.effects],
            "candidates": [dataclasses.asdict(one) for one in self.candidates],
            "other": self.other,
            "ambiguous_with": [{"id": one.id, "place": one.place} for one in self.ambiguous_with],
            "location": {
                "places": [location.path for location in locations],
                "signals": [name for name, _ in worst.correlates] if worst else [],
                "modes": dict(worst.modes) if worst else {},
                "windows": [list(window) for window in worst.windows] if worst else [],
            },
            "fit": {
                part: {signal: dataclasses.asdict(one) for signal, one in signals.items()}
                for part, signals in self.fit.items()
            },
            "base": {
                name: {"before": dataclasses.asdict(before), "after": dataclasses.asdict(after)}
                for name, (before, after) in self.base.items()
            },
            "confirmed": self.confirmed,
            "messages": list(self.messages),
            "inputs": dict(self.inputs),
            "runtime_s": self.runtime_s,
        }
        return {key: replace_non_finite(value) for key, value in found.items()}


def replace_non_finite(value: Any) -> Any:
    """Return dicts and lists with None in place of floats that are not finite."""
    if isinstance(value, dict):
        return {key: replace_non_finite(one) for key, one in value.items()}
    if isinstance(value, list):
        return [replace_non_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


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
