"""Check of an effect on its own: what would be wrong with it at every place where it is laid."""

from __future__ import annotations

import re
from collections.abc import Collection

from language.document import Entry, Node, Scalar, Table
from language.function import KNOWN, miscounted
from language.parameter_reader import ParameterReader
from language.problem import Problems, Span, nearest
from language.reader import Reader
from language.syntax import Application, Tree, children
from language.tree import entries, items_of, one_line, put
from language.units import NO_UNIT, UNKNOWN_UNIT

HOLE = re.compile(r"\$[A-Za-z]\w*")
KEYED = ("terms", "equations", "redirect", "move")
"""Sections whose keys may be holes."""
UNITS = ("parameters", "states", "discrete")
"""Sections of what has a unit, which may be a hole."""
VALUES = ("value", "range", "neutral", "plain", "starts")
"""Keys of a parameter that are numbers in its unit."""


def check_holes(tree: Table, holes: Collection[str], problems: Problems) -> None:
    """Report keys and units with a hole that no place of the effect has."""
    texts = [(entry.key, entry.span) for section in KEYED for entry in entries(tree.get(section))]
    for section in UNITS:
        for entry in entries(tree.get(section)):
            unit = entry.node.get("unit") if isinstance(entry.node, Table) else None
            if isinstance(unit, Scalar):
                texts.append((unit.text, unit.span))
    for text, span in texts:
        for found in HOLE.finditer(text):
            hole = found.group()
            if hole not in holes:
                report_hole(hole, span.inside(found.start(), len(hole)), holes, problems)


def report_hole(hole: str, span: Span, holes: Collection[str], problems: Problems) -> None:
    """Report a hole that no place of the effect has."""
    label = f"`{hole}` is not a hole of the places where this effect fits"
    hint = nearest(hole, holes) or f"or `has: [{hole[1:]}]` says that it is"
    problems.error("effect", span, label, hint)


def check_functions(tree: Tree, problems: Problems) -> None:
    """Report functions that are none, or that take another number of arguments."""
    if isinstance(tree, Application):
        if tree.function not in KNOWN:
            hint = nearest(tree.function, KNOWN) or f"there are `{' '.join(KNOWN)}`"
            span = tree.span.inside(0, len(tree.function))
            problems.error("name", span, f"`{tree.function}` is not a function", hint)
        elif label := miscounted(tree):
            problems.error("arguments", tree.span, label)
    for part in children(tree):
        check_functions(part, problems)


def check_parameters(tree: Table, problems: Problems) -> None:
    """Report values, ranges and starts of parameters that are none or do not go together."""
    known = tree.get("parameters")
    if isinstance(known, Table):
        made = {entry.key: _without_hole(entry) for entry in known}
        tree = put(tree, ("parameters",), Table({k: e for k, e in made.items() if e}, known.span))
    ParameterReader(problems, tree).parameters()


def _without_hole(entry: Entry) -> Entry | None:
    """Return a parameter whose unit, where it is a hole, is a number.

    None for one whose units are known where the effect is laid alone: it mixes a hole with units
    of its own, or has a table with holes.
    """
    table = entry.node
    if not isinstance(table, Table) or not HOLE.search(one_line(table)):
        return entry
    if "table" in table.entries:
        return None
    if not (isinstance(unit := table.get("unit"), Scalar) and HOLE.search(unit.text)):
        return entry
    if any(_has_unit(table.get(key)) for key in VALUES):
        return None
    kept = {key: part for key, part in table.entries.items() if key != "unit"}
    return Entry(entry.key, entry.span, Table(kept, table.span))


def _has_unit(node: Node | None) -> bool:
    reader = Reader(Problems())
    own = [reader.quantity(item, "value", item.span, None)[1] for item in items_of(node)]
    return any(unit not in (NO_UNIT, UNKNOWN_UNIT) for unit in own)
