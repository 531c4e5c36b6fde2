"""SVG: render a diagram with modes as boxes from left to right and labelled transitions."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from language.text.sanitise import escape_invisible
from modewright.diagram.diagram_elements import Arrow, ModeBox, RegionBox, lift_arrow
from modewright.diagram.layered_layout import Edge, Layout, Point, Size, compute_layout

CHARACTER_WIDTH, LINE_HEIGHT, TITLE_HEIGHT = 7.0, 14.0, 20.0
"""Width of a character, height of a line, height of a title [px]: monospace at 11 px."""
PADDING = 9.0
"""Padding inside boxes [px]."""
DASH_STYLE = ' stroke-dasharray="4 3"'
"""SVG attribute of dashed lines."""
INITIAL_DOT_WIDTH = 30.0
"""Width of the dot before the initial mode [px]."""
MODE_COLOURS = ("#33608c", "#b03a4a", "#1d6f2b", "#8a7410", "#257a8f", "#8a2b63", "#555555")
"""Colours that distinguish modes."""
SHADE_COLOURS = {"covered": "#1d7a33", "part": "#9a6700", "missed": "#b3261e"}
"""Colours of test coverage."""
PALETTE = (*MODE_COLOURS, *SHADE_COLOURS.values())
"""All colours, to which arrow markers refer by index."""
SHADE_LABELS = {"covered": "reached by tests", "part": "reached in part", "missed": "not reached"}
"""Texts of the legend of test coverage."""
STYLE = (
    "text{font:11px 'DejaVu Sans Mono',Menlo,Consolas,monospace;fill:#222}"
    ".n{font-weight:bold;font-size:13px}.a{fill:#555}"
)


@dataclass(frozen=True)
class _Drawing:
    """A drawn part: its size [px], its SVG elements with offsets, and the height above its box."""

    size: Size
    parts: tuple[tuple[Point, str], ...]
    top_margin: float = 0.0

    def translate(self, x: float, y: float) -> tuple[tuple[Point, str], ...]:
        """Return the elements moved by (x, y)."""
        return tuple(((x + dx, y + dy), text) for (dx, dy), text in self.parts)


def _escape_xml(text: str) -> str:
    """Return a text escaped for XML."""
    return escape(escape_invisible(text))


def render_svg(name: str, regions: Sequence[RegionBox], arrows: Sequence[Arrow]) -> str:
    """Return the regions and arrows of a diagram as an SVG document with a final line feed.

    Regions are below each other, several ones in frames; in each the modes are in columns from left
    to right, the initial one first. If an arrow has a shade, a legend of test coverage follows the
    title `name`.
    """
    drawn = _draw_regions(regions, arrows)
    title = CHARACTER_WIDTH * 1.2 * len(name)
    if any(arrow.shade for arrow in arrows):
        title += CHARACTER_WIDTH * (6 + sum(len(note) + 3 for note in SHADE_LABELS.values()))
    width = max(drawn.size[0], title, 120.0) + 2 * PADDING
    height = drawn.size[1] + TITLE_HEIGHT + 2 * PADDING
    rows = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}"'
        f' viewBox="0 0 {width:.0f} {height:.0f}">',
        f"<title>{_escape_xml(name)}</title>",
        f"<style>{STYLE}</style>",
        "<defs>"
        + "".join(_arrow_marker(k, colour) for k, colour in enumerate(PALETTE))
        + "</defs>",
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="white"/>',
        f'<text class="n" x="{PADDING}" y="{PADDING + 10}">{_escape_xml(name)}</text>',
    ]
    if any(arrow.shade for arrow in arrows):
        rows.append(_draw_legend(PADDING + CHARACTER_WIDTH * (1.2 * len(name) + 3)))
    for (x, y), text in drawn.translate(PADDING, PADDING + TITLE_HEIGHT):
        rows.append(f'<g transform="translate({x:.1f} {y:.1f})">{text}</g>')
    return "\n".join([*rows, "</svg>", ""])


def _draw_legend(x: float) -> str:
    """Return the legend of test coverage, to the right of the title."""
    texts = ""
    for shade, note in SHADE_LABELS.items():
        style = f"fill:{SHADE_COLOURS[shade]}"
        texts += f'<text x="{x:.1f}" y="{PADDING + 10}" style="{style}">{note}</text>'
        x += CHARACTER_WIDTH * (len(note) + 3)
    return texts


def _draw_regions(regions: Sequence[RegionBox], arrows: Sequence[Arrow]) -> _Drawing:
    """Return regions below each other; parallel regions have a frame with their name."""
    width, y = 0.0, 0.0
    parts: list[tuple[Point, str]] = []
    drawn = [_draw_region(region, arrows) for region in regions]
    widest = max((each.size[0] for each in drawn), default=0.0) + 2 * PADDING
    for region, each in zip(regions, drawn, strict=True):
        if len(regions) == 1:
            return each
        height = each.size[1] + TITLE_HEIGHT + 2 * PADDING
        parts.append(((0.0, y), _draw_frame(widest, height, region.name)))
        parts += each.translate(PADDING, y + TITLE_HEIGHT)
        width, y = max(width, widest), y + height + PADDING
    return _Drawing((width, y), tuple(parts))


def _draw_region(region: RegionBox, arrows: Sequence[Arrow]) -> _Drawing:
    """Return the modes of a region, the initial one first, with the transitions between them."""
    modes = sorted(region.modes, key=lambda mode: mode.name != region.initial)
    numbers = {mode.path: k for k, mode in enumerate(modes)}
    lifted_arrows = [lift_arrow(arrow) for arrow in arrows]
    lifted_arrows = [
        arrow for arrow in lifted_arrows if arrow.source in numbers and arrow.target in numbers
    ]
    loops = {
        mode.path: [a for a in lifted_arrows if a.source == a.target == mode.path] for mode in modes
    }
    between = [arrow for arrow in lifted_arrows if arrow.source != arrow.target]
    drawn = [_draw_mode(mode, loops[mode.path], arrows, k) for k, mode in enumerate(modes)]
    edges = [Edge(numbers[a.source], numbers[a.target], _label_size(a)) for a in between]
    placed = compute_layout(
        [each.size for each in drawn], edges, [each.top_margin for each in drawn]
    )
    parts: list[tuple[Point, str]] = []
    for (x, y), each in zip(placed.boxes, drawn, strict=True):
        parts += each.translate(INITIAL_DOT_WIDTH + x, y)
    if modes:
        (x, y), (_, height), lid = placed.boxes[0], drawn[0].size, drawn[0].top_margin
        parts.append(((INITIAL_DOT_WIDTH + x, y + (lid + height) / 2), _draw_initial_dot()))
    parts += _draw_arrows(between, edges, placed)
    return _Drawing((INITIAL_DOT_WIDTH + placed.size[0], placed.size[1]), tuple(parts))


def _draw_arrows(
    arrows: Sequence[Arrow], edges: Sequence[Edge], placed: Layout
) -> list[tuple[Point, str]]:
    """Return the lines and labels of transitions."""
    parts: list[tuple[Point, str]] = []
    for arrow, edge, route in zip(arrows, edges, placed.routes, strict=True):
        colour_index = _colour_index_of(arrow.shade, edge.source)
        for k, piece in enumerate(route.pieces):
            head = k == len(route.pieces) - 1
            parts.append(
                (
                    (INITIAL_DOT_WIDTH, 0.0),
                    _draw_curve(piece, colour_index, head, arrow.shade == "missed"),
                )
            )
        x, y = route.label
        parts.append(((INITIAL_DOT_WIDTH + x, y), _draw_label(arrow, colour_index)))
    return parts


def _draw_mode(
    mode: ModeBox, loops: Sequence[Arrow], arrows: Sequence[Arrow], colour_index: int
) -> _Drawing:
    """Return a mode with its name, lines and inner regions.

    Its internal transitions are drawn above the box.
    """
    inner = _draw_regions(mode.regions, arrows) if mode.regions else _Drawing((0.0, 0.0), ())
    longest = max(
        [CHARACTER_WIDTH * 1.22 * len(mode.name), *(CHARACTER_WIDTH * len(n) for n in mode.lines)]
    )
    width = max(longest, inner.size[0]) + 2 * PADDING
    text = TITLE_HEIGHT + LINE_HEIGHT * len(mode.lines)
    height = text + PADDING + (inner.size[1] + PADDING if mode.regions else 0.0)
    parts: list[tuple[Point, str]] = []
    top = 0.0
    for loop in loops:
        size = _label_size(loop)
        width = max(width, size[0] + 44.0)
        parts.append(((30.0, top), _draw_label(loop, _colour_index_of(loop.shade, colour_index))))
        parts.append(((0.0, top), _draw_loop(size, _colour_index_of(loop.shade, colour_index))))
        top += size[1] + 24.0
    colour = PALETTE[_colour_index_of(mode.shade, colour_index)]
    dash = DASH_STYLE if mode.shade == "missed" else ""
    rounding = height / 2 if mode.kind == "history" else 7
    box = f'<rect width="{width:.1f}" height="{height:.1f}" rx="{rounding:g}" fill="{colour}"'
    box += f' fill-opacity="0.08" stroke="{colour}" stroke-width="1.6"{dash}/>'
    if mode.kind == "final":
        box += f'<rect x="3" y="3" width="{width - 6:.1f}" height="{height - 6:.1f}" rx="5"'
        box += f' fill="none" stroke="{colour}"/>'
    box += f'<text class="n" x="{PADDING}" y="16">{_escape_xml(mode.name)}</text>'
    box += _draw_lines(mode.lines, PADDING, TITLE_HEIGHT + 10, "a")
    parts.append(((0.0, top), box))
    parts += inner.translate(PADDING, top + text + PADDING / 2)
    return _Drawing((width, top + height), tuple(parts), top)


def _label_size(arrow: Arrow) -> Size:
    """Return the size of a label [px]."""
    longest = max((len(line) for line in arrow.lines), default=0)
    return (CHARACTER_WIDTH * longest + 10.0, LINE_HEIGHT * len(arrow.lines) + 6.0)


def _draw_label(arrow: Arrow, colour_index: int) -> str:
    """Return the label of a transition in a frame."""
    width, height = _label_size(arrow)
    frame = f'<rect width="{width:.1f}" height="{height:.1f}" rx="3" fill="white"'
    return (
        frame
        + f' stroke="{PALETTE[colour_index]}" stroke-width="0.7"/>'
        + _draw_lines(arrow.lines, 5, 13)
    )


def _draw_lines(lines: Sequence[str], x: float, y: float, name: str = "") -> str:
    """Return lines of text; their indentation is preserved."""
    kind = f' class="{name}"' if name else ""
    texts = ""
    for k, line in enumerate(lines):
        text = line.lstrip()
        left = x + CHARACTER_WIDTH * (len(line) - len(text))
        texts += f'<text{kind} x="{left:.1f}" y="{y + LINE_HEIGHT * k:.1f}"'
        texts += f' textLength="{CHARACTER_WIDTH * len(text):.1f}">{_escape_xml(text)}</text>'
    return texts


def _colour_index_of(shade: str, number: int) -> int:
    """Return the palette index of a shade; without a shade the colour of the mode's number."""
    return (
        len(MODE_COLOURS) + list(SHADE_COLOURS).index(shade)
        if shade
        else number % len(MODE_COLOURS)
    )


def _draw_curve(points: Sequence[Point], colour_index: int, head: bool, dashed: bool) -> str:
    """Return a smooth curve through points, with an arrow head and dashes if requested."""
    path = f"M{points[0][0]:.1f} {points[0][1]:.1f}"
    for (x, y), (u, v) in itertools.pairwise(points):
        bend = (u - x) / 2
        path += f" C{x + bend:.1f} {y:.1f} {u - bend:.1f} {v:.1f} {u:.1f} {v:.1f}"
    end = f' marker-end="url(#h{colour_index})"' if head else ""
    end += DASH_STYLE if dashed else ""
    return (
        f'<path d="{path}" fill="none" stroke="{PALETTE[colour_index]}" stroke-width="1.3"{end}/>'
    )


def _draw_loop(size: Size, colour_index: int) -> str:
    """Return the curve of an internal transition around its label."""
    bottom = size[1] + 24.0
    path = f"M16 {bottom} C16 {size[1] / 2} 16 {size[1] / 2} 30 {size[1] / 2}"
    right = size[0] + 30.0
    path += f" M{right} {size[1] / 2} C{right + 8} {size[1] / 2}"
    path += f" {right + 8} {size[1]} {right + 8} {bottom}"
    return (
        f'<path d="{path}" fill="none" stroke="{PALETTE[colour_index]}" stroke-width="1.3"'
        f' marker-end="url(#h{colour_index})"/>'
    )


def _draw_initial_dot() -> str:
    """Return the dot and the arrow before the initial mode."""
    return (
        '<circle cx="-24" cy="0" r="4.5" fill="#222"/>'
        '<path d="M-20 0 H0" stroke="#222" stroke-width="1.3" marker-end="url(#h6)"/>'
    )


def _draw_frame(width: float, height: float, name: str) -> str:
    """Return the dashed frame of a parallel region."""
    return (
        f'<rect width="{width:.1f}" height="{height:.1f}" rx="4" fill="none" stroke="#888"'
        f' stroke-dasharray="5 4"/><text class="n" x="{PADDING}" y="15">{_escape_xml(name)}</text>'
    )


def _arrow_marker(number: int, colour: str) -> str:
    """Return the definition of an arrow head in a colour."""
    return (
        f'<marker id="h{number}" viewBox="0 0 8 8" refX="7.5" refY="4" markerWidth="7"'
        f' markerHeight="7" orient="auto"><path d="M0 0 L8 4 L0 8 z" fill="{colour}"/></marker>'
    )
