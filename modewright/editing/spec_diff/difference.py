"""Difference: compare two specs in terms of modes, transitions, guards and parameters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from language.expressions.parser import parse_expression
from language.expressions.syntax_tree import Negation, NumberLiteral, SyntaxTree
from language.expressions.units import Dimension, are_compatible
from language.text.diagnostic import Problem, Problems, SpecError
from language.text.document import Document, Entry, MappingNode, ScalarNode, SequenceNode, YamlNode
from language.text.overlay import apply_overlay, without_keys
from modewright.editing.spec_diff.subject import (
    SUBSECTIONS,
    TEXT_GROUP,
    KeyPath,
    Subject,
    is_section,
    subject_of,
)

NUMBERED_SECTIONS = {"modes": "numbers of modes move", "faults": "bits of faults move"}
"""Sections whose entries are numbered in their order, with the effect of another order."""

ORDERED_SECTIONS = {
    "events": "simultaneous events are processed in another order",
    "regions": "simultaneous actions are executed in another order",
    "instances": "simultaneous actions are executed in another order",
}
"""Sections whose order matters, with the effect of another order.

`instances` are ordered as regions of an automaton only.
"""


def describe_reordering(section: str, old: MappingNode, new: MappingNode) -> str:
    """Return the effect of another order of the keys that a section has in both specs.

    `section` is the key of the section, `old` and `new` are its nodes. For NUMBERED_SECTIONS the
    number of a common key must change, also because a key was inserted before it; modes with an
    explicit `number` do not count. The result is empty for the same order and for sections in which
    the order has no effect.
    """
    before, after = _numbered_keys(section, old), _numbered_keys(section, new)
    both = [key for key in before if key in after]
    if section in NUMBERED_SECTIONS and _indices_of(both, before) != _indices_of(both, after):
        return NUMBERED_SECTIONS[section]
    if section in ORDERED_SECTIONS and both != [key for key in after if key in before]:
        return ORDERED_SECTIONS[section]
    return ""


def _indices_of(keys: Sequence[str], among: Sequence[str]) -> list[int]:
    """Return the indices of keys in a list."""
    return [among.index(key) for key in keys]


def _numbered_keys(section: str, table: MappingNode) -> list[str]:
    """Return the keys whose order counts: all except modes with an explicit number."""
    is_mode = section == "modes"
    return [
        e.key
        for e in table
        if not (is_mode and isinstance(e.node, MappingNode) and e.node.get("number"))
    ]


def expand_templates(root: MappingNode) -> MappingNode:
    """Return the tree of a spec with its templates applied to all modes that are `like` one.

    The keys `templates`, and `like` with a known template, are removed; an unknown `like` stays.
    """
    templates = root.get("templates")
    known = templates if isinstance(templates, MappingNode) else MappingNode({}, root.span)
    made = _expand_node(without_keys(root, "templates"), known)
    return made if isinstance(made, MappingNode) else root


def _expand_node(node: YamlNode, templates: MappingNode) -> YamlNode:
    """Return a node with templates applied to the modes in it."""
    if not isinstance(node, MappingNode):
        return node
    found = {}
    for entry in node:
        below = entry.node
        if entry.key == "modes" and isinstance(below, MappingNode):
            modes = {e.key: Entry(e.key, e.span, _expand_mode(e.node, templates)) for e in below}
            below = MappingNode(modes, below.span)
        elif entry.key == "regions":
            below = _expand_regions(below, templates)
        found[entry.key] = Entry(entry.key, entry.span, below)
    return MappingNode(found, node.span)


def _expand_regions(node: YamlNode, templates: MappingNode) -> YamlNode:
    """Return regions with templates applied."""
    if not isinstance(node, MappingNode):
        return node
    regions = {e.key: Entry(e.key, e.span, _expand_node(e.node, templates)) for e in node}
    return MappingNode(regions, node.span)


def _expand_mode(node: YamlNode, templates: MappingNode) -> YamlNode:
    """Return a mode with its template applied."""
    if not isinstance(node, MappingNode):
        return node
    like = node.get("like")
    template = templates.get(like.text) if isinstance(like, ScalarNode) else None
    if isinstance(template, MappingNode):
        node = apply_overlay(template, without_keys(node, "like"), Problems(), is_template=True)
    return _expand_node(node, templates)


MIN_RATIO_SHOWN = 5
"""Smallest ratio that is printed as a factor instead of a percentage."""

ChangeKind = Literal["added", "removed", "changed"]


@dataclass(frozen=True)
class SpecChange:
    """One difference: kind, subject and aspect, texts before and after with their places."""

    kind: ChangeKind
    group: str
    thing: str
    aspect: str
    before: str
    after: str
    note: str
    before_place: str
    after_place: str


def diff_documents(before: Document, after: Document) -> tuple[SpecChange, ...]:
    """Return the differences of two expanded documents; empty if there are none.

    They are grouped in the order of the first change of each group, with texts (`about`, `req`)
    last. Templates are applied first; the names of the specs, the order of keys without effect and
    the spelling of expressions do not count. Raises SpecError if the kinds differ.
    """
    if before.kind != after.kind:
        label = f"`{after.name}` is of kind {after.kind}, `{before.name}` of kind {before.kind}"
        raise SpecError([Problem("form", after.name_span, label, "specs of one kind are compared")])
    pair = _DocumentPair(expand_templates(before.root), expand_templates(after.root))
    heads = ("language", before.kind)
    found = [
        change
        for key in _union_keys(pair.before, pair.after)
        if key not in heads
        for change in pair.iter_changes((key,), pair.before.get(key), pair.after.get(key))
    ]
    order = [
        *dict.fromkeys(change.group for change in found if change.group != TEXT_GROUP),
        TEXT_GROUP,
    ]
    return tuple(sorted(found, key=lambda change: order.index(change.group)))


@dataclass(frozen=True)
class _DocumentPair:
    """Both trees with templates applied."""

    before: MappingNode
    after: MappingNode

    def iter_changes(
        self, path: KeyPath, old: YamlNode | None, new: YamlNode | None
    ) -> Iterator[SpecChange]:
        """Yield the differences below a path; a new or removed mode includes its content."""
        subject = subject_of(path, self.after if new is not None else self.before)
        if isinstance(old, MappingNode) and isinstance(new, MappingNode):
            if path != ("instances",) or "automaton" in self.after.entries:
                yield from _order_changes(path, old, new)
            for key in _union_keys(old, new):
                yield from self.iter_changes((*path, key), old.get(key), new.get(key))
            return
        changed_subject = subject or Subject("settings", ".".join(path), "")
        if old is not None and new is not None:
            if not _is_equivalent(old, new):
                yield _make_change("changed", changed_subject, old, new)
            return
        node = old if new is None else new
        assert node is not None
        inner = _subsections(node) if subject is None or subject.group == "modes" else []
        if subject is not None:
            yield _make_change("added" if old is None else "removed", subject, old, new)
        for key, below in inner:
            if old is None:
                yield from self.iter_changes((*path, key), None, below)
            else:
                yield from self.iter_changes((*path, key), below, None)


def _order_changes(path: KeyPath, old: MappingNode, new: MappingNode) -> Iterator[SpecChange]:
    """Yield the change of the order of a section if it has an effect."""
    section = path[-1]
    effect = describe_reordering(section, old, new) if is_section(path) else ""
    if effect:
        owner = ".".join(key for key in path[:-1] if key not in ("modes", "regions"))
        title = f"order in {owner}" if owner else "order"
        texts = (", ".join(old.entries), ", ".join(new.entries))
        yield SpecChange(
            "changed", section, title, "", *texts, effect, _format_place(old), _format_place(new)
        )


def _union_keys(old: MappingNode, new: MappingNode) -> list[str]:
    """Return the keys of both mappings, first those of the new one."""
    return list(dict.fromkeys((*new.entries, *old.entries)))


def _subsections(node: YamlNode) -> list[tuple[str, YamlNode]]:
    """Return the parts of a node that are separate subjects; of a mode its transitions etc."""
    if not isinstance(node, MappingNode):
        return []
    is_mode = any(entry.key in SUBSECTIONS for entry in node)
    return [(e.key, e.node) for e in node if e.key in SUBSECTIONS or not is_mode]


def _make_change(
    kind: ChangeKind, subject: Subject, old: YamlNode | None, new: YamlNode | None
) -> SpecChange:
    """Return the change of a subject with the texts of both nodes."""
    left_out = SUBSECTIONS if subject.group == "modes" else ()
    return SpecChange(
        kind=kind,
        group=subject.group,
        thing=subject.title,
        aspect=subject.aspect,
        before=_format_node(old, left_out) if old else "",
        after=_format_node(new, left_out) if new else "",
        note=_quantity_note(old, new, subject.group == "parameters") if old and new else "",
        before_place=_format_place(old),
        after_place=_format_place(new),
    )


def _format_place(node: YamlNode | None) -> str:
    """Return `file:line` of a node; empty for None."""
    return f"{node.span.source.name}:{node.span.line}" if node else ""


def _format_node(node: YamlNode, excluded: tuple[str, ...] = (), is_inner: bool = False) -> str:
    """Return a node on one line, without outer brackets and excluded keys."""
    match node:
        case ScalarNode():
            return node.text
        case SequenceNode(nodes):
            return f"[{', '.join(_format_node(part, (), True) for part in nodes)}]"
        case MappingNode():
            shown = [e for e in node if e.key not in excluded]
            text = ", ".join(
                f"{entry.key}: {_format_node(entry.node, (), True)}" for entry in shown
            )
            return f"{{{text}}}" if is_inner else text


def _is_equivalent(old: YamlNode, new: YamlNode) -> bool:
    """Return whether two values are equal; the spelling of expressions does not count."""
    match old, new:
        case ScalarNode(), ScalarNode():
            if old.text == new.text or old.text.split() == new.text.split():
                return True
            tree = _parse_or_none(old)
            return tree is not None and tree == _parse_or_none(new)
        case SequenceNode(), SequenceNode():
            same = len(old.nodes) == len(new.nodes)
            return same and all(map(_is_equivalent, old.nodes, new.nodes))
        case _:
            return False


def _parse_or_none(scalar: ScalarNode) -> SyntaxTree | None:
    """Return the tree of an expression; None if it is invalid."""
    try:
        return parse_expression(scalar)
    except SpecError:
        return None


def _quantity_note(old: YamlNode, new: YamlNode, is_value: bool) -> str:
    """Return the relative change of a quantity, `same value` or `other unit`; else empty.

    Numbers without unit are compared if they are values of parameters only.
    """
    first, second = _si_quantity(old), _si_quantity(new)
    if first is None or second is None:
        return ""
    if first[1].is_number and second[1].is_number and not is_value:
        return ""
    if not are_compatible(first[1], second[1]):
        return "other unit"
    if first[0] == second[0]:
        return "same value"
    if first[0] == 0:
        return ""
    ratio = second[0] / first[0]
    if ratio >= MIN_RATIO_SHOWN:
        return f"times {float(ratio):.3g}"
    return f"{float((second[0] - first[0]) / abs(first[0])) * 100:+.3g} %"


def _si_quantity(node: YamlNode) -> tuple[Fraction, Dimension] | None:
    """Return the SI value and the dimension of a literal; None for other nodes."""
    tree = _parse_or_none(node) if isinstance(node, ScalarNode) else None
    sign = -1 if isinstance(tree, Negation) else 1
    number = tree.operand if isinstance(tree, Negation) else tree
    return (
        (sign * number.value, number.unit.dimension) if isinstance(number, NumberLiteral) else None
    )
