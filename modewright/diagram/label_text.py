"""Label text: format the labels of transitions and modes in a diagram."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from typing import Literal

from language.text.document import MappingNode, ScalarNode, SequenceNode, YamlNode
from language.text.sanitise import escape_invisible, truncate

MAX_TEXT_LENGTH = 1000
"""Longest text of a label [characters]; longer ones are truncated."""
LABEL_WIDTH = 36
"""Longest line of a label [characters]."""
MAX_MODE_LINES = 6
"""Largest number of lines in a mode."""
ModeKind = Literal["", "final", "history"]
"""The kind of a mode: normal, final (no transition leaves it) or history."""


def mode_kind_of(mode: MappingNode) -> ModeKind:
    """Return `history` for a mode with that key, `final` for `final: true`, else an empty text."""
    if mode.get("history") is not None:
        return "history"
    return "final" if node_text(mode.get("final")) == "true" else ""


def label_lines(transition: MappingNode) -> Iterator[str]:
    """Yield the lines of a transition's label: condition, wait, resets, other keys.

    The first line is `(priority) on event and guard` with the parts that exist, empty without any;
    then `for wait`, `/ name = value` for each reset, and `/ key: value` for raise, history, memory,
    internal and rewind. Lines are broken at LABEL_WIDTH.
    """
    when, event = node_text(transition.get("when")), node_text(transition.get("event"))
    priority = node_text(transition.get("priority"))
    start = f"({priority}) " if priority else ""
    condition = " and ".join(
        part for part in (f"on {event.replace(', ', ' or ')}" if event else "", when) if part
    )
    yield from _wrap_text(start + condition)
    if wait := node_text(transition.get("wait")):
        yield f"for {wait}"
    reset = transition.get("reset")
    for entry in reset if isinstance(reset, MappingNode) else ():
        yield from _wrap_text(f"/ {entry.key} = {node_text(entry.node)}")
    for key in ("raise", "history", "memory", "internal", "rewind"):
        if transition.get(key) is not None:
            yield from _wrap_text(f"/ {key}: {node_text(transition.get(key))}")


def mode_lines(node: YamlNode) -> list[str]:
    """Return the lines of a mode; an empty list if the node is no mapping.

    The order is: history or final, equations, update, entry, exit, flow, observer and run. Lines
    are broken at LABEL_WIDTH. Of more than MAX_MODE_LINES lines the last ones are replaced by
    `...`.
    """
    if not isinstance(node, MappingNode):
        return []
    lines = _pseudostate_lines(node)
    for key in ("equations", "update", "entry", "exit"):
        part = node.get(key)
        word = "" if key == "equations" else f"{key} / "
        for entry in part if isinstance(part, MappingNode) else ():
            lines += _wrap_text(f"{word}{entry.key} = {node_text(entry.node)}")
    flow = node.get("flow")
    for entry in flow if isinstance(flow, MappingNode) else ():
        lines += _wrap_text(node_text(entry.node))
    for key in ("observer", "runs"):
        part = node.get(key)
        if isinstance(part, MappingNode):
            of = node_text(part.get("of"))
            lines.append(f"{key} of {of}" if of else key)
    return lines if len(lines) <= MAX_MODE_LINES else [*lines[: MAX_MODE_LINES - 1], "..."]


def _pseudostate_lines(mode: MappingNode) -> list[str]:
    """Return the line of a history or final mode; empty for normal modes."""
    history, first = node_text(mode.get("history")), node_text(mode.get("initial"))
    if history:
        return _wrap_text(f"{history} history" + (f", else {first}" if first else ""))
    return ["final"] if mode_kind_of(mode) == "final" else []


def _wrap_text(text: str) -> list[str]:
    """Return a text in lines of LABEL_WIDTH, broken before `and` and `or` if possible."""
    lines: list[str] = []
    visible_text = escape_invisible(truncate(" ".join(text.split()), MAX_TEXT_LENGTH))
    for piece in re.split(r" (?=(?:and|or) )", visible_text):
        if lines and len(lines[-1]) + 1 + len(piece) <= LABEL_WIDTH:
            lines[-1] += " " + piece
        else:
            indent = "    " if lines else ""
            lines += textwrap.wrap(
                piece, LABEL_WIDTH, initial_indent=indent, subsequent_indent="    "
            )
    return lines


def node_text(node: YamlNode | None) -> str:
    """Return a node as one line of text; empty for None.

    Items of lists are separated by `, `, entries of mappings are `key value`; runs of white space
    become one blank and invisible characters escapes.
    """
    if isinstance(node, ScalarNode):
        return escape_invisible(" ".join(node.text.split()))
    if isinstance(node, MappingNode):
        return ", ".join(f"{entry.key} {node_text(entry.node)}" for entry in node)
    if isinstance(node, SequenceNode):
        return ", ".join(map(node_text, node.nodes))
    return ""
