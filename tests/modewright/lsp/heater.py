"""Heating: a small spec as an editor holds it, and what is asked about it."""

from __future__ import annotations

from operator import itemgetter
from pathlib import Path
from typing import Any

from tests.modewright.lsp.client import LspClient, Message

ROOT = Path(__file__).parents[3]
HEATER = """\
language: 1
automaton: heater
period: 10 ms
numbers: float64
parameters:
  T_on: {value: 18 degC, about: "below this it heats"}
  P_on: {value: 2 kW}
  P_low: {derived: P_on / 4, unit: W}
inputs: {T_room: {unit: degC, range: [-40, 80]}}
discrete: {P: {unit: W, initial: 0 W, range: [0, 5000]}}
initial: idle
modes:
  idle:
    entry: {P: 0 W}
    transitions: {heating: {when: T_room < T_on, wait: 50 ms}}
  heating:
    entry: {P: P_on}
    exit: {P: P_low}
    transitions: {idle: {when: T_room > T_on}}
outputs: [P, mode]
"""


def position_of(text: str, part: str, inside: int = 0) -> tuple[int, int]:
    """Return line (from 1) and column (from 0) of the first place of a part of a text."""
    before = text[: text.index(part) + inside]
    return before.count("\n") + 1, len(before.rpartition("\n")[2])


def completion_labels(talk: LspClient, path: Path, text: str) -> list[str]:
    """Return what is offered at the sign `|` of a text."""
    before, _, after = text.partition("|")
    talk.begin_change(path, before + after)
    place = (before.count("\n") + 1, len(before.rpartition("\n")[2]))
    found = talk.request("textDocument/completion", talk.at(path, *place))
    return [item["label"] for item in found["items"]]


def hover(talk: LspClient, path: Path, place: tuple[int, int]) -> str:
    told: Message | None = talk.request("textDocument/hover", talk.at(path, *place))
    return told["contents"]["value"] if told else ""


def apply_edits(text: str, edits: list[dict[str, Any]]) -> str:
    lines = text.split("\n")
    places = ((e["range"]["start"]["line"], e["range"]["start"]["character"]) for e in edits)
    for _, edit in sorted(zip(places, edits, strict=True), key=itemgetter(0), reverse=True):
        start, end = edit["range"]["start"], edit["range"]["end"]
        assert start["line"] == end["line"]
        line = lines[start["line"]]
        lines[start["line"]] = (
            line[: start["character"]] + edit["newText"] + line[end["character"] :]
        )
    return "\n".join(lines)
