"""Show difference: what differs between two specs as text, as plain data, as a page."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from importlib import resources
from typing import Any

import jinja2

from modewright.editing.difference import Change

LONGEST = 72
"""Characters of a value in a line of text; the page and the plain data have all of it."""
SIGNS = {"added": "+", "removed": "-", "changed": "~"}


def text_of(changes: Sequence[Change]) -> str:
    """Return the changes as lines, by groups; empty where nothing differs."""
    return "".join(f"{line}\n" for line in _lines(changes))


def _lines(changes: Sequence[Change]) -> Iterator[str]:
    if changes:
        yield summary_of(changes)
    for group, members in itertools.groupby(changes, lambda change: change.group):
        together = list(members)
        yield ""
        yield group
        width = max(len(_title(change)) for change in together)
        for change in together:
            yield f"  {SIGNS[change.kind]} {_title(change):{width}}  {_values(change)}".rstrip()


def _title(change: Change) -> str:
    return f"{change.thing}: {change.aspect}" if change.aspect else change.thing


def _values(change: Change) -> str:
    values = [_short(text) for text in (change.before, change.after) if text]
    note = f"  ({change.note})" if change.note else ""
    return " -> ".join(values) + note


def _short(text: str) -> str:
    return text if len(text) <= LONGEST else text[: LONGEST - 3] + "..."


def summary_of(changes: Sequence[Change]) -> str:
    """Return how many things of each group differ, in one line."""
    things: dict[str, set[str]] = {}
    for change in changes:
        things.setdefault(change.group, set()).add(change.thing)
    return "differs: " + ", ".join(f"{group} {len(named)}" for group, named in things.items())


def json_of(changes: Sequence[Change]) -> dict[str, Any]:
    """Return the changes as plain data."""
    return {"changes": [dataclasses.asdict(change) for change in changes]}


def page_of(changes: Sequence[Change], before: str, after: str) -> str:
    """Return the changes as one HTML page that needs no other file."""
    folder = resources.files("modewright.editing").joinpath("templates")
    environment = jinja2.Environment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True, autoescape=True
    )
    template = environment.from_string(folder.joinpath("difference.html.jinja").read_text("utf-8"))
    groups = [
        (group, list(members))
        for group, members in itertools.groupby(changes, lambda change: change.group)
    ]
    return template.render(
        before=before,
        after=after,
        groups=groups,
        signs=SIGNS,
        summary=summary_of(changes) if changes else "nothing differs",
    )
