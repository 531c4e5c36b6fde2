"""Diagram: the modes of an automaton as boxes and arrows, as the spec writes them.

It is read from the laid-out text, so that guards stand in it as their author wrote them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from language.document import Document, Entry, Items, Node, Table
from language.overlay import lay, without
from language.problem import Problems
from language.transition_table import with_transition_tables
from modewright.label import Sort, inside, label_of, sort_of, text_of

Key = tuple[str, ...]
Shade = Literal["", "covered", "part", "missed"]
"""What tests have reached of a mode or a transition; empty where nothing is said of it."""


@dataclass(frozen=True)
class Arrow:
    """A transition between two modes (paths from the root) with the lines of its label."""

    source: Key
    target: Key
    lines: tuple[str, ...]
    name: str = ""
    shade: Shade = ""


@dataclass(frozen=True)
class ModeBox:
    """A mode: its path, what holds in it, and its inner regions (none in a plain mode)."""

    path: Key
    lines: tuple[str, ...]
    regions: tuple[RegionBox, ...] = ()
    shade: Shade = ""
    sort: Sort = ""

    @property
    def name(self) -> str:
        """The name without the path."""
        return self.path[-1]


@dataclass(frozen=True)
class RegionBox:
    """Modes of which one is active, and the initial one; a name only if there are several."""

    name: str
    initial: str
    modes: tuple[ModeBox, ...]


@dataclass(frozen=True)
class Diagram:
    """All regions of an automaton and its transitions; a notebook shows it as a picture."""

    name: str
    about: str
    regions: tuple[RegionBox, ...]
    arrows: tuple[Arrow, ...]

    def mermaid(self) -> str:
        """Return the diagram as Mermaid text, for Markdown that Git hosts show."""
        from modewright.mermaid import mermaid

        return mermaid(self)

    def svg(self) -> str:
        """Return the diagram as an SVG document."""
        from modewright.diagram_svg import svg

        return svg(self)

    def _repr_svg_(self) -> str:
        return self.svg()


def diagram_of(document: Document) -> Diagram:
    """Return the diagram of an automaton's document, with variants laid over it already.

    The automaton must have been checked: targets are there.
    """
    templates = document.root.get("templates")
    root = _filled(document.root, templates) if isinstance(templates, Table) else document.root
    root = with_transition_tables(root, Problems())
    regions = [_with_fault(r, text_of(root.get("fault_mode"))) for r in _regions(root, ())]
    known = set(_paths(regions))
    arrows = [arrow for path, table in _modes(root, ()) for arrow in _arrows(path, table, known)]
    about = document.root.get("about")
    return Diagram(document.name, text_of(about), tuple(regions), tuple(arrows))


def _with_fault(region: RegionBox, fault_mode: str) -> RegionBox:
    """Return a region in which the mode that faults lead to says so."""
    boxes = tuple(
        dataclasses.replace(box, lines=("entered on a fault", *box.lines))
        if box.name == fault_mode
        else box
        for box in region.modes
    )
    return dataclasses.replace(region, modes=boxes)


def _filled(owner: Table, templates: Table) -> Table:
    """Return a table whose modes, inner ones too, are laid over the templates that they name."""
    template = templates.get(text_of(owner.get("like")))
    if isinstance(template, Table):
        owner = lay(template, without(owner, "like"), Problems(), template=True)
    entries = dict(owner.entries)
    for key in ("modes", "regions"):
        node = owner.get(key)
        if isinstance(node, Table):
            inner = {
                e.key: Entry(e.key, e.span, _filled(e.node, templates))
                for e in node
                if isinstance(e.node, Table)
            }
            entries[key] = Entry(key, owner.entries[key].span, Table(inner, node.span))
    return Table(entries, owner.span)


def lifted(arrow: Arrow) -> Arrow:
    """Return an arrow between modes of one region: those that hold its ends, which it names."""
    depth = 0
    for a, b in zip(arrow.source[:-1], arrow.target[:-1], strict=False):
        if a != b:
            break
        depth += 1
    source, target = arrow.source[: depth + 1], arrow.target[: depth + 1]
    lines = list(arrow.lines)
    if target != arrow.target:
        lines.insert(0, f"to {'.'.join(arrow.target[depth + 1 :])}")
    if source != arrow.source:
        lines.insert(0, f"from {'.'.join(arrow.source[depth + 1 :])}")
    return dataclasses.replace(arrow, source=source, target=target, lines=tuple(lines))


def _regions(owner: Table, path: Key) -> list[RegionBox]:
    """Return the regions of the automaton or of a mode: its `modes`, then its `regions`."""
    found = []
    modes, regions = owner.get("modes"), owner.get("regions")
    if isinstance(modes, Table):
        found.append(_region("chart" if regions else "", owner, modes, path))
    if isinstance(regions, Table):
        for entry in regions:
            inner = entry.node.get("modes") if isinstance(entry.node, Table) else None
            if isinstance(entry.node, Table) and isinstance(inner, Table):
                found.append(_region(entry.key, entry.node, inner, (*path, entry.key)))
    return found


def _region(name: str, owner: Table, modes: Table, path: Key) -> RegionBox:
    boxes = [
        ModeBox(
            (*path, entry.key),
            tuple(inside(entry.node)),
            tuple(_regions(entry.node, (*path, entry.key))),
            sort=sort_of(entry.node),
        )
        for entry in modes
        if isinstance(entry.node, Table)
    ]
    return RegionBox(
        name, text_of(owner.get("initial")) or next((b.name for b in boxes), ""), tuple(boxes)
    )


def _modes(owner: Table, path: Key) -> Iterator[tuple[Key, Table]]:
    """Yield every mode with its path, outer ones first."""
    regions = owner.get("regions")
    owners = [(path, owner)]
    if isinstance(regions, Table):
        owners += [((*path, e.key), e.node) for e in regions if isinstance(e.node, Table)]
    for place, each in owners:
        modes = each.get("modes")
        for entry in modes if isinstance(modes, Table) else ():
            if isinstance(entry.node, Table):
                yield (*place, entry.key), entry.node
                yield from _modes(entry.node, (*place, entry.key))


def _paths(regions: list[RegionBox] | tuple[RegionBox, ...]) -> Iterator[Key]:
    for region in regions:
        for mode in region.modes:
            yield mode.path
            yield from _paths(mode.regions)


def _arrows(path: Key, mode: Table, known: set[Key]) -> Iterator[Arrow]:
    transitions = mode.get("transitions")
    for entry in transitions if isinstance(transitions, Table) else ():
        if isinstance(entry.node, Table):
            label = tuple(label_of(entry.node))
            names = _names(entry.node.get("to"), entry.key)
            if not names:
                yield Arrow(path, path, (*label, "/ stays"), entry.key)
            for name in names:
                target = _target(tuple(name.split(".")), path, known)
                if target:
                    yield Arrow(path, target, label, entry.key)


def _names(to: Node | None, key: str) -> list[str]:
    """Return the targets of a transition: those of a list, the only one, or its key."""
    if isinstance(to, Items):
        return [text_of(item) for item in to.nodes]
    return [text_of(to) or key]


def _target(name: Key, path: Key, known: set[Key]) -> Key | None:
    """Return the mode that a name means: among the siblings first, then those of the parents."""
    for depth in range(len(path) - 1, -1, -1):
        if (*path[:depth], *name) in known:
            return (*path[:depth], *name)
    return None


def graph(reference: str, root: Path | None = None) -> Diagram:
    """Return the diagram of an automaton. Raises SpecError with all its problems."""
    from language.load import automaton_of
    from language.project import Project, expanded, read_document

    project = Project(root or Path())
    document = read_document(project.path_of(reference))
    automaton_of(document, project)
    return diagram_of(expanded(document, project))
