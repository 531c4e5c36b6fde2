"""DCM blocks: the lines between the head of a characteristic and its END, and their conversion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from codegen.exchange.calibration.characteristic import (
    Cell,
    FileAxis,
    FileCharacteristic,
    transpose_map,
)
from language.text.diagnostic import Problems

SHARED_AXIS = "STUETZSTELLENVERTEILUNG"
"""The keyword of axis points that several maps share."""
CURVE_KINDS = ("KENNLINIE", "FESTKENNLINIE", "GRUPPENKENNLINIE")
"""Keywords of curves."""
MAP_KINDS = ("KENNFELD", "FESTKENNFELD", "GRUPPENKENNFELD")
"""Keywords of maps."""
SIZES: Mapping[str, tuple[int, ...]] = {
    "FESTWERT": (0,),
    "TEXTSTRING": (0,),
    "FESTWERTEBLOCK": (1, 2),
    SHARED_AXIS: (1,),
    **dict.fromkeys(CURVE_KINDS, (1,)),
    **dict.fromkeys(MAP_KINDS, (2,)),
}
"""The numbers of sizes that may follow the name of each kind of block."""
MAX_VALUES = 1_000_000
"""Largest size of a block."""


@dataclass(frozen=True)
class DcmBlock:
    """The contents of a block by keyword; `sizes` is None if its head is malformed."""

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
    """Tell whether a text is a whole number from 1 to MAX_VALUES, in fewer than 8 ASCII digits."""
    return text.isascii() and text.isdecimal() and len(text) < 8 and 0 < int(text) <= MAX_VALUES


def characteristic_of(block: DcmBlock, problems: Problems) -> FileCharacteristic | None:
    """Return a block as a characteristic.

    The values of a map or matrix, which a file gives row by row of its second axis, are transposed.
    The values of a shared axis are its points. `block.sizes` must fit the kind of the block.
    Returns None with problems reported if it has both numbers and texts, or if the numbers of
    values or points differ from the sizes in its head.
    """
    sizes = block.sizes or ()
    values = block.numbers or block.texts
    if block.numbers and block.texts:
        label = f"`{block.name.text}` has both `WERT` and `TEXT`"
        problems.error("form", block.texts[0].span, label)
        return None
    kind = block.head.text
    if kind == SHARED_AXIS:
        values = block.points_x
    is_complete = _has_count(values, math.prod(sizes), "values", block, problems)
    axes = []
    if kind in CURVE_KINDS or kind in MAP_KINDS:
        is_complete &= _has_count(block.points_x, sizes[0], "points `ST/X`", block, problems)
        axes.append(FileAxis(tuple(block.points_x), block.units.get("X")))
    if kind in MAP_KINDS:
        is_complete &= _has_count(block.points_y, sizes[1], "points `ST/Y`", block, problems)
        axes.append(FileAxis(tuple(block.points_y), block.units.get("Y")))
    if not is_complete:
        return None
    ordered = transpose_map(values, sizes[0]) if len(sizes) == 2 else tuple(values)
    unit, about = block.units.get("W"), " ".join(block.about)
    return FileCharacteristic(block.name, ordered, unit, tuple(axes), bool(block.texts), about)


def _has_count(
    cells: list[Cell], count: int, what: str, block: DcmBlock, problems: Problems
) -> bool:
    """Tell whether there are `count` cells; report a problem otherwise. `what` names them."""
    if len(cells) == count:
        return True
    place = cells[count].span if len(cells) > count else block.name.span
    label = f"`{block.name.text}` has {len(cells)} {what}, its head says {count}"
    problems.error("form", place, label)
    return False
