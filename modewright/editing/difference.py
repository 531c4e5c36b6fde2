"""Difference: what distinguishes two specs, in terms of modes, transitions, guards, parameters."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from language.document import Document, Items, Node, Scalar, Table
from language.parse import parse_expression
from language.problem import Problems, SpecError
from language.syntax import Negative, Number, Tree, alike
from language.units import Dimension, fits
from modewright.editing.order import what_moves
from modewright.editing.thing import SUBSECTIONS, TEXTS, Path, Thing, is_section, thing_of
from modewright.editing.unfolding import unfolded

MOST_PERCENT = 5
"""From this ratio on it is told itself."""
Kind = Literal["added", "removed", "changed"]


@dataclass(frozen=True)
class Change:
    """One difference: of what, in which respect, the texts before and after with their places."""

    kind: Kind
    group: str
    thing: str
    aspect: str
    before: str
    after: str
    note: str
    before_place: str
    after_place: str


def difference(before: Document, after: Document) -> tuple[Change, ...]:
    """Return what differs between two expanded documents, by groups. Raises SpecError."""
    if before.kind != after.kind:
        problems = Problems()
        label = f"`{after.name}` is of kind {after.kind}, `{before.name}` of kind {before.kind}"
        problems.error("form", after.name_span, label, "specs of one kind are compared")
        problems.stop_if_any()
    trees = _Trees(unfolded(before.root), unfolded(after.root))
    heads = ("language", before.kind)
    found = [
        change
        for key in _keys(trees.before, trees.after)
        if key not in heads
        for change in trees.changes((key,), trees.before.get(key), trees.after.get(key))
    ]
    order = [*dict.fromkeys(change.group for change in found if change.group != TEXTS), TEXTS]
    return tuple(sorted(found, key=lambda change: order.index(change.group)))


@dataclass(frozen=True)
class _Trees:
    """Both trees, templates applied."""

    before: Table
    after: Table

    def changes(self, path: Path, old: Node | None, new: Node | None) -> Iterator[Change]:
        """Yield what differs below a path; a mode that is new is told with what is in it."""
        thing = thing_of(path, self.after if new is not None else self.before)
        if isinstance(old, Table) and isinstance(new, Table):
            if path != ("instances",) or "automaton" in self.after.entries:
                yield from _moved(path, old, new)
            for key in _keys(old, new):
                yield from self.changes((*path, key), old.get(key), new.get(key))
            return
        whole = thing or Thing("settings", ".".join(path), "")
        if old is not None and new is not None:
            if not _is_same(old, new):
                yield _change("changed", whole, old, new)
            return
        node = old if new is None else new
        assert node is not None
        inner = _subsections(node) if thing is None or thing.group == "modes" else []
        if thing is not None:
            yield _change("added" if old is None else "removed", thing, old, new)
        for key, below in inner:
            if old is None:
                yield from self.changes((*path, key), None, below)
            else:
                yield from self.changes((*path, key), below, None)


def _moved(path: Path, old: Table, new: Table) -> Iterator[Change]:
    """Yield that the keys of a section have another order, where that means something."""
    section = path[-1]
    moves = what_moves(section, old, new) if is_section(path) else ""
    if moves:
        owner = ".".join(key for key in path[:-1] if key not in ("modes", "regions"))
        title = f"order in {owner}" if owner else "order"
        texts = (", ".join(old.entries), ", ".join(new.entries))
        yield Change("changed", section, title, "", *texts, moves, _place(old), _place(new))


def _keys(old: Table, new: Table) -> list[str]:
    return list(dict.fromkeys((*new.entries, *old.entries)))


def _subsections(node: Node) -> list[tuple[str, Node]]:
    """Return what is told on its own: of a mode its transitions and the like, else everything."""
    if not isinstance(node, Table):
        return []
    is_mode = any(entry.key in SUBSECTIONS for entry in node)
    return [(e.key, e.node) for e in node if e.key in SUBSECTIONS or not is_mode]


def _change(kind: Kind, thing: Thing, old: Node | None, new: Node | None) -> Change:
    left_out = SUBSECTIONS if thing.group == "modes" else ()
    return Change(
        kind=kind,
        group=thing.group,
        thing=thing.title,
        aspect=thing.aspect,
        before=_text(old, left_out) if old else "",
        after=_text(new, left_out) if new else "",
        note=_note(old, new, thing.group == "parameters") if old and new else "",
        before_place=_place(old),
        after_place=_place(new),
    )


def _place(node: Node | None) -> str:
    return f"{node.span.source.name}:{node.span.line}" if node else ""


def _text(node: Node, left_out: tuple[str, ...] = (), is_inner: bool = False) -> str:
    """Return a node on one line, without the brackets around all of it."""
    match node:
        case Scalar():
            return node.text
        case Items(nodes):
            return f"[{', '.join(_text(part, (), True) for part in nodes)}]"
        case Table():
            kept = [e for e in node if e.key not in left_out]
            text = ", ".join(f"{entry.key}: {_text(entry.node, (), True)}" for entry in kept)
            return f"{{{text}}}" if is_inner else text


def _is_same(old: Node, new: Node) -> bool:
    """Tell whether two values say the same; blanks in expressions do not count."""
    match old, new:
        case Scalar(), Scalar():
            if old.text == new.text or old.text.split() == new.text.split():
                return True
            first, second = _tree(old), _tree(new)
            return first is not None and second is not None and alike(first, second)
        case Items(), Items():
            same = len(old.nodes) == len(new.nodes)
            return same and all(map(_is_same, old.nodes, new.nodes))
        case _:
            return False


def _tree(scalar: Scalar) -> Tree | None:
    try:
        return parse_expression(scalar)
    except SpecError:
        return None


def _note(old: Node, new: Node, is_value: bool) -> str:
    """Return how much a quantity changed, or that it is the same in another unit.

    Of bare numbers that is told where they are values: a priority has no size.
    """
    first, second = _number(old), _number(new)
    if first is None or second is None:
        return ""
    if first[1].is_number and second[1].is_number and not is_value:
        return ""
    if not fits(first[1], second[1]):
        return "other unit"
    if first[0] == second[0]:
        return "same value"
    if first[0] == 0:
        return ""
    ratio = second[0] / first[0]
    if ratio >= MOST_PERCENT:
        return f"times {float(ratio):.3g}"
    return f"{float((second[0] - first[0]) / abs(first[0])) * 100:+.3g} %"


def _number(node: Node) -> tuple[Fraction, Dimension] | None:
    """Return a literal in SI and its dimension, None for other values."""
    tree = _tree(node) if isinstance(node, Scalar) else None
    sign = -1 if isinstance(tree, Negative) else 1
    number = tree.operand if isinstance(tree, Negative) else tree
    return (sign * number.value, number.unit.dimension) if isinstance(number, Number) else None
