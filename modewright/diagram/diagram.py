"""Diagram: read the modes and transitions of an automaton from its expanded document.

The text of the document is used so that guards appear as the author wrote them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

from language.readers.transition_table_reader import expand_transition_tables
from language.text.arguments import PathText, to_project, to_text
from language.text.diagnostic import Problems
from language.text.document import Document, Entry, MappingNode, SequenceNode, YamlNode
from language.text.overlay import apply_overlay, without_keys
from modewright.diagram.diagram_elements import Arrow, ModeBox, ModePath, RegionBox
from modewright.diagram.label_text import label_lines, mode_kind_of, mode_lines, node_text


@dataclass(frozen=True)
class Diagram:
    """All regions and transitions of an automaton; a notebook displays it as SVG."""

    name: str
    about: str
    regions: tuple[RegionBox, ...]
    arrows: tuple[Arrow, ...]

    def mermaid(self) -> str:
        """Return the diagram as Mermaid text (`stateDiagram-v2`) for Markdown; without coverage."""
        from modewright.diagram.mermaid import render_mermaid

        return render_mermaid(self.name, self.regions, self.arrows)

    def svg(self) -> str:
        """Return the diagram as an SVG document; shades of test coverage are shown as colours."""
        from modewright.diagram.svg import render_svg

        return render_svg(self.name, self.regions, self.arrows)

    def _repr_svg_(self) -> str:
        """Return the SVG for notebooks."""
        return self.svg()


def diagram_of(document: Document) -> Diagram:
    """Return the diagram of the expanded document of an automaton.

    Templates and transition tables are expanded first. There is an arrow for each target of a
    transition, and one from a mode to itself for an internal transition; unknown targets are
    skipped, because the automaton is expected to be valid.
    """
    templates = document.root.get("templates")
    root = (
        _apply_templates(document.root, templates)
        if isinstance(templates, MappingNode)
        else document.root
    )
    root = expand_transition_tables(root, Problems())
    regions = [
        _mark_fault_mode(r, node_text(root.get("fault_mode"))) for r in _region_boxes(root, ())
    ]
    known = set(_iter_mode_paths(regions))
    arrows = [
        arrow
        for path, table in _iter_modes(root, ())
        for arrow in _transition_arrows(path, table, known)
    ]
    about = document.root.get("about")
    return Diagram(document.name, node_text(about), tuple(regions), tuple(arrows))


def _mark_fault_mode(region: RegionBox, fault_mode: str) -> RegionBox:
    """Return a region whose fault mode has an additional line."""
    boxes = tuple(
        dataclasses.replace(box, lines=("entered on a fault", *box.lines))
        if box.name == fault_mode
        else box
        for box in region.modes
    )
    return dataclasses.replace(region, modes=boxes)


def _apply_templates(owner: MappingNode, templates: MappingNode) -> MappingNode:
    """Return a mapping whose modes, at all depths, have their templates applied."""
    template = templates.get(node_text(owner.get("like")))
    if isinstance(template, MappingNode):
        owner = apply_overlay(template, without_keys(owner, "like"), Problems(), is_template=True)
    entries = dict(owner.entries)
    for key in ("modes", "regions"):
        node = owner.get(key)
        if isinstance(node, MappingNode):
            inner = {
                e.key: Entry(e.key, e.span, _apply_templates(e.node, templates))
                for e in node
                if isinstance(e.node, MappingNode)
            }
            entries[key] = Entry(key, owner.entries[key].span, MappingNode(inner, node.span))
    return MappingNode(entries, owner.span)


def _region_boxes(owner: MappingNode, path: ModePath) -> list[RegionBox]:
    """Return the regions of the automaton or of a mode: first its `modes`, then its `regions`."""
    boxes = []
    modes, regions = owner.get("modes"), owner.get("regions")
    if isinstance(modes, MappingNode):
        boxes.append(_region_box("chart" if regions else "", owner, modes, path))
    if isinstance(regions, MappingNode):
        for entry in regions:
            inner = entry.node.get("modes") if isinstance(entry.node, MappingNode) else None
            if isinstance(entry.node, MappingNode) and isinstance(inner, MappingNode):
                boxes.append(_region_box(entry.key, entry.node, inner, (*path, entry.key)))
    return boxes


def _region_box(name: str, owner: MappingNode, modes: MappingNode, path: ModePath) -> RegionBox:
    """Return a region with its modes; the initial mode defaults to the first one."""
    boxes = [
        ModeBox(
            (*path, entry.key),
            tuple(mode_lines(entry.node)),
            tuple(_region_boxes(entry.node, (*path, entry.key))),
            kind=mode_kind_of(entry.node),
        )
        for entry in modes
        if isinstance(entry.node, MappingNode)
    ]
    return RegionBox(
        name, node_text(owner.get("initial")) or next((b.name for b in boxes), ""), tuple(boxes)
    )


def _iter_modes(owner: MappingNode, path: ModePath) -> Iterator[tuple[ModePath, MappingNode]]:
    """Yield path and node of each mode, outer modes first."""
    regions = owner.get("regions")
    owners = [(path, owner)]
    if isinstance(regions, MappingNode):
        owners += [((*path, e.key), e.node) for e in regions if isinstance(e.node, MappingNode)]
    for place, each in owners:
        modes = each.get("modes")
        for entry in modes if isinstance(modes, MappingNode) else ():
            if isinstance(entry.node, MappingNode):
                yield (*place, entry.key), entry.node
                yield from _iter_modes(entry.node, (*place, entry.key))


def _iter_mode_paths(regions: list[RegionBox] | tuple[RegionBox, ...]) -> Iterator[ModePath]:
    """Yield the path of each mode, outer modes first."""
    for region in regions:
        for mode in region.modes:
            yield mode.path
            yield from _iter_mode_paths(mode.regions)


def _transition_arrows(path: ModePath, mode: MappingNode, known: set[ModePath]) -> Iterator[Arrow]:
    """Yield the arrows of the transitions of a mode; one for each target.

    An internal transition gives an arrow from the mode to itself.
    """
    transitions = mode.get("transitions")
    for entry in transitions if isinstance(transitions, MappingNode) else ():
        if isinstance(entry.node, MappingNode):
            label = tuple(label_lines(entry.node))
            names = _target_names(entry.node.get("to"), entry.key)
            if not names:
                yield Arrow(path, path, (*label, "/ stays"), entry.key)
            for name in names:
                target = _resolve_target(tuple(name.split(".")), path, known)
                if target:
                    yield Arrow(path, target, label, entry.key)


def _target_names(to: YamlNode | None, key: str) -> list[str]:
    """Return the target names of a transition: the list or scalar `to`, or its key."""
    if isinstance(to, SequenceNode):
        return [node_text(item) for item in to.nodes]
    return [node_text(to) or key]


def _resolve_target(name: ModePath, path: ModePath, known: set[ModePath]) -> ModePath | None:
    """Return the path of the mode that a name denotes; None if there is none.

    Siblings take precedence over modes of enclosing regions.
    """
    for depth in range(len(path) - 1, -1, -1):
        if (*path[:depth], *name) in known:
            return (*path[:depth], *name)
    return None


def graph(reference: PathText, root: PathText | None = None) -> Diagram:
    """Return the diagram of an automaton given by name or path, as the expanded spec writes it.

    Raises SpecError with all its problems if it is no valid automaton.
    """
    from language.loading.load import automaton_of
    from language.overlays.expand_document import expand_document, read_document

    project = to_project(root)
    document = read_document(project.path_of(to_text(reference, "reference")))
    automaton_of(document, project)
    return diagram_of(expand_document(document, project))
