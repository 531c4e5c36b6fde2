"""Show: what a person reads on the terminal."""

from __future__ import annotations

from typing import Literal

from rich.console import Console

from engine.results.sampled_run import Event
from modewright.render.run import MAX_EVENTS, events_table

Kind = Literal["transition", "range"]
HEADS = ["time [s]", "automaton", "transition", "from", "to"]


def event(time: float, kind: Kind = "transition") -> Event:
    return Event(time, 0, "keeper", "trip", "heating", "safe", kind=kind, message="left it")


def printed(events: list[Event]) -> list[str]:
    console = Console(width=120)
    with console.capture() as capture:
        console.print(events_table(events))
    return [line.rstrip() for line in capture.get().splitlines()]


def test_every_column_of_the_events_stands_below_its_head() -> None:
    heads, row = printed([event(0.5)])
    cells = ["0.500000000", "keeper", "trip", "heating", "safe"]
    assert [heads.rindex(head) for head in HEADS] == [row.rindex(cell) for cell in cells]


def test_what_is_no_transition_is_told_with_its_message() -> None:
    _, row = printed([event(0.5, "range")])
    assert row.split()[-3:] == ["heating", "left", "it"]


def test_a_long_table_has_its_first_and_its_last_events_and_says_what_is_between() -> None:
    lines = printed([event(float(i)) for i in range(MAX_EVENTS + 2)])
    half = MAX_EVENTS // 2
    assert lines[half + 1].split() == ["...", "2", "more"]
    del lines[half + 1]
    shown = [float(line.split()[0]) for line in lines[1:]]
    assert shown == [*range(half), *range(half + 2, MAX_EVENTS + 2)]
    assert len(printed([event(float(i)) for i in range(MAX_EVENTS)])) == MAX_EVENTS + 1


def test_what_is_no_transition_is_shown_in_the_middle_of_a_long_table() -> None:
    events = [event(float(i)) for i in range(MAX_EVENTS + 5)]
    events[MAX_EVENTS // 2 + 1] = event(MAX_EVENTS // 2 + 1.0, "range")
    rows = [line.split()[:3] for line in printed(events)[MAX_EVENTS // 2 + 1 :][:4]]
    assert rows == [
        ["...", "1", "more"],
        ["21.000000000", "keeper", "trip"],
        ["...", "3", "more"],
        ["25.000000000", "keeper", "trip"],
    ]
