"""Finding: something about recorded data that a person should know before believing them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Severity = Literal["error", "warning", "note"]
"""An error makes a verdict about physics worthless, a warning may, a note does not."""
SEVERITIES: tuple[Severity, ...] = ("error", "warning", "note")
UNGROUPED_KINDS = ("no_signal", "outlier", "leap")
"""Kinds whose findings share a line only where they say the same."""


@dataclass(frozen=True)
class Finding:
    """What was found: `channel` is the name in the map, empty where it is the whole recording.

    Kinds: too_short, no_signal, dropped, gap, jitter, repeated, stuck, clipped, no_excitation,
    outlier, leap, time, clock_offset, sign, unit, swap, scale.
    """

    kind: str
    recording: str
    channel: str
    text: str
    severity: Severity
    window: tuple[float, float] | None = None


def sort_by_severity(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return findings without repetitions, the worst first."""
    unique = dict.fromkeys(findings)
    return tuple(sorted(unique, key=lambda finding: SEVERITIES.index(finding.severity)))


def format_findings(findings: Sequence[Finding]) -> list[tuple[Severity, str]]:
    """Return findings as lines, those of one kind together, the worst first.

    Values and reasons that are not the same are told in another line for each.
    """
    groups: dict[tuple[Severity, str, str], list[Finding]] = {}
    for finding in sort_by_severity(findings):
        why = finding.text if finding.kind in UNGROUPED_KINDS else ""
        groups.setdefault((finding.severity, finding.kind, why), []).append(finding)
    return [(severity, _format_group(group)) for (severity, _, _), group in groups.items()]


def _format_group(findings: Sequence[Finding]) -> str:
    first = findings[0]
    channels = ", ".join(f"`{name}`" for name in dict.fromkeys(f.channel for f in findings) if name)
    files = ", ".join(name for name in dict.fromkeys(f.recording for f in findings) if name)
    if "`" in first.text:  # it names the channel itself
        others = len(findings) - 1 if first.kind != "no_signal" else 0
        more = f", and {others} more like that" if others else ""
        return first.text + more + (f" ({files})" if files else "")
    channels += f" ({files})" if files and channels else files
    return f"{channels}: {first.text}" if channels else first.text
