"""Show: results as tables for people and as JSON for machines."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from engine.trajectory import Event, Trajectory
from language.problem import Problem
from lockstep.compare import Verdict
from modewright.api import Replayed

MOST_EVENTS = 40
"""Longest table of events shown to a person; all of them are in --json."""


def print_json(value: Mapping[str, Any]) -> None:
    """Print one JSON document."""
    print(json.dumps(value, indent=2, allow_nan=False))


def events_table(events: Sequence[Event]) -> Table:
    """Return a table of transitions."""
    table = Table(
        "time [s]", "automaton", "from", "to", box=None, pad_edge=False, header_style="bold"
    )
    for event in events[:MOST_EVENTS]:
        table.add_row(
            f"{event.time:.9f}", event.instance, event.transition, event.source, event.target
        )
    if len(events) > MOST_EVENTS:
        table.add_row("...", f"{len(events) - MOST_EVENTS} more", "", "")
    return table


def verdict_table(verdicts: Iterable[Verdict]) -> Table:
    """Return a table of lock-step verdicts."""
    table = Table(
        "lock-step", "ticks", "transitions", "values", "differing", "verdict",
        box=None, pad_edge=False, header_style="bold",
    )  # fmt: skip
    for verdict in verdicts:
        word = "[green]equal, bit for bit[/]" if verdict.is_equal else "[red]DIFFERENT[/]"
        table.add_row(
            verdict.name,
            str(verdict.ticks),
            str(verdict.transitions),
            str(verdict.values),
            str(verdict.differing),
            word,
        )
    return table


def print_verdicts(console: Console, verdicts: Sequence[Verdict]) -> None:
    """Print the verdicts, and the first difference of each that has one."""
    console.print(verdict_table(verdicts))
    for verdict in verdicts:
        if verdict.first:
            console.print(f"first difference: {verdict.first}", soft_wrap=True, highlight=False)


def trajectory_json(trajectory: Trajectory) -> dict[str, Any]:
    """Return what a machine wants of a run: events, last values, why it stopped."""
    last = {
        name: (values[-1].item() if len(values) else None)
        for name, values in trajectory.signals.items()
    }
    return {
        "name": trajectory.name,
        "samples": len(trajectory.times),
        "events": [vars(event) for event in trajectory.events],
        "last": last,
        "units": dict(trajectory.units),
        "stopped": trajectory.stopped,
        "faults": list(trajectory.faults),
    }


def verdict_json(verdict: Verdict) -> dict[str, Any]:
    """Return a verdict as plain data."""
    return {
        "name": verdict.name,
        "program": verdict.program,
        "ticks": verdict.ticks,
        "values": verdict.values,
        "differing": verdict.differing,
        "transitions": verdict.transitions,
        "first": vars(verdict.first) if verdict.first else None,
    }


def replay_json(replayed: Replayed) -> dict[str, Any]:
    """Return a replay as plain data."""
    return {
        **trajectory_json(replayed.result.trajectory),
        "innovation_rms": dict(replayed.result.innovation_rms),
        "comparisons": [vars(comparison) for comparison in replayed.result.comparisons],
        "columns_left_out": list(replayed.left_out),
        "lockstep": verdict_json(replayed.verdict) if replayed.verdict else None,
    }


def problem_json(problem: Problem) -> dict[str, Any]:
    """Return a problem as plain data."""
    return {
        "severity": problem.severity,
        "kind": problem.kind,
        "file": problem.span.source.name,
        "line": problem.span.line,
        "column": problem.span.column,
        "message": problem.label,
        "help": problem.help,
    }


def print_replay(console: Console, replayed: Replayed) -> None:
    """Print transitions, innovations, comparisons and the lock-step verdict of a replay."""
    result = replayed.result
    times = result.trajectory.times
    console.print(f"{len(times)} ticks from {times[0]:.6g} s to {times[-1]:.6g} s", highlight=False)
    if result.trajectory.events:
        console.print(events_table(result.trajectory.events))
    else:
        console.print("no transitions")
    for name, rms in result.innovation_rms.items():
        unit = result.trajectory.units[f"in.{name}"]
        console.print(
            f"RMS of the one-step innovation of {name}: {rms:.4g} {unit}", highlight=False
        )
    for found in result.comparisons:
        text = f"{found.output} against the recording: RMS {found.rms:.4g} {found.unit}"
        console.print(f"{text}, largest {found.largest:.4g} {found.unit}", highlight=False)
    for name in replayed.left_out:
        console.print(f"`{name}` of the map is not read: there is no such input", highlight=False)
    if replayed.verdict:
        print_verdicts(console, [replayed.verdict])
