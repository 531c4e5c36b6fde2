"""CDFX: a page as ASAM CDF 2.0. Axes are compiled in; a VG holds the values over the first axis
for one point of the second.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from xml.sax.saxutils import escape

from codegen.exchange.characteristic import Axis, Cell, Characteristic, turned
from language.text import visible

CATEGORIES = ("VALUE", "CURVE", "MAP")
"""What a characteristic is called, by its number of axes."""
HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<!-- {heading} -->
<MSRSW>
  <SHORT-NAME>{title}</SHORT-NAME>
  <CATEGORY>CDF20</CATEGORY>
  <SW-SYSTEMS>
    <SW-SYSTEM>
      <SHORT-NAME>{title}</SHORT-NAME>
      <SW-INSTANCE-SPEC>
        <SW-INSTANCE-TREE>
          <SHORT-NAME>{title}</SHORT-NAME>
          <CATEGORY>NO_VCD</CATEGORY>
"""
TAIL = """        </SW-INSTANCE-TREE>
      </SW-INSTANCE-SPEC>
    </SW-SYSTEM>
  </SW-SYSTEMS>
</MSRSW>
"""
DEEP = " " * 10


def cdfx_text(title: str, heading: Sequence[str], page: Sequence[Characteristic]) -> str:
    """Return a page as a CDFX file."""
    told = escape(", ".join(heading)).replace("--", "- -")
    lines = [f"{DEEP}{line}\n" for one in page for line in _instance(one)]
    return HEAD.format(title=escape(title), heading=told) + "".join(lines) + TAIL


def _instance(one: Characteristic) -> Iterator[str]:
    is_truth = one.is_text and not one.axes and one.values[0].text in ("false", "true")
    yield "<SW-INSTANCE>"
    yield f"  <SHORT-NAME>{escape(one.name.text)}</SHORT-NAME>"
    if one.about:
        yield f"  <LONG-NAME>{escape(visible(' '.join(one.about.split())))}</LONG-NAME>"
    yield f"  <CATEGORY>{'BOOLEAN' if is_truth else CATEGORIES[len(one.axes)]}</CATEGORY>"
    yield "  <SW-VALUE-CONT>"
    yield from _unit(one.unit)
    yield "    <SW-VALUES-PHYS>"
    yield from _values(one)
    yield "    </SW-VALUES-PHYS>"
    yield "  </SW-VALUE-CONT>"
    if one.axes:
        yield "  <SW-AXIS-CONTS>"
        for axis in one.axes:
            yield from _axis(axis)
        yield "  </SW-AXIS-CONTS>"
    yield "</SW-INSTANCE>"


def _values(one: Characteristic) -> Iterator[str]:
    tag = "VT" if one.is_text else "V"
    if len(one.axes) < 2:
        yield from (f"      {_cell(cell, tag)}" for cell in one.values)
        return
    first, second = one.axes
    values = turned(one.values, len(second.points))
    for number, point in enumerate(second.points):
        yield "      <VG>"
        yield f"        <LABEL>{escape(point.text)}</LABEL>"
        row = values[number * len(first.points) : (number + 1) * len(first.points)]
        yield from (f"        {_cell(cell, tag)}" for cell in row)
        yield "      </VG>"


def _axis(axis: Axis) -> Iterator[str]:
    yield "    <SW-AXIS-CONT>"
    yield "      <CATEGORY>FIX_AXIS</CATEGORY>"
    yield from (f"  {line}" for line in _unit(axis.unit))
    yield "      <SW-VALUES-PHYS>"
    yield from (f"        {_cell(cell, 'V')}" for cell in axis.points)
    yield "      </SW-VALUES-PHYS>"
    yield "    </SW-AXIS-CONT>"


def _unit(unit: Cell | None) -> Iterator[str]:
    if unit:
        yield f"    <UNIT-DISPLAY-NAME>{escape(unit.text)}</UNIT-DISPLAY-NAME>"


def _cell(cell: Cell, tag: str) -> str:
    return f"<{tag}>{escape(cell.text)}</{tag}>"
