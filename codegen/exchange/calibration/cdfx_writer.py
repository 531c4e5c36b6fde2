"""CDFX writer: a calibration page as ASAM CDF 2.0.

Axes are compiled into the C, so they are fixed (FIX_AXIS). A group VG holds the values of a map
over the first axis, for one point of the second.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from xml.sax.saxutils import escape

from codegen.exchange.calibration.characteristic import (
    Cell,
    FileAxis,
    FileCharacteristic,
    transpose_map,
)
from language.text.sanitise import escape_invisible

CATEGORIES = ("VALUE", "CURVE", "MAP")
"""The category of a characteristic by its number of axes."""
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
"""The begin of a file; `{heading}` and `{title}` are replaced."""
TAIL = """        </SW-INSTANCE-TREE>
      </SW-INSTANCE-SPEC>
    </SW-SYSTEM>
  </SW-SYSTEMS>
</MSRSW>
"""
"""The end of a file."""
INDENT = " " * 10
"""The indentation of an instance."""


def format_cdfx(title: str, heading: Sequence[str], page: Sequence[FileCharacteristic]) -> str:
    """Return a page as the text of a CDFX file.

    `title` is the SHORT-NAME of the file and system. `heading` is a comment in the second line: its
    parts joined with `, `, with `--` replaced by `- -`.
    """
    comment = escape(", ".join(heading)).replace("--", "- -")
    lines = [f"{INDENT}{line}\n" for one in page for line in _format_instance(one)]
    return HEAD.format(title=escape(title), heading=comment) + "".join(lines) + TAIL


def _format_instance(characteristic: FileCharacteristic) -> Iterator[str]:
    """Yield the lines of a characteristic."""
    is_truth = (
        characteristic.is_text
        and not characteristic.axes
        and characteristic.values[0].text in ("false", "true")
    )
    yield "<SW-INSTANCE>"
    yield f"  <SHORT-NAME>{escape(characteristic.name.text)}</SHORT-NAME>"
    if characteristic.about:
        about = escape_invisible(" ".join(characteristic.about.split()))
        yield f"  <LONG-NAME>{escape(about)}</LONG-NAME>"
    category = "BOOLEAN" if is_truth else CATEGORIES[len(characteristic.axes)]
    yield f"  <CATEGORY>{category}</CATEGORY>"
    yield "  <SW-VALUE-CONT>"
    yield from _format_unit(characteristic.unit)
    yield "    <SW-VALUES-PHYS>"
    yield from _format_values(characteristic)
    yield "    </SW-VALUES-PHYS>"
    yield "  </SW-VALUE-CONT>"
    if characteristic.axes:
        yield "  <SW-AXIS-CONTS>"
        for axis in characteristic.axes:
            yield from _format_axis(axis)
        yield "  </SW-AXIS-CONTS>"
    yield "</SW-INSTANCE>"


def _format_values(characteristic: FileCharacteristic) -> Iterator[str]:
    """Yield the lines of the values; those of a map in one group VG for each second point."""
    tag = "VT" if characteristic.is_text else "V"
    if len(characteristic.axes) < 2:
        yield from (f"      {_format_cell(cell, tag)}" for cell in characteristic.values)
        return
    first, second = characteristic.axes
    values = transpose_map(characteristic.values, len(second.points))
    for number, point in enumerate(second.points):
        yield "      <VG>"
        yield f"        <LABEL>{escape(point.text)}</LABEL>"
        row = values[number * len(first.points) : (number + 1) * len(first.points)]
        yield from (f"        {_format_cell(cell, tag)}" for cell in row)
        yield "      </VG>"


def _format_axis(axis: FileAxis) -> Iterator[str]:
    """Yield the lines of an axis."""
    yield "    <SW-AXIS-CONT>"
    yield "      <CATEGORY>FIX_AXIS</CATEGORY>"
    yield from (f"  {line}" for line in _format_unit(axis.unit))
    yield "      <SW-VALUES-PHYS>"
    yield from (f"        {_format_cell(cell, 'V')}" for cell in axis.points)
    yield "      </SW-VALUES-PHYS>"
    yield "    </SW-AXIS-CONT>"


def _format_unit(unit: Cell | None) -> Iterator[str]:
    """Yield the line of a unit, or nothing if there is none."""
    if unit:
        yield f"    <UNIT-DISPLAY-NAME>{escape(unit.text)}</UNIT-DISPLAY-NAME>"


def _format_cell(cell: Cell, tag: str) -> str:
    """Return an element with the text of a cell."""
    return f"<{tag}>{escape(cell.text)}</{tag}>"
