"""CDFX reader: an ASAM CDF 2.0 file as calibration tools write it, in any encoding that XML knows.

Axes that several maps share (COM_AXIS, RES_AXIS as instances of their own) are passed over; a map
that only refers to one has no points here.
"""

from __future__ import annotations

from collections.abc import Iterator

from codegen.exchange.characteristic import (
    Axis,
    Cell,
    Characteristic,
    PageFile,
    stop_if_many,
    turned,
)
from codegen.exchange.owned import Owned
from codegen.exchange.xml_tree import Element, xml_tree
from language.problem import Problems, Source

VALUES = ("VALUE", "DEPENDENT_VALUE", "BOOLEAN", "ASCII", "VAL_BLK", "CURVE", "MAP")
SHARED = ("COM_AXIS", "RES_AXIS", "CURVE_AXIS")


def read_cdfx(source: Source, data: bytes, problems: Problems, owned: Owned) -> PageFile:
    """Read what is `owned` of a CDFX file; problems are reported, at last with SpecError."""
    root = xml_tree(source, data)
    if root.tag != "MSRSW":
        label = f"this is no CDFX file: it begins with `{root.tag}`, not with `MSRSW`"
        problems.error("form", root.span, label)
    problems.stop_if_any()
    found = []
    for instance in root.below("SW-INSTANCE"):
        name = instance.first("SHORT-NAME")
        if name and not owned.has(Cell(name.text, name.span)):
            continue
        one = _characteristic(instance, problems)
        if one:
            found.append(one)
        stop_if_many(problems)
    problems.stop_if_any()
    return PageFile(source, tuple(found))


def _characteristic(instance: Element, problems: Problems) -> Characteristic | None:
    name, category = instance.first("SHORT-NAME"), instance.first("CATEGORY")
    kind = category.text if category else "VALUE"
    if name is None or not name.text:
        problems.error("missing", instance.span, "an instance has no `SHORT-NAME`")
        return None
    if kind in SHARED:
        return None
    if kind not in VALUES or instance.first("SW-INSTANCE"):
        place = category.span if category else instance.span
        label = f"`{name.text}` is a {kind}, which is passed over"
        problems.warning("form", place, label, f"known: {', '.join(VALUES)}")
        return None
    phys = instance.first("SW-VALUE-CONT", "SW-VALUES-PHYS")
    rows = [list(_cells(group)) for group in phys.all("VG")] if phys else []
    cells = [cell for row in rows for cell in row] if rows else list(_cells(phys))
    if not cells:
        problems.error("missing", instance.span, f"`{name.text}` has no value")
        return None
    if rows and any(len(row) != len(rows[0]) for row in rows):
        label = f"the groups `VG` of `{name.text}` have not equally many values"
        problems.error("form", name.span, label)
        return None
    values = [Cell(cell.text, cell.span) for cell in cells]
    return Characteristic(
        Cell(name.text, name.span),
        turned(values, len(rows[0])) if rows else tuple(values),
        _unit(instance.first("SW-VALUE-CONT")),
        tuple(_axes(instance)),
        all(cell.tag == "VT" for cell in cells),
    )


def _cells(element: Element | None) -> Iterator[Element]:
    """Iterate over the values in an element: numbers and texts."""
    return (child for child in (element.children if element else ()) if child.tag in ("V", "VT"))


def _axes(instance: Element) -> Iterator[Axis]:
    """Yield the axes that have points, the first one first."""
    conts = instance.first("SW-AXIS-CONTS")
    found = list(conts.all("SW-AXIS-CONT")) if conts else []
    for cont in sorted(found, key=_index):
        points = tuple(Cell(c.text, c.span) for c in _cells(cont.first("SW-VALUES-PHYS")))
        if points:
            yield Axis(points, _unit(cont))


def _index(cont: Element) -> str:
    index = cont.first("SW-AXIS-INDEX")
    return index.text if index else ""


def _unit(element: Element | None) -> Cell | None:
    unit = element.first("UNIT-DISPLAY-NAME") if element else None
    return Cell(unit.text, unit.span) if unit else None
