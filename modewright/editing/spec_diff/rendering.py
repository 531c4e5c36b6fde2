"""Show difference: what differs between two specs as text, as plain data, as a page."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from importlib import resources
from typing import Any

import jinja2

from modewright.editing.spec_diff.difference import SpecChange

MAX_VALUE_LENGTH = 72
"""Characters of a value in a line of text; the page and the plain data have all of it."""
SIGNS = {"added": "+", "removed": "-", "changed": "~"}


def diff_text(changes: Sequence[SpecChange]) -> str:
    """Return the changes as lines, by groups; empty where nothing differs."""
    return "".join(f"{line}\n" for line in _diff_lines(changes))


def _diff_lines(changes: Sequence[SpecChange]) -> Iterator[str]:
    if changes:
        yield diff_summary(changes)
    for group, members in itertools.groupby(changes, lambda change: change.group):
        together = list(members)
        yield ""
        yield group
        width = max(len(_change_title(change)) for change in together)
        for change in together:
            yield f"  {SIGNS[change.kind]} {_change_title(change):{width}}  {_change_values(change)}".rstrip()


def _change_title(change: SpecChange) -> str:
    return f"{change.thing}: {change.aspect}" if change.aspect else change.thing


def _change_values(change: SpecChange) -> str:
    values = [_shorten(text) for text in (change.before, change.after) if text]
    note = f"  ({change.note})" if change.note else ""
    return " -> ".join(values) + note


def _shorten(text: str) -> str:
    return text if len(text) <= MAX_VALUE_LENGTH else text[: MAX_VALUE_LENGTH - 3] + "..."


def diff_summary(changes: Sequence[SpecChange]) -> str:
    """Return how many things of each group differ, in one line."""
    things: dict[str, set[str]] = {}
    for change in changes:
        things.setdefault(change.group, set()).add(change.thing)
    return "differs: " + ", ".join(f"{group} {len(named)}" for group, named in things.items())


def diff_json(changes: Sequence[SpecChange]) -> dict[str, Any]:
    """Return the changes as plain data."""
    return {"changes": [dataclasses.asdict(change) for change in changes]}


def diff_html(changes: Sequence[SpecChange], before: str, after: str) -> str:
    """Return the changes as one HTML page that needs no other file."""
    folder = resources.files("modewright.editing.spec_diff").joinpath("templates")
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
        summary=diff_summary(changes) if changes else "nothing differs",
    )
