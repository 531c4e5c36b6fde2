"""DCM block: what stands between the head of a characteristic and its END."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from codegen.exchange.characteristic import Axis, Cell, Characteristic, turned
from language.problem import Problems

SHARED = "STUETZSTELLENVERTEILUNG"
LINES = ("KENNLINIE", "FESTKENNLINIE", "GRUPPENKENNLINIE")
MAPS = ("KENNFELD", "FESTKENNFELD", "GRUPPENKENNFELD")
SIZES: Mapping[str, tuple[int, ...]] = {
    "FESTWERT": (0,),
    "TEXTSTRING": (0,),
    "FESTWERTEBLOCK": (1, 2),
    SHARED: (1,),
    **dict.fromkeys(LINES, (1,)),
    **dict.fromkeys(MAPS, (2,)),
}
"""How many sizes stand behind the name of each kind."""
MOST_VALUES = 1_000_000


@dataclass(frozen=True)
class Block:
    """The lines of a block, by what they hold, in their order."""

    head: Cell
    name: Cell
    sizes: tuple[int, ...] | None
    numbers: list[Cell] = field(default_factory=list)
    texts: list[Cell] = field(default_factory=list)
    points_x: list[Cell] = field(default_factory=list)
    points_y: list[Cell] = field(default_factory=list)
    units: dict[str, Cell] = field(default_factory=dict)
    about: list[str] = field(default_factory=list)


def is_count(text: str) -> bool:
    """Tell whether a text is a number of values."""
    return text.isascii() and text.isdecimal() and len(text) < 8 and 0 < int(text) <= MOST_VALUES


def characteristic_of(block: Block, problems: Problems) -> Characteristic | None:
    """Return what a block is, or None with the problem reported."""
    sizes = block.sizes or ()
    values = block.numbers or block.texts
    if block.numbers and block.texts:
        label = f"`{block.name.text}` has both `WERT` and `TEXT`"
        problems.error("form", block.texts[0].span, label)
        return None
    kind = block.head.text
    if kind == SHARED:
        values = block.points_x
    is_whole = _has(values, math.prod(sizes), "values", block, problems)
    axes = []
    if kind in LINES or kind in MAPS:
        is_whole &= _has(block.points_x, sizes[0], "points `ST/X`", block, problems)
        axes.append(Axis(tuple(block.points_x), block.units.get("X")))
    if kind in MAPS:
        is_whole &= _has(block.points_y, sizes[1], "points `ST/Y`", block, problems)
        axes.append(Axis(tuple(block.points_y), block.units.get("Y")))
    if not is_whole:
        return None
    ordered = turned(values, sizes[0]) if len(sizes) == 2 else tuple(values)
    unit, about = block.units.get("W"), " ".join(block.about)
    return Characteristic(block.name, ordered, unit, tuple(axes), bool(block.texts), about)


def _has(cells: list[Cell], count: int, what: str, block: Block, problems: Problems) -> bool:
    if len(cells) == count:
        return True
    place = cells[count].span if len(cells) > count else block.name.span
    label = f"`{block.name.text}` has {len(cells)} {what}, its head says {count}"
    problems.error("form", place, label)
    return False
