"""Recording output: print the check of recordings."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from diagnosis.data_quality.channel import ChannelCheck
from diagnosis.data_quality.excitation import Excitation
from diagnosis.data_quality.finding import format_findings
from diagnosis.data_quality.recording_check import RecordingCheck
from engine.recordings.recording_file import Assumption
from language.text.sanitise import escape_invisible
from modewright.render.run import nonfinite_to_none
from modewright.runtime.json_format import format_entry

STYLES = {"error": "red", "warning": "yellow", "note": "dim"}
"""Styles of severities."""
MAX_CHANNELS = 24
"""Largest number of channels that are printed; --json has all."""


def print_check(screen: Console, check: RecordingCheck) -> None:
    """Print the channels, the assumptions, the excitation, the testable effects and the findings.

    Effects that cannot be tested are listed with what they need. Without findings a line says so.
    A quiet console gives errors only, on stderr.
    """
    if screen.quiet:
        for severity, line in format_findings(check.findings):
            if severity == "error":
                print(f"error: {escape_invisible(line)}", file=sys.stderr)
        return
    screen.print(channel_table(check.channels))
    if check.assumptions:
        screen.print()
        screen.print(assumption_table(check.assumptions))
    _print_excitation(screen, check.excitation)
    if not check.findings:
        screen.print("\n[green]nothing odd was found in these data[/]")
    else:
        screen.print()
    for severity, line in format_findings(check.findings):
        screen.print(f"[{STYLES[severity]}]{severity}[/]: {escape(line)}", highlight=False)


def channel_table(channels: Sequence[ChannelCheck]) -> Table:
    """Return a table of the first MAX_CHANNELS channels, and a row with the number of the others.

    Values are in the units of the map; a step (quantum) of 0 is `-`.
    """
    heads = ("recording", "channel", "signal", "unit", "rate", "jitter", "missing", "step", "noise")
    table = Table(*heads, "from", "to", box=None, pad_edge=False, header_style="bold")
    for channel in channels[:MAX_CHANNELS]:
        scale = abs(channel.factor)
        low, high = sorted((channel.low / channel.factor, channel.high / channel.factor))
        table.add_row(
            escape(channel.recording),
            escape(channel.name),
            escape(channel.signal if channel.signal != channel.name else ""),
            channel.unit,
            f"{channel.rate:.4g} Hz",
            f"{1e3 * channel.jitter:.2g} ms",
            f"{channel.dropped:.1%}",
            f"{channel.quantum / scale:.3g}" if channel.quantum else "-",
            f"{channel.noise / scale:.2g}",
            f"{low:.4g}",
            f"{high:.4g}",
        )
    if len(channels) > MAX_CHANNELS:
        table.add_row("...", f"{len(channels) - MAX_CHANNELS} more")
    return table


def assumption_table(assumptions: Sequence[tuple[str, Assumption]]) -> Table:
    """Return a table of what was assumed of each recording, and why."""
    heads = ("recording", "assumed", "value", "reason")
    table = Table(*heads, box=None, pad_edge=False, header_style="bold")
    for name, item in assumptions:
        table.add_row(*map(escape, (name, item.subject, item.value, item.reason)))
    return table


def _print_excitation(screen: Console, excitation: Excitation) -> None:
    """Print the excitation of inputs and speeds, and the effects that can be tested."""
    screen.print(f"\n{excitation.duration:.4g} s in all", highlight=False)
    for kind, signals in (("input", excitation.inputs), ("speed", excitation.speeds)):
        for one in signals:
            steps = f"{len(one.steps)} steps, " if kind == "input" else ""
            text = f"{kind} `{one.name}`: {steps}{one.sign_changes} changes of sign, "
            text += f"above its noise up to {one.band:.3g} Hz" if one.band else "nothing but noise"
            screen.print(escape(text), highlight=False)
    testable = [effect.effect for effect in excitation.effects if effect.is_testable]
    screen.print(f"\nthese data can test {', '.join(testable) or 'no effect'}", highlight=False)
    for lacking, effects in excitation.untestable.items():
        screen.print(f"not {', '.join(effects)}: needs {lacking}", highlight=False)


def check_json(check: RecordingCheck) -> dict[str, Any]:
    """Return a check with all channels as a dict for JSON; values in SI, not finite ones null."""
    excitation = check.excitation
    return {
        **format_entry("recording-check"),
        "usable": check.is_usable,
        "channels": [nonfinite_to_none(asdict(one)) for one in check.channels],
        "findings": [asdict(one) for one in check.findings],
        "duration": excitation.duration,
        "inputs": [nonfinite_to_none(asdict(one)) for one in excitation.inputs],
        "speeds": [nonfinite_to_none(asdict(one)) for one in excitation.speeds],
        "effects": {
            e.effect: {"testable": e.is_testable, "needs": e.lacking} for e in excitation.effects
        },
        "assumptions": [{"recording": name, **asdict(one)} for name, one in check.assumptions],
        "relations": [nonfinite_to_none(asdict(one)) for one in check.agreements],
    }
