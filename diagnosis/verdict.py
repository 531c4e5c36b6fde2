"""Verdict: what a diagnosis says, as data; its JSON has the format `modewright-verdict/1`."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from diagnosis.locus import Locus

FORMAT = "modewright-verdict/1"
Says = Literal["effect", "nothing_missing", "unknown", "ambiguous"]


@dataclass(frozen=True)
class Quantity:
    """A fitted number [unit] with its standard deviation."""

    value: float
    unit: str
    std: float


@dataclass(frozen=True)
class Named:
    """An effect at a place (`section.name`) with its fitted parameters."""

    id: str
    place: str
    parameters: Mapping[str, Quantity]


@dataclass(frozen=True)
class Ranked:
    """A candidate: its probability, and what it gained in training [nats], give or take `std`."""

    id: str
    place: str
    probability: float
    train_gain: float
    std: float


@dataclass(frozen=True)
class Misfit:
    """Root mean square of what free simulation misses, before and after.

    As a part of the standard deviation of the recorded signal, and in SI.
    """

    nrmse_before: float
    nrmse_after: float
    rmse_before: float
    rmse_after: float


@dataclass(frozen=True)
class Verdict:
    """What was found: see docs/diagnosis.md for each part.

    `fit` is by set (`train`, `held_out`) and signal; `base` are the recalibrated parameters before
    and after the effects were accepted.
    """

    verdict: Says
    effects: tuple[Named, ...]
    candidates: tuple[Ranked, ...]
    other: float
    ambiguous_with: tuple[Named, ...]
    location: tuple[Locus, ...]
    fit: Mapping[str, Mapping[str, Misfit]]
    base: Mapping[str, tuple[Quantity, Quantity]]
    confirmed: bool | None
    runtime_s: float
    messages: tuple[str, ...] = ()
    inputs: Mapping[str, str] = field(default_factory=dict)

    def json(self) -> dict[str, Any]:
        """Return the verdict as written to `verdict.json`."""
        loci = [locus for locus in self.location if locus.gain > 0.0 or locus.named]
        worst = loci[0] if loci else None
        return {
            "format": FORMAT,
            "verdict": self.verdict,
            "effects": [_named(one) for one in self.effects],
            "candidates": [
                {
                    "id": one.id,
                    "place": one.place,
                    "probability": one.probability,
                    "train_gain": one.train_gain,
                    "std": one.std,
                }
                for one in self.candidates
            ],
            "other": self.other,
            "ambiguous_with": [{"id": one.id, "place": one.place} for one in self.ambiguous_with],
            "location": {
                "places": [locus.path for locus in loci],
                "signals": [name for name, _ in worst.along] if worst else [],
                "modes": dict(worst.modes) if worst else {},
                "windows": [list(window) for window in worst.windows] if worst else [],
            },
            "fit": {
                part: {signal: dataclasses.asdict(one) for signal, one in signals.items()}
                for part, signals in self.fit.items()
            },
            "base": {
                name: {"before": _quantity(before), "after": _quantity(after)}
                for name, (before, after) in self.base.items()
            },
            "confirmed": self.confirmed,
            "messages": list(self.messages),
            "inputs": dict(self.inputs),
            "runtime_s": self.runtime_s,
        }


def _named(one: Named) -> dict[str, Any]:
    return {
        "id": one.id,
        "place": one.place,
        "parameters": {name: _quantity(q) for name, q in one.parameters.items()},
    }


def _quantity(one: Quantity) -> dict[str, Any]:
    return {"value": one.value, "unit": one.unit, "std": one.std}
