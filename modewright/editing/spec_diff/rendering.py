"""Rendering: print the differences of specs as text, as JSON data and as an HTML page."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from typing import Any

from codegen.toolchain.templates import render_html
from modewright.editing.spec_diff.difference import SpecChange
from modewright.runtime.json_format import format_entry

SPEC_DIFF = __name__.rpartition(".")[0]
"""The package of the page's template."""
MAX_VALUE_LENGTH = 72
"""Longest value in a line of text; JSON and page have all of it."""
SIGNS = {"added": "+", "removed": "-", "changed": "~"}
"""Signs of the kinds of changes."""


def diff_text(changes: Sequence[SpecChange]) -> str:
    """Return the changes as text; empty without changes.

    The summary is followed by a section for each group, with a line `sign title before -> after
    (note)` for each change; signs are in SIGNS. Values are cut to MAX_VALUE_LENGTH.
    """
    return "".join(f"{line}\n" for line in _diff_lines(changes))


def _diff_lines(changes: Sequence[SpecChange]) -> Iterator[str]:
    """Yield the lines of the text."""
    if changes:
        yield diff_summary(changes)
    for group, members in itertools.groupby(changes, lambda change: change.group):
        together = list(members)
        yield ""
        yield group
        width = max(len(_change_title(change)) for change in together)
        for change in together:
            title, values = f"{_change_title(change):{width}}", _change_values(change)
            yield f"  {SIGNS[change.kind]} {title}  {values}".rstrip()


def _change_title(change: SpecChange) -> str:
    """Return subject and aspect of a change."""
    return f"{change.thing}: {change.aspect}" if change.aspect else change.thing


def _change_values(change: SpecChange) -> str:
    """Return the shortened values before and after, with the note."""
    values = [_shorten(text) for text in (change.before, change.after) if text]
    note = f"  ({change.note})" if change.note else ""
    return " -> ".join(values) + note


def _shorten(text: str) -> str:
    """Return a text cut to MAX_VALUE_LENGTH with an ellipsis."""
    return text if len(text) <= MAX_VALUE_LENGTH else text[: MAX_VALUE_LENGTH - 3] + "..."


def diff_summary(changes: Sequence[SpecChange]) -> str:
    """Return the number of changed subjects of each group in one line.

    The line is like `differs: parameters 2, modes 1`; several changes of one subject count once.
    """
    things: dict[str, set[str]] = {}
    for change in changes:
        things.setdefault(change.group, set()).add(change.thing)
    return "differs: " + ", ".join(f"{group} {len(named)}" for group, named in things.items())


def diff_json(changes: Sequence[SpecChange]) -> dict[str, Any]:
    """Return the changes, with all fields and full values, as a dict for JSON."""
    return {
        **format_entry("diff"),
        "changes": [dataclasses.asdict(change) for change in changes],
    }


def diff_html(changes: Sequence[SpecChange], before: str, after: str) -> str:
    """Return the changes as a self-contained HTML page.

    `before` and `after` are the names of the specs in the title. Without changes the page says so.
    """
    groups = [
        (group, list(members))
        for group, members in itertools.groupby(changes, lambda change: change.group)
    ]
    context = {
        "before": before,
        "after": after,
        "groups": groups,
        "signs": SIGNS,
        "summary": diff_summary(changes) if changes else "nothing differs",
    }
    return render_html((SPEC_DIFF,), "difference.html.jinja", context)
