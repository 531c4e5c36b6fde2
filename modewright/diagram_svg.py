"""Diagram SVG: modes as boxes from left to right, every transition with its label on it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from language.text import visible
from modewright.diagram import Arrow, Diagram, ModeBox, RegionBox, lifted
from modewright.layers import Edge, Layout, Point, Size, layout

CHARACTER, LINE, TITLE = 7.0, 14.0, 20.0
"""Width of a character, height of a line, height of a title [px]: monospace at 11 px."""
PAD = 9.0
DASH = ' stroke-dasharray="4 3"'
START = 30.0
"""Room for the dot before the initial mode [px]."""
COLOURS = ("#33608c", "#b03a4a", "#1d6f2b", "#8a7410", "#257a8f", "#8a2b63", "#555555")
SHADES = {"covered": "#1d7a33", "part": "#9a6700", "missed": "#b3261e"}
PALETTE = (*COLOURS, *SHADES.values())
NOTES = {"covered": "reached by tests", "part": "reached in part", "missed": "not reached"}
STYLE = (
    "text{font:11px 'DejaVu Sans Mono',Menlo,Consolas,monospace;fill:#222}"
    ".n{font-weight:bold;font-size:13px}.a{fill:#555}"
)


@dataclass(frozen=True)
class _Drawn:
    """A laid-out part: its size, what draws it, and the height above it that is not its box."""

    size: Size
    parts: tuple[tuple[Point, str], ...]
    lid: float = 0.0

    def at(self, x: float, y: float) -> tuple[tuple[Point, str], ...]:
        return tuple(((x + dx, y + dy), text) for (dx, dy), text in self.parts)


def _xml(text: str) -> str:
    return escape(visible(text))


def svg(diagram: Diagram) -> str:
    """Return the diagram as an SVG document."""
    drawn = _stacked(diagram.regions, diagram.arrows)
    title = CHARACTER * 1.2 * len(diagram.name)
    if any(arrow.shade for arrow in diagram.arrows):
        title += CHARACTER * (6 + sum(len(note) + 3 for note in NOTES.values()))
    width = max(drawn.size[0], title, 120.0) + 2 * PAD
    height = drawn.size[1] + TITLE + 2 * PAD
    rows = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}"'
        f' viewBox="0 0 {width:.0f} {height:.0f}">',
        f"<title>{_xml(diagram.name)}</title>",
        f"<style>{STYLE}</style>",
        "<defs>" + "".join(_marker(k, colour) for k, colour in enumerate(PALETTE)) + "</defs>",
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="white"/>',
        f'<text class="n" x="{PAD}" y="{PAD + 10}">{_xml(diagram.name)}</text>',
    ]
    if any(arrow.shade for arrow in diagram.arrows):
        rows.append(_legend(PAD + CHARACTER * (1.2 * len(diagram.name) + 3)))
    for (x, y), text in drawn.at(PAD, PAD + TITLE):
        rows.append(f'<g transform="translate({x:.1f} {y:.1f})">{text}</g>')
    return "\n".join([*rows, "</svg>", ""])


def _legend(x: float) -> str:
    """What the shades mean, beside the title."""
    found = ""
    for shade, note in NOTES.items():
        found += f'<text x="{x:.1f}" y="{PAD + 10}" style="fill:{SHADES[shade]}">{note}</text>'
        x += CHARACTER * (len(note) + 3)
    return found


def _stacked(regions: Sequence[RegionBox], arrows: Sequence[Arrow]) -> _Drawn:
    """Return regions over each other; several are framed and named, for they run in parallel."""
    width, y = 0.0, 0.0
    parts: list[tuple[Point, str]] = []
    drawn = [_region(region, arrows) for region in regions]
    widest = max((each.size[0] for each in drawn), default=0.0) + 2 * PAD
    for region, each in zip(regions, drawn, strict=True):
        if len(regions) == 1:
            return each
        height = each.size[1] + TITLE + 2 * PAD
        parts.append(((0.0, y), _frame(widest, height, region.name)))
        parts += each.at(PAD, y + TITLE)
        width, y = max(width, widest), y + height + PAD
    return _Drawn((width, y), tuple(parts))


def _region(region: RegionBox, arrows: Sequence[Arrow]) -> _Drawn:
    """Return the modes of one region, the initial one first, with the transitions among them."""
    modes = sorted(region.modes, key=lambda mode: mode.name != region.initial)
    numbers = {mode.path: k for k, mode in enumerate(modes)}
    inside = [lifted(arrow) for arrow in arrows]
    inside = [arrow for arrow in inside if arrow.source in numbers and arrow.target in numbers]
    loops = {mode.path: [a for a in inside if a.source == a.target == mode.path] for mode in modes}
    between = [arrow for arrow in inside if arrow.source != arrow.target]
    drawn = [_mode(mode, loops[mode.path], arrows, k) for k, mode in enumerate(modes)]
    edges = [Edge(numbers[a.source], numbers[a.target], _label_size(a)) for a in between]
    placed = layout([each.size for each in drawn], edges, [each.lid for each in drawn])
    parts: list[tuple[Point, str]] = []
    for (x, y), each in zip(placed.boxes, drawn, strict=True):
        parts += each.at(START + x, y)
    if modes:
        (x, y), (_, height), lid = placed.boxes[0], drawn[0].size, drawn[0].lid
        parts.append(((START + x, y + (lid + height) / 2), _start()))
    parts += _arrows(between, edges, placed)
    return _Drawn((START + placed.size[0], placed.size[1]), tuple(parts))


def _arrows(
    arrows: Sequence[Arrow], edges: Sequence[Edge], placed: Layout
) -> list[tuple[Point, str]]:
    parts: list[tuple[Point, str]] = []
    for arrow, edge, route in zip(arrows, edges, placed.routes, strict=True):
        number = _number(arrow.shade, edge.source)
        for k, piece in enumerate(route.pieces):
            head = k == len(route.pieces) - 1
            parts.append(((START, 0.0), _line(piece, number, head, arrow.shade == "missed")))
        x, y = route.label
        parts.append(((START + x, y), _label(arrow, number)))
    return parts


def _mode(mode: ModeBox, loops: Sequence[Arrow], arrows: Sequence[Arrow], number: int) -> _Drawn:
    """Return a mode: its name, what holds in it, its inner regions; self-transitions above."""
    inner = _stacked(mode.regions, arrows) if mode.regions else _Drawn((0.0, 0.0), ())
    longest = max([CHARACTER * 1.22 * len(mode.name), *(CHARACTER * len(n) for n in mode.lines)])
    width = max(longest, inner.size[0]) + 2 * PAD
    text = TITLE + LINE * len(mode.lines)
    height = text + PAD + (inner.size[1] + PAD if mode.regions else 0.0)
    parts: list[tuple[Point, str]] = []
    top = 0.0
    for loop in loops:
        size = _label_size(loop)
        width = max(width, size[0] + 44.0)
        parts.append(((30.0, top), _label(loop, _number(loop.shade, number))))
        parts.append(((0.0, top), _loop(size, _number(loop.shade, number))))
        top += size[1] + 24.0
    colour = PALETTE[_number(mode.shade, number)]
    dash = DASH if mode.shade == "missed" else ""
    rounding = height / 2 if mode.sort == "history" else 7
    box = f'<rect width="{width:.1f}" height="{height:.1f}" rx="{rounding:g}" fill="{colour}"'
    box += f' fill-opacity="0.08" stroke="{colour}" stroke-width="1.6"{dash}/>'
    if mode.sort == "final":
        box += f'<rect x="3" y="3" width="{width - 6:.1f}" height="{height - 6:.1f}" rx="5"'
        box += f' fill="none" stroke="{colour}"/>'
    box += f'<text class="n" x="{PAD}" y="16">{_xml(mode.name)}</text>'
    box += _lines(mode.lines, PAD, TITLE + 10, "a")
    parts.append(((0.0, top), box))
    parts += inner.at(PAD, top + text + PAD / 2)
    return _Drawn((width, top + height), tuple(parts), top)


def _label_size(arrow: Arrow) -> Size:
    longest = max((len(line) for line in arrow.lines), default=0)
    return (CHARACTER * longest + 10.0, LINE * len(arrow.lines) + 6.0)


def _label(arrow: Arrow, number: int) -> str:
    width, height = _label_size(arrow)
    frame = f'<rect width="{width:.1f}" height="{height:.1f}" rx="3" fill="white"'
    return frame + f' stroke="{PALETTE[number]}" stroke-width="0.7"/>' + _lines(arrow.lines, 5, 13)


def _lines(lines: Sequence[str], x: float, y: float, name: str = "") -> str:
    kind = f' class="{name}"' if name else ""
    found = ""
    for k, line in enumerate(lines):
        text = line.lstrip()
        left = x + CHARACTER * (len(line) - len(text))
        found += f'<text{kind} x="{left:.1f}" y="{y + LINE * k:.1f}"'
        found += f' textLength="{CHARACTER * len(text):.1f}">{_xml(text)}</text>'
    return found


def _number(shade: str, number: int) -> int:
    """Return the place of a colour: that of a shade, else one of those that tell modes apart."""
    return len(COLOURS) + list(SHADES).index(shade) if shade else number % len(COLOURS)


def _line(points: Sequence[Point], number: int, head: bool, dashed: bool) -> str:
    path = f"M{points[0][0]:.1f} {points[0][1]:.1f}"
    for (x, y), (u, v) in itertools.pairwise(points):
        bend = (u - x) / 2
        path += f" C{x + bend:.1f} {y:.1f} {u - bend:.1f} {v:.1f} {u:.1f} {v:.1f}"
    end = f' marker-end="url(#h{number})"' if head else ""
    end += DASH if dashed else ""
    return f'<path d="{path}" fill="none" stroke="{PALETTE[number]}" stroke-width="1.3"{end}/>'


def _loop(size: Size, number: int) -> str:
    bottom = size[1] + 24.0
    path = f"M16 {bottom} C16 {size[1] / 2} 16 {size[1] / 2} 30 {size[1] / 2}"
    right = size[0] + 30.0
    path += f" M{right} {size[1] / 2} C{right + 8} {size[1] / 2}"
    path += f" {right + 8} {size[1]} {right + 8} {bottom}"
    return (
        f'<path d="{path}" fill="none" stroke="{PALETTE[number]}" stroke-width="1.3"'
        f' marker-end="url(#h{number})"/>'
    )


def _start() -> str:
    return (
        '<circle cx="-24" cy="0" r="4.5" fill="#222"/>'
        '<path d="M-20 0 H0" stroke="#222" stroke-width="1.3" marker-end="url(#h6)"/>'
    )


def _frame(width: float, height: float, name: str) -> str:
    return (
        f'<rect width="{width:.1f}" height="{height:.1f}" rx="4" fill="none" stroke="#888"'
        f' stroke-dasharray="5 4"/><text class="n" x="{PAD}" y="15">{_xml(name)}</text>'
    )


def _marker(number: int, colour: str) -> str:
    return (
        f'<marker id="h{number}" viewBox="0 0 8 8" refX="7.5" refY="4" markerWidth="7"'
        f' markerHeight="7" orient="auto"><path d="M0 0 L8 4 L0 8 z" fill="{colour}"/></marker>'
    )
