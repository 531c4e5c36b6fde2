"""CDFX reader: reads ASAM CDF 2.0 files of calibration tools, in any encoding that XML declares.

Axes that several maps share (instances with category COM_AXIS or RES_AXIS) are skipped. A map that
only refers to such an axis has no points.
"""

from __future__ import annotations

from collections.abc import Iterator

from codegen.exchange.calibration.characteristic import (
    Cell,
    FileAxis,
    FileCharacteristic,
    PageFile,
    stop_if_many,
    transpose_map,
)
from codegen.exchange.calibration.name_filter import NameFilter
from codegen.exchange.calibration.xml_parser import Element, parse_xml
from language.text.diagnostic import Problems, Source

VALUE_CATEGORIES = ("VALUE", "DEPENDENT_VALUE", "BOOLEAN", "ASCII", "VAL_BLK", "CURVE", "MAP")
"""Categories of instances that are read."""
SHARED_AXIS_CATEGORIES = ("COM_AXIS", "RES_AXIS", "CURVE_AXIS")
"""Categories of shared axes, which are skipped."""


def read_cdfx(source: Source, data: bytes, problems: Problems, name_filter: NameFilter) -> PageFile:
    """Return the characteristics of a CDFX file whose names the filter accepts.

    Shared axes (SHARED_AXIS_CATEGORIES) are skipped; an instance of another unknown category is
    skipped with a warning. Problems are reported to `problems`; SpecError is raised at the end if
    one is an error, after MAX_PROBLEMS errors, or at once if the data is no XML with the root
    MSRSW. `source` is for positions only.
    """
    root = parse_xml(source, data)
    if root.tag != "MSRSW":
        label = f"this is no CDFX file: it begins with `{root.tag}`, not with `MSRSW`"
        problems.error("form", root.span, label)
    problems.raise_if_errors()
    characteristics = []
    for instance in root.iter_descendants("SW-INSTANCE"):
        name = instance.find("SHORT-NAME")
        if name and not name_filter.accepts(Cell(name.text, name.span)):
            continue
        one = _read_characteristic(instance, problems)
        if one:
            characteristics.append(one)
        stop_if_many(problems)
    problems.raise_if_errors()
    return PageFile(source, tuple(characteristics))


def _read_characteristic(instance: Element, problems: Problems) -> FileCharacteristic | None:
    """Return an instance as a characteristic.

    Returns None for a shared axis without a report, for an unknown category with a warning, and for
    a malformed instance with an error.
    """
    name, category = instance.find("SHORT-NAME"), instance.find("CATEGORY")
    kind = category.text if category else "VALUE"
    if name is None or not name.text:
        problems.error("missing", instance.span, "an instance has no `SHORT-NAME`")
        return None
    if kind in SHARED_AXIS_CATEGORIES:
        return None
    if kind not in VALUE_CATEGORIES or instance.find("SW-INSTANCE"):
        place = category.span if category else instance.span
        label = f"`{name.text}` is a {kind}, which is passed over"
        problems.warning("form", place, label, f"known: {', '.join(VALUE_CATEGORIES)}")
        return None
    phys = instance.find("SW-VALUE-CONT", "SW-VALUES-PHYS")
    rows = [list(_value_elements(group)) for group in phys.find_all("VG")] if phys else []
    cells = [cell for row in rows for cell in row] if rows else list(_value_elements(phys))
    if not cells:
        problems.error("missing", instance.span, f"`{name.text}` has no value")
        return None
    if rows and any(len(row) != len(rows[0]) for row in rows):
        label = f"the groups `VG` of `{name.text}` have not equally many values"
        problems.error("form", name.span, label)
        return None
    values = [Cell(cell.text, cell.span) for cell in cells]
    return FileCharacteristic(
        Cell(name.text, name.span),
        transpose_map(values, len(rows[0])) if rows else tuple(values),
        _read_unit(instance.find("SW-VALUE-CONT")),
        tuple(_read_axes(instance)),
        all(cell.tag == "VT" for cell in cells),
    )


def _value_elements(element: Element | None) -> Iterator[Element]:
    """Return an iterator over the values in an element: numbers (V) and texts (VT)."""
    return (child for child in (element.children if element else ()) if child.tag in ("V", "VT"))


def _read_axes(instance: Element) -> Iterator[FileAxis]:
    """Yield the axes that have points, in the order of their index."""
    conts = instance.find("SW-AXIS-CONTS")
    containers = list(conts.find_all("SW-AXIS-CONT")) if conts else []
    for cont in sorted(containers, key=_axis_index):
        points = tuple(Cell(c.text, c.span) for c in _value_elements(cont.find("SW-VALUES-PHYS")))
        if points:
            yield FileAxis(points, _read_unit(cont))


def _axis_index(cont: Element) -> str:
    """Return the index of an axis as text; an empty text if there is none."""
    index = cont.find("SW-AXIS-INDEX")
    return index.text if index else ""


def _read_unit(element: Element | None) -> Cell | None:
    """Return the unit in an element; None if there is none."""
    unit = element.find("UNIT-DISPLAY-NAME") if element else None
    return Cell(unit.text, unit.span) if unit else None
