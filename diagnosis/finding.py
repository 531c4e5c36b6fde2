"""Finding: something about recorded data that a person should know before believing them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Severity = Literal["error", "warning", "note"]
"""An error makes a verdict about physics worthless, a warning may, a note does not."""
ORDER: tuple[Severity, ...] = ("error", "warning", "note")


@dataclass(frozen=True)
class Finding:
    """What was found: `channel` is the name in the map, empty where it is the whole recording.

    Kinds: too_short, no_signal, dropped, gap, jitter, repeated, stuck, clipped, no_excitation,
    clock_offset, sign, unit, scale.
    """

    kind: str
    recording: str
    channel: str
    text: str
    severity: Severity
    window: tuple[float, float] | None = None


def by_severity(findings: list[Finding]) -> tuple[Finding, ...]:
    """Return findings without repetitions, the worst first."""
    unique = dict.fromkeys(findings)
    return tuple(sorted(unique, key=lambda finding: ORDER.index(finding.severity)))
