"""Mermaid: render a diagram as `stateDiagram-v2` text, which Git hosts display."""

from __future__ import annotations

import re
from collections.abc import Iterator

from language.text.sanitise import escape_invisible
from modewright.diagram.diagram_elements import Arrow, ModeBox, ModePath, RegionBox, lift_arrow

RESERVED = frozenset({"state", "note", "end", "direction", "class", "click", "hide", "scale", "as"})
"""Words of Mermaid that cannot be identifiers."""

KIND_MARKS = {"history": "(H) "}
"""Marks before the names of special modes."""


def render_mermaid(name: str, regions: tuple[RegionBox, ...], arrows: tuple[Arrow, ...]) -> str:
    """Return regions as Mermaid text `stateDiagram-v2` with a final line feed.

    One region is drawn directly; several are parallel in a state with the label `name`. A
    transition appears in the innermost region that contains both ends. Shades are not shown.
    """
    lines = ["stateDiagram-v2", "    direction LR"]
    if len(regions) == 1:
        lines += _region_lines(regions[0], arrows, 1)
    else:
        lines.append(f'    state "{_escape_label(name)}" as {identifier_of((name,))}_ {{')
        lines += _parallel_lines(regions, arrows, 2)
        lines.append("    }")
    return "\n".join(lines) + "\n"


def identifier_of(path: ModePath) -> str:
    """Return the Mermaid identifier of a mode: the keys of its path joined with `__`.

    Characters other than ASCII letters, digits and `_` become `_`; `_` is appended to a word of
    RESERVED. Different paths may have the same identifier.
    """
    name = re.sub(r"\W", "_", "__".join(path), flags=re.ASCII)
    return name + "_" if name in RESERVED else name


def _parallel_lines(
    regions: tuple[RegionBox, ...], arrows: tuple[Arrow, ...], depth: int
) -> Iterator[str]:
    """Yield the lines of parallel regions with separators."""
    for k, region in enumerate(regions):
        if k:
            yield "    " * depth + "--"
        yield from _region_lines(region, arrows, depth)


def _region_lines(region: RegionBox, arrows: tuple[Arrow, ...], depth: int) -> Iterator[str]:
    """Yield the lines of a region: initial mode, modes, final modes, transitions."""
    indent = "    " * depth
    for mode in region.modes:
        if mode.name == region.initial:
            yield f"{indent}[*] --> {identifier_of(mode.path)}"
    for mode in region.modes:
        yield from _mode_lines(mode, arrows, depth)
        if mode.kind == "final":
            yield f"{indent}{identifier_of(mode.path)} --> [*]"
    place = region.modes[0].path[:-1] if region.modes else ()
    for arrow in map(lift_arrow, arrows):
        if arrow.source[:-1] == place:
            label = f" : {'<br/>'.join(map(_escape_label, arrow.lines))}" if arrow.lines else ""
            yield f"{indent}{identifier_of(arrow.source)} --> {identifier_of(arrow.target)}{label}"


def _mode_lines(mode: ModeBox, arrows: tuple[Arrow, ...], depth: int) -> Iterator[str]:
    """Yield the lines of a mode and its inner regions."""
    indent = "    " * depth
    text = "<br/>".join(
        map(_escape_label, (KIND_MARKS.get(mode.kind, "") + mode.name, *mode.lines))
    )
    head = f'{indent}state "{text}" as {identifier_of(mode.path)}'
    if not mode.regions:
        yield head
        return
    yield head + " {"
    yield from _parallel_lines(mode.regions, arrows, depth + 1)
    yield indent + "}"


def _escape_label(text: str) -> str:
    """Return a text with the characters escaped that end a label in some version of Mermaid or are
    HTML.
    """
    plain = escape_invisible(text).replace('"', "'")
    return re.sub(r"[#;:]|<(?=[A-Za-z/!?])", lambda match: f"#{ord(match[0])};", plain)
