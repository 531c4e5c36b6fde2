"""Redirect: within parts of an automaton's tree, what is read under one name becomes another."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

from language.document import Entry, Scalar, Table
from language.element import outputs_as_mapping
from language.known import entries_of
from language.passage import AUTOMATON, Path, changed
from language.problem import Span
from language.rewrite import reads, substituted

OWNERS = frozenset({"modes", "regions", "templates"})
Where = Callable[[Path], bool]


@dataclasses.dataclass(frozen=True)
class Part:
    """A part of a tree in which reads are redirected: `new` by old name; asked for at `span`."""

    paths: tuple[str, ...]
    excepted: tuple[str, ...]
    new: Mapping[str, str]
    span: Span


def redirected(tree: Table, part: Part) -> tuple[Table, frozenset[str]]:
    """Return a tree with the reads in a part redirected, and the names that were found there.

    In an equation the redirection reaches those that it alone reads, too: they are parts of it.
    """
    found: set[str] = set()
    where = _where(tree, part)

    def change(path: Path, scalar: Scalar) -> Scalar:
        if not where(path):
            return scalar
        text, hits = substituted(scalar.text, part.new)
        found.update(hits)
        return rewritten(scalar, text, part.span) if hits else scalar

    tree = changed(tree, AUTOMATON, change)
    outputs = tree.get("outputs")
    if outputs is not None and {"outputs", "everywhere"} & set(part.paths):
        table, hits = _outputs(outputs_as_mapping(outputs), part)
        found.update(hits)
        if hits:
            span = tree.entries["outputs"].span
            tree = Table({**tree.entries, "outputs": Entry("outputs", span, table)}, tree.span)
    return tree, frozenset(found)


def rewritten(scalar: Scalar, text: str, span: Span) -> Scalar:
    """Return a scalar with another text, made so by the overlay at `span`."""
    return dataclasses.replace(scalar, text=text, changes=(*scalar.changes, span))


def rebuilt(tree: Table, name: str, formula: Scalar) -> Table:
    """Return a tree whose equation of a name is a formula; `base` in it is what it was."""

    def change(path: Path, scalar: Scalar) -> Scalar:
        if not _stands(path, f"equations.{name}"):
            return scalar
        text, _ = substituted(formula.text, {"base": scalar.text})
        return rewritten(scalar, text, formula.span)

    return changed(tree, AUTOMATON, change)


def exists(tree: Table, key: str) -> bool:
    """Tell whether an expression stands under a key path such as `flow.w_w`."""
    if key in ("everywhere", "outputs"):
        return True
    found = []

    def look(path: Path, scalar: Scalar) -> Scalar:
        found.append(_stands(path, key))
        return scalar

    changed(tree, AUTOMATON, look)
    return any(found)


def _where(tree: Table, part: Part) -> Where:
    if "everywhere" in part.paths:
        return lambda path: not any(_stands(path, key) for key in part.excepted)
    keys = [name for path in part.paths for name in _with_parts(tree, path)]
    return lambda path: any(_stands(path, key) for key in keys)


def _stands(path: Path, key: str) -> bool:
    """Tell whether a path is a key path or below it; `flow.w` is that of the modes, too."""
    wanted = tuple(key.split("."))
    if path[: len(wanted)] == wanted:
        return True
    return path[0] in OWNERS and path[-len(wanted) :] == wanted


def _with_parts(tree: Table, key: str) -> list[str]:
    """Return an equation's key path with those of the equations that only it reads."""
    section, _, name = key.partition(".")
    if section != "equations":
        return [key]
    readers: dict[str, set[str]] = {}
    equations = {equation for equation, _ in entries_of(tree, "equations")}

    def look(path: Path, scalar: Scalar) -> Scalar:
        reader = path[-1] if path[-2:-1] == ("equations",) else ".".join(path)
        if path[0] not in ("elements", "places"):
            for read in reads(scalar.text):
                readers.setdefault(read, set()).add(reader)
        return scalar

    changed(tree, AUTOMATON, look)
    inside = {name}
    while True:
        more = {e for e in equations - inside if readers.get(e) and readers[e] <= inside}
        if not more:
            return [f"equations.{equation}" for equation in sorted(inside)]
        inside |= more


def _outputs(outputs: Table, part: Part) -> tuple[Table, set[str]]:
    entries, hits = {}, set()
    for entry in outputs:
        node = entry.node
        if isinstance(node, Scalar) and node.text in part.new:
            hits.add(node.text)
            node = rewritten(node, part.new[node.text], part.span)
        entries[entry.key] = Entry(entry.key, entry.span, node)
    return Table(entries, outputs.span), hits
