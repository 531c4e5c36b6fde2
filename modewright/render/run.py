"""Run output: print trajectories, lock-step verdicts, replays and comparisons."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from engine.results.run_comparison import ModeSequence, RunDifference
from engine.results.sampled_run import Event
from engine.results.trajectory import Trajectory
from lockstep.comparison import Verdict
from modewright.api.doctor import HealthCheck
from modewright.api.simulation import Replayed
from modewright.runtime.json_format import format_entry

MAX_EVENTS = 40
"""Largest number of transitions that are printed; --json has all."""


def print_json(value: Mapping[str, Any]) -> None:
    """Print one JSON document, indented by two blanks, to stdout.

    Raises ValueError for infinities and NaN.
    """
    print(json.dumps(value, indent=2, allow_nan=False))


def events_table(events: Sequence[Event]) -> Table:
    """Return a table of the events of a run; others than transitions have their message as target.

    Of more than MAX_EVENTS events the first and the last MAX_EVENTS / 2, and the first MAX_EVENTS
    that are no transitions, are shown; a row `...` has the number of those left out.
    """
    table = Table(
        escape("time [s]"), "automaton", "transition", "from", "to",
        box=None, pad_edge=False, header_style="bold",
    )  # fmt: skip
    shown = sorted(_select_events(events))
    for number, before in zip(shown, [-1, *shown], strict=False):
        if number > before + 1:
            table.add_row("...", f"{number - before - 1} more", "", "", "")
        event = events[number]
        change = (event.source, event.target)
        if event.kind != "transition":
            change = (event.source, escape(event.message))
        table.add_row(f"{event.time:.9f}", event.instance, event.transition, *change)
    return table


def _select_events(events: Sequence[Event]) -> set[int]:
    """Return the indices of the events to print.

    Of more than MAX_EVENTS these are the first and the last ones, and all that are no transitions.
    """
    numbers = range(len(events))
    if len(events) <= MAX_EVENTS:
        return set(numbers)
    others = [number for number in numbers if events[number].kind != "transition"]
    half = MAX_EVENTS // 2
    return {*numbers[:half], *numbers[-half:], *others[:MAX_EVENTS]}


def verdict_table(verdicts: Iterable[Verdict]) -> Table:
    """Return a table of lock-step verdicts: `equal, bit for bit`, `DIFFERENT` or `not compared`.

    An instance without ticks was not compared.
    """
    table = Table(
        "lock-step", "ticks", "transitions", "values", "differing", "verdict",
        box=None, pad_edge=False, header_style="bold",
    )  # fmt: skip
    for verdict in verdicts:
        word = "[green]equal, bit for bit[/]" if verdict.is_equal else "[red]DIFFERENT[/]"
        word = word if verdict.ticks else "[yellow]not compared[/]"
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
    """Print the table of lock-step verdicts, then the details of each verdict.

    These are its note, instruction counts and first difference; absent ones are left out.
    """
    console.print(verdict_table(verdicts))
    for verdict in verdicts:
        if verdict.note:
            console.print(f"{verdict.name}: {verdict.note}", soft_wrap=True, highlight=False)
        if verdict.instructions:
            count = len(verdict.instructions.steps)
            text = f"{verdict.name}: {verdict.instructions} instructions a step, of {count} steps"
            console.print(text, soft_wrap=True, highlight=False)
        if verdict.first:
            console.print(f"first difference: {verdict.first}", soft_wrap=True, highlight=False)


def trajectory_json(trajectory: Trajectory) -> dict[str, Any]:
    """Return name, number of samples, events, units, stop and faults of a run as a dict for JSON.

    `last` has the last value of each signal, None without samples; the samples are not contained.
    """
    last = {
        name: (values[-1].item() if len(values) else None)
        for name, values in trajectory.signals.items()
    }
    return {
        **format_entry("run"),
        "name": trajectory.name,
        "samples": len(trajectory.times),
        "events": [vars(event) for event in trajectory.events],
        "last": last,
        "units": dict(trajectory.units),
        "stopped": trajectory.stopped,
        "faults": list(trajectory.faults),
    }


def verdict_json(verdict: Verdict) -> dict[str, Any]:
    """Return a lock-step verdict as a dict for JSON.

    `first` is the first difference, `instructions` has steps, mean, min and max; both are None if
    absent.
    """
    return {
        "name": verdict.name,
        "program": verdict.program,
        "ticks": verdict.ticks,
        "values": verdict.values,
        "differing": verdict.differing,
        "transitions": verdict.transitions,
        "first": vars(verdict.first) if verdict.first else None,
        "note": verdict.note,
        "instructions": _instructions_json(verdict),
    }


def _instructions_json(verdict: Verdict) -> dict[str, Any] | None:
    """Return instruction counts as a dict for JSON; None without counts."""
    counts = verdict.instructions
    if counts is None:
        return None
    least, most = min(counts.steps, default=0), max(counts.steps, default=0)
    return {"steps": len(counts.steps), "mean": counts.mean, "min": least, "max": most}


def replay_json(replayed: Replayed) -> dict[str, Any]:
    """Return a replay as a dict for JSON.

    It has the keys and values of `trajectory_json`, but `format` is that of a replay
    (`modewright-replay/...`). In addition it has innovation_rms, comparisons, columns_left_out,
    assumptions and lockstep (the verdict, None without C).
    """
    return {
        **trajectory_json(replayed.result.trajectory),
        **format_entry("replay"),
        "innovation_rms": dict(replayed.result.innovation_rms),
        "comparisons": [vars(comparison) for comparison in replayed.result.comparisons],
        "columns_left_out": list(replayed.left_out),
        "assumptions": [vars(item) for item in replayed.recording.assumptions],
        "lockstep": verdict_json(replayed.verdict) if replayed.verdict else None,
    }


def print_replay(console: Console, replayed: Replayed) -> None:
    """Print ticks, events, innovations, comparisons and the lock-step verdict of a replay.

    Columns of the map that were left out are named; without a verdict that part is missing.
    """
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
    for item in replayed.recording.assumptions:
        console.print(escape(item.text), highlight=False, soft_wrap=True)
    for name in replayed.left_out:
        console.print(f"`{name}` of the map is not read: there is no such input", highlight=False)
    if replayed.verdict:
        print_verdicts(console, [replayed.verdict])


def print_difference(console: Console, difference: RunDifference) -> None:
    """Print the differences of two runs and whether they are within tolerance.

    Signals are a table with RMS, largest difference and the first time beyond tolerance; then
    follow the time shift, transition sequences, windows of different modes (at most MAX_EVENTS),
    signals of one run only, and the first difference.
    """
    table = Table(
        "signal", "unit", "RMS", "largest", escape("at [s]"), escape("beyond from [s]"),
        box=None, pad_edge=False, header_style="bold",
    )  # fmt: skip
    for item in difference.signals:
        first = "" if item.first is None else f"[red]{item.first:.9g}[/]"
        at = f"{item.at:.6g}" if item.largest else ""
        table.add_row(item.name, item.unit, f"{item.rms:.4g}", f"{item.largest:.4g}", at, first)
    console.print(table)
    if difference.renamed_instance:
        text = f"signals of `{difference.renamed_instance}` in B are compared by the names of A"
        console.print(text, highlight=False, soft_wrap=True)
    shift = difference.shift
    if shift.offset or shift.correlation is not None:
        how = (
            "" if shift.correlation is None else f", with a correlation of {shift.correlation:.4g}"
        )
        text = f"the times of B are shifted by {shift.offset:.9g} s{how}"
        console.print(text, highlight=False)
    for sequence in difference.sequences:
        console.print(_sequence_line(sequence), highlight=False)
    for window in difference.windows[:MAX_EVENTS]:
        span = f"{window.start:.9g} s to {window.end:.9g} s"
        text = f"{window.signal}: {span}: {window.a} in A, {window.b} in B"
        console.print(text, highlight=False, soft_wrap=True)
    if len(difference.windows) > MAX_EVENTS:
        console.print(f"{len(difference.windows) - MAX_EVENTS} more windows of disagreement")
    for names, letter in ((difference.only_a, "A"), (difference.only_b, "B")):
        if names:
            console.print(f"only in {letter}: {', '.join(names)}", highlight=False, soft_wrap=True)
    if difference.uncovered:
        console.print(f"{difference.uncovered:.6g} s are in one of the runs only", highlight=False)
    if difference.first:
        console.print(
            f"they part at {difference.first[0]:.9g} s: {difference.first[1]}", highlight=False
        )
    word = "within" if difference.is_within else "NOT within"
    console.print(f"{difference.samples} samples: {word} tolerance")


def difference_json(difference: RunDifference) -> dict[str, Any]:
    """Return the differences of two runs as a dict for JSON.

    In `signals` values that are not finite are null; `first` is [time, text] or None.
    """
    return {
        **format_entry("comparison"),
        "within": difference.is_within,
        "span": list(difference.span),
        "samples": difference.samples,
        "signals": [nonfinite_to_none(vars(item)) for item in difference.signals],
        "mode_windows": [vars(window) for window in difference.windows],
        "transitions": [vars(sequence) for sequence in difference.sequences],
        "only_a": list(difference.only_a),
        "only_b": list(difference.only_b),
        "uncovered": difference.uncovered,
        "offset": difference.shift.offset,
        "correlation": difference.shift.correlation,
        "first": list(difference.first) if difference.first else None,
    }


def _sequence_line(sequence: ModeSequence) -> str:
    """Return a line about the transition sequences of an instance in two runs."""
    counts = f"{sequence.count_a} transitions in A, {sequence.count_b} in B"
    same = f"the same, at most {sequence.largest_time_difference:.3g} s apart"
    order_text = (
        same
        if sequence.first_difference is None
        else f"not the same from number {sequence.first_difference + 1} on"
    )
    return f"{sequence.instance or 'automaton'}: {counts}, {order_text}"


def nonfinite_to_none(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a dict with None in place of infinities and NaN, also in lists and nested lists.

    Tuples become lists; nested dicts do not change.
    """
    return {name: _null_nonfinite_value(value) for name, value in values.items()}


def _null_nonfinite_value(value: Any) -> Any:
    """Return a value or a list with None in place of infinities and NaN."""
    if isinstance(value, tuple | list):
        return [_null_nonfinite_value(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_health_check(console: Console, check: HealthCheck) -> None:
    """Print a result of the doctor in one line, and its remedy in a second one if there is one."""
    colour = {"ok": "green", "absent": "yellow", "fault": "red"}[check.verdict]
    text = f"[{colour}]{check.verdict:<6}[/] {check.name:<12} {escape(check.message)}"
    console.print(text, highlight=False, soft_wrap=True)
    if check.help:
        console.print(f"       help: {escape(check.help)}", highlight=False, soft_wrap=True)
