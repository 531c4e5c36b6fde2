"""Label: the lines that stand at an arrow and in a box of a diagram, as the spec writes them."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from typing import Literal

from language.document import Items, Node, Scalar, Table
from language.text import shortened, visible

LONGEST = 1000
"""Characters of a label; expressions are shorter, other texts are cut."""
LABEL_WIDTH = 36
"""Longest line of a label [characters]."""
MOST_LINES = 6
"""Most lines of equations shown in a mode."""
Sort = Literal["", "final", "history"]
"""What a mode is: most are plain; one that nothing leaves; a place that enters another mode."""


def sort_of(mode: Table) -> Sort:
    """Return what a mode is, as its keys say."""
    if mode.get("history") is not None:
        return "history"
    return "final" if text_of(mode.get("final")) == "true" else ""


def label_of(transition: Table) -> Iterator[str]:
    """Yield the lines of a label: priority, event, guard, wait, resets and what else is said."""
    when, event = text_of(transition.get("when")), text_of(transition.get("event"))
    priority = text_of(transition.get("priority"))
    start = f"({priority}) " if priority else ""
    condition = " and ".join(
        part for part in (f"on {event.replace(', ', ' or ')}" if event else "", when) if part
    )
    yield from _wrapped(start + condition)
    if wait := text_of(transition.get("wait")):
        yield f"for {wait}"
    reset = transition.get("reset")
    for entry in reset if isinstance(reset, Table) else ():
        yield from _wrapped(f"/ {entry.key} = {text_of(entry.node)}")
    for key in ("raise", "history", "memory", "internal", "rewind"):
        if transition.get(key) is not None:
            yield from _wrapped(f"/ {key}: {text_of(transition.get(key))}")


def inside(node: Node) -> list[str]:
    """Return what holds in a mode: its equations, flow, updates and observer, shortened."""
    if not isinstance(node, Table):
        return []
    lines = _standing(node)
    for key in ("equations", "update", "entry", "exit"):
        part = node.get(key)
        word = "" if key == "equations" else f"{key} / "
        for entry in part if isinstance(part, Table) else ():
            lines += _wrapped(f"{word}{entry.key} = {text_of(entry.node)}")
    flow = node.get("flow")
    for entry in flow if isinstance(flow, Table) else ():
        lines += _wrapped(text_of(entry.node))
    for key in ("observer", "runs"):
        part = node.get(key)
        if isinstance(part, Table):
            of = text_of(part.get("of"))
            lines.append(f"{key} of {of}" if of else key)
    return lines if len(lines) <= MOST_LINES else [*lines[: MOST_LINES - 1], "..."]


def _standing(mode: Table) -> list[str]:
    """Return what a mode is where it is no plain one, as a line."""
    kept, first = text_of(mode.get("history")), text_of(mode.get("initial"))
    if kept:
        return _wrapped(f"{kept} history" + (f", else {first}" if first else ""))
    return ["final"] if sort_of(mode) == "final" else []


def _wrapped(text: str) -> list[str]:
    """Return a text in lines, parted before `and` and `or` where that is enough."""
    lines: list[str] = []
    plain = visible(shortened(" ".join(text.split()), LONGEST))
    for piece in re.split(r" (?=(?:and|or) )", plain):
        if lines and len(lines[-1]) + 1 + len(piece) <= LABEL_WIDTH:
            lines[-1] += " " + piece
        else:
            indent = "    " if lines else ""
            lines += textwrap.wrap(
                piece, LABEL_WIDTH, initial_indent=indent, subsequent_indent="    "
            )
    return lines


def text_of(node: Node | None) -> str:
    """Return a node as text in one line; empty where there is none."""
    if isinstance(node, Scalar):
        return visible(" ".join(node.text.split()))
    if isinstance(node, Table):
        return ", ".join(f"{entry.key} {text_of(entry.node)}" for entry in node)
    if isinstance(node, Items):
        return ", ".join(map(text_of, node.nodes))
    return ""
