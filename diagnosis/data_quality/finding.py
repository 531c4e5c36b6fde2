"""Finding: a problem of recorded data that a user should know."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

Severity = Literal["error", "warning", "note"]
"""An error makes a diagnosis unreliable, a warning may, a note does not."""
SEVERITIES: tuple[Severity, ...] = ("error", "warning", "note")
UNGROUPED_KINDS = ("no_signal", "outlier", "leap", "left_out")
"""Kinds whose findings share a line only if their texts are equal."""


@dataclass(frozen=True)
class Finding:
    """A finding on a channel (its name in the map), or on the whole recording if that is empty.

    The kinds are too_short, no_signal, dropped, gap, jitter, repeated, stuck, clipped,
    no_excitation, outlier, leap, time, clock_offset, sign, unit, swap, scale and left_out.
    """

    kind: str
    recording: str
    channel: str
    text: str
    severity: Severity
    window: tuple[float, float] | None = None


def sort_by_severity(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return the distinct findings, errors first, notes last, in a stable order."""
    unique = dict.fromkeys(findings)
    return tuple(sorted(unique, key=lambda finding: SEVERITIES.index(finding.severity)))


def format_findings(findings: Sequence[Finding]) -> list[tuple[Severity, str]]:
    """Return one line for each group of findings of one severity and kind, with its severity.

    Errors come first. The text is that of the first finding of a group; kinds in `UNGROUPED_KINDS`
    form a group for each text.
    """
    groups: dict[tuple[Severity, str, str], list[Finding]] = {}
    for finding in sort_by_severity(findings):
        why = finding.text if finding.kind in UNGROUPED_KINDS else ""
        groups.setdefault((finding.severity, finding.kind, why), []).append(finding)
    return [(severity, _format_group(group)) for (severity, _, _), group in groups.items()]


def _format_group(findings: Sequence[Finding]) -> str:
    """Return findings of one group as a line with their channels and recordings."""
    first = findings[0]
    channels = ", ".join(f"`{name}`" for name in dict.fromkeys(f.channel for f in findings) if name)
    files = ", ".join(name for name in dict.fromkeys(f.recording for f in findings) if name)
    if "`" in first.text:  # it names the channel itself
        others = len(findings) - 1 if first.kind != "no_signal" else 0
        more = f", and {others} more like that" if others else ""
        return first.text + more + (f" ({files})" if files else "")
    channels += f" ({files})" if files and channels else files
    return f"{channels}: {first.text}" if channels else first.text
