"""Show recording: what a check of recordings found, for people and for machines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from diagnosis.channel_check import ChannelCheck
from diagnosis.excitation import Excitation
from diagnosis.finding import told
from diagnosis.recording_check import RecordingCheck
from modewright.show import finite

STYLES = {"error": "red", "warning": "yellow", "note": "dim"}
MOST_CHANNELS = 24
"""Longest table of channels shown to a person; all of them are in --json."""


def print_check(screen: Console, check: RecordingCheck) -> None:
    """Print the channels, what they excite and what was found."""
    screen.print(channel_table(check.channels))
    _print_excitation(screen, check.excitation)
    if not check.findings:
        screen.print("\n[green]nothing odd was found in these data[/]")
    else:
        screen.print()
    for severity, line in told(check.findings):
        screen.print(f"[{STYLES[severity]}]{severity}[/]: {escape(line)}", highlight=False)


def channel_table(channels: Sequence[ChannelCheck]) -> Table:
    """Return a table of channels, their values in the units of the map."""
    heads = ("recording", "channel", "signal", "unit", "rate", "jitter", "missing", "step", "noise")
    table = Table(*heads, "from", "to", box=None, pad_edge=False, header_style="bold")
    for one in channels[:MOST_CHANNELS]:
        table.add_row(
            escape(one.recording),
            escape(one.name),
            escape(one.signal if one.signal != one.name else ""),
            one.unit,
            f"{one.rate:.4g} Hz",
            f"{1e3 * one.jitter:.2g} ms",
            f"{one.dropped:.1%}",
            f"{one.quantum / one.factor:.3g}" if one.quantum else "-",
            f"{one.noise / one.factor:.2g}",
            f"{one.low / one.factor:.4g}",
            f"{one.high / one.factor:.4g}",
        )
    if len(channels) > MOST_CHANNELS:
        table.add_row("...", f"{len(channels) - MOST_CHANNELS} more")
    return table


def _print_excitation(screen: Console, excited: Excitation) -> None:
    screen.print(f"\n{excited.duration:.4g} s in all", highlight=False)
    for kind, signals in (("input", excited.inputs), ("speed", excited.speeds)):
        for one in signals:
            steps = f"{len(one.steps)} steps, " if kind == "input" else ""
            text = f"{kind} `{one.name}`: {steps}{one.sign_changes} changes of sign, "
            text += f"above its noise up to {one.band:.3g} Hz" if one.band else "nothing but noise"
            screen.print(escape(text), highlight=False)
    able = [effect.effect for effect in excited.effects if effect.is_testable]
    screen.print(f"\nthese data can test {', '.join(able) or 'no effect'}", highlight=False)
    unable: dict[str, list[str]] = {}
    for effect in excited.effects:
        if effect.lacking:
            unable.setdefault(" and ".join(effect.lacking), []).append(effect.effect)
    for lacking, effects in unable.items():
        screen.print(f"not {', '.join(effects)}: needs {lacking}", highlight=False)


def check_json(check: RecordingCheck) -> dict[str, Any]:
    """Return a check as JSON, values in SI."""
    excited = check.excitation
    return {
        "usable": check.is_usable,
        "channels": [finite(asdict(one)) for one in check.channels],
        "findings": [asdict(one) for one in check.findings],
        "duration": excited.duration,
        "inputs": [finite(asdict(one)) for one in excited.inputs],
        "speeds": [finite(asdict(one)) for one in excited.speeds],
        "effects": {
            e.effect: {"testable": e.is_testable, "needs": e.lacking} for e in excited.effects
        },
        "relations": [finite(asdict(one)) for one in check.relations],
    }
