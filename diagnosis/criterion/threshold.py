"""Thresholds: the log-likelihood gain [nats] that an effect needs to be accepted."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from diagnosis.model.placed_effect import PlacedEffect
from language.text.diagnostic import DataError
from language.text.regular_file import read_regular_bytes

DEFAULT_THRESHOLD = 20.0
"""Gain [nats] that an effect needs beyond the price of its parameters."""
FORMAT = "modewright-thresholds/1"


@dataclass(frozen=True)
class Thresholds:
    """The threshold [nats] of each group of effects, and the `default` one; `origin` in words.

    A group is an effect at all its places.
    """

    groups: Mapping[str, float] = field(default_factory=dict)
    default: float = DEFAULT_THRESHOLD
    origin: str = "the usual threshold"

    def threshold_of(self, placed_effect: PlacedEffect) -> float:
        """Return the threshold [nats] of a placed effect."""
        return self.groups.get(placed_effect.effect.name, self.default)

    @property
    def largest(self) -> float:
        """The largest threshold [nats]."""
        return max((self.default, *self.groups.values()))

    @property
    def text(self) -> str:
        """The threshold as text, or the smallest and the largest one: `45`, `20 to 61`."""
        least, most = min((self.default, *self.groups.values())), self.largest
        return f"{least:.0f}" if round(least) == round(most) else f"{least:.0f} to {most:.0f}"


DEFAULT_THRESHOLDS = Thresholds()
"""The default threshold for all effects."""


def format_thresholds(thresholds: Thresholds) -> str:
    """Return thresholds as the JSON text of a file."""
    groups = {name: round(value, 2) for name, value in sorted(thresholds.groups.items())}
    known = {"format": FORMAT, "usual": round(thresholds.default, 2), "effects": groups}
    return json.dumps({**known, "origin": thresholds.origin}, indent=1) + "\n"


def read_thresholds(path: Path) -> Thresholds:
    """Return the thresholds of a JSON file. Raises ValueError if it is unreadable or invalid."""
    try:
        known = json.loads(read_regular_bytes(path).decode("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise DataError(f"{path} cannot be read as thresholds: {error}") from None
    if not isinstance(known, dict) or known.get("format") != FORMAT:
        raise DataError(f"{path} holds no thresholds: its format is not {FORMAT}")
    usual, groups = known.get("usual", DEFAULT_THRESHOLD), known.get("effects", {})
    values = [usual, *groups.values()] if isinstance(groups, dict) else [None]
    if not all(_is_positive(value) for value in values):
        raise DataError(f"{path}: `usual` and each of `effects` is a number of nats above 0")
    origin = str(known.get("origin", "")) or f"those of {path.name}"
    return Thresholds({str(k): float(v) for k, v in groups.items()}, float(usual), origin)


def _is_positive(value: object) -> bool:
    """Return whether a value is a finite positive number."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and math.isfinite(float(str(value))) and float(str(value)) > 0.0
