"""A2L writer: prints the description of a Program's C as ASAM MCD-2 MC 1.7.1.

Addresses come from a linked program (ELF); without one the file refers to symbols.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from codegen.exchange.a2l.compu_method import TRUTH, Conversion
from codegen.exchange.a2l.description import (
    INSTANCE_STRUCT,
    PAGE_STRUCT,
    Axis,
    Characteristic,
    Measurement,
    ModuleDescription,
    describe_module,
)
from codegen.exchange.a2l.elf_addresses import Image, ImageError, StructLocation, read_image
from codegen.toolchain.templates import product_version, render
from language.ir.number_type import NumberType, shortest_decimal
from language.ir.program import Program

A2L_TYPES: Mapping[str, tuple[str, int]] = {
    "double": ("FLOAT64_IEEE", 8),
    "float": ("FLOAT32_IEEE", 4),
    "bool": ("UBYTE", 1),
    "uint8_t": ("UBYTE", 1),
    "uint16_t": ("UWORD", 2),
    "int16_t": ("SWORD", 2),
    "int32_t": ("SLONG", 4),
    "uint32_t": ("ULONG", 4),
}
"""The A2L data type of a C type, and its size [bytes]."""
CHARACTERISTIC_KINDS = ("VALUE", "CURVE", "MAP")
"""The A2L kind of a characteristic by its number of axes."""
REFERENCES = ((Characteristic, "REF_CHARACTERISTIC"), (Measurement, "REF_MEASUREMENT"))
"""The A2L keywords that refer to members of a group."""
DISPLAY_FORMAT: Mapping[NumberType, str] = {"float64": "%12.6", "float32": "%10.4"}
"""The display format of a real by its number type."""


@dataclass(frozen=True)
class ModuleLocation:
    """The locations of the calibration page and of one instance in a linked program.

    `instance` is None if the program contains no instance as a variable.
    """

    image: Image
    page: StructLocation
    instance: StructLocation | None

    def structure_of(self, item: Measurement | Characteristic) -> StructLocation | None:
        """Return the page for a characteristic, the instance for a measurement; it may be None."""
        return self.page if isinstance(item, Characteristic) else self.instance


def locate_module(
    program: Program, elf: Path, page: str | None = None, instance: str | None = None
) -> ModuleLocation:
    """Return the locations of the calibration page and of one instance of a Program in an ELF file.

    `page` and `instance` are symbols that select one of several, like `app.selves[1]`. Without
    `page`, `<program>_default_cal` is taken if it exists. Constant instances do not count; without
    any other one, and without `instance`, the instance is None. Raises ImageError if several
    candidates remain or none, if the file is unreadable, or if its digest differs from that of the
    Program; MissingToolError if pyelftools is missing.
    """
    description = describe_module(program)
    types = f"{description.name}_{PAGE_STRUCT}", f"{description.name}_{INSTANCE_STRUCT}"
    image = read_image(elf, types, (f"{description.name}_Version",))
    digest = image.strings.get(f"{description.name}_Version")
    if digest is None:
        raise ImageError(f"{elf}: it has no {description.name}_Version")
    if digest != description.digest:
        raise ImageError(
            f"{elf}: its {description.name} is of digest {digest}, the spec's {description.digest}"
        )
    default = f"{description.name}_default_cal"
    is_default = page is None and any(one.symbol == default for one in image.structures[types[0]])
    instances = [one for one in image.structures[types[1]] if not one.is_const]
    return ModuleLocation(
        image,
        image.select_structure(
            types[0], image.structures[types[0]], default if is_default else page
        ),
        image.select_structure(types[1], instances, instance) if instances or instance else None,
    )


def emit_a2l(program: Program, location: ModuleLocation | None = None) -> str:
    """Return the A2L file of a Program's C as text.

    Without a location, characteristics refer to symbols of `<program>_default_cal` and measurements
    have no address; nor have they if the location has no instance. Raises ImageError if a member is
    missing in the ELF or has another size there.
    """
    description = describe_module(program)
    methods = _conversion_methods(description, program.number_type)
    method_names = {conversion: method["name"] for conversion, method in methods.items()}
    return render(
        "a2l/a2l.jinja",
        {
            "name": description.name,
            "about": sanitise_string(description.about),
            "digest": description.digest,
            "version": product_version(),
            "note": sanitise_string(f"addresses of {location.image.path.name}")
            if location
            else "no addresses",
            "epk_address": _format_address(location.image.symbols[f"{description.name}_Version"])
            if location
            else None,
            "byte_order": "MSB_LAST"
            if location is None or location.image.is_little_endian
            else "MSB_FIRST",
            "methods": list(methods.values()),
            "layouts": _record_layouts(description),
            "characteristics": [
                {
                    **_common_context(c, method_names, program, location),
                    **_characteristic_context(c, method_names, program.number_type),
                }
                for c in description.characteristics
            ],
            "measurements": [
                {
                    **_common_context(m, method_names, program, location),
                    "size": m.size,
                    "mask": _bit_mask(m),
                }
                for m in description.measurements
            ],
            "groups": _group_contexts(description),
        },
    )


def sanitise_string(text: str) -> str:
    """Return a text as one line of printable ASCII that is safe between double quotes in A2L.

    Other characters become `?`, backslashes `/`, double quotes `'`; white space is collapsed and
    stripped.
    """
    line = " ".join(text.split()).replace("\\", "/").replace('"', "'")
    return re.sub(r"[^ -~]", "?", line)


def _common_context(
    item: Measurement | Characteristic,
    method_names: Mapping[Conversion, str],
    program: Program,
    location: ModuleLocation | None,
) -> dict[str, Any]:
    """Return the context of any item: name, comment, type, conversion, limits, address."""
    place = location.structure_of(item) if location else None
    page = f"{program.name}_default_cal.{item.path}" if isinstance(item, Characteristic) else ""
    factor = item.conversion.factor
    low, high = (
        _format_number(end * factor, item.type, program.number_type) for end in item.limits
    )
    context = {
        "name": item.name,
        "about": sanitise_string(item.about),
        "type": A2L_TYPES[item.type][0],
        "method": method_names[item.conversion],
        "low": low,
        "high": high,
    }
    if place is None:
        return {**context, "address": None, "symbol": page, "offset": 0}
    offset = _member_offset(place, item)
    return {
        **context,
        "address": _format_address(place.address + offset),
        "symbol": place.symbol,
        "offset": offset,
    }


def _member_offset(place: StructLocation, item: Measurement | Characteristic) -> int:
    """Return the offset of an item in its structure [bytes].

    Raises ImageError if the member is missing or has another size.
    """
    count = item.size if isinstance(item, Measurement) else 1
    for axis in item.axes if isinstance(item, Characteristic) else ():
        count *= len(axis.points)
    offset, size = place.members.get(item.path, (0, 0))
    if size != A2L_TYPES[item.type][1] * max(count, 1):
        raise ImageError(f"{place.symbol}.{item.path} has {size} bytes: it is of another version")
    return offset


def _characteristic_context(
    characteristic: Characteristic, method_names: Mapping[Conversion, str], number: NumberType
) -> dict[str, Any]:
    """Return the context that only characteristics have: kind, record layout and axes."""
    return {
        "kind": CHARACTERISTIC_KINDS[len(characteristic.axes)],
        "layout": f"layout.{A2L_TYPES[characteristic.type][0]}",
        "axes": [_axis_context(axis, method_names, number) for axis in characteristic.axes],
    }


def _axis_context(
    axis: Axis, method_names: Mapping[Conversion, str], number: NumberType
) -> dict[str, Any]:
    """Return the context of an axis: conversion, points and limits."""
    points = [shortest_decimal(point, number) for point in axis.points]
    return {
        "method": method_names[axis.conversion],
        "points": points,
        "low": points[0],
        "high": points[-1],
    }


def _conversion_methods(
    description: ModuleDescription, number: NumberType
) -> dict[Conversion, dict[str, Any]]:
    """Return the contexts of all used conversions, each once.

    Each has a unique name, which is made from its unit or from the path of its first user.
    """
    used = [(one.conversion, one.path) for one in description.characteristics]
    used += [
        (axis.conversion, one.path) for one in description.characteristics for axis in one.axes
    ]
    used += [(one.conversion, one.path) for one in description.measurements]
    methods: dict[Conversion, dict[str, Any]] = {}
    for conversion, path in used:
        if conversion in methods:
            continue
        name = (
            f"names.{_to_identifier(path)}"
            if conversion.names
            else f"unit.{_to_identifier(conversion.unit)}"
        )
        name = "names.truth" if conversion == TRUTH else name
        methods[conversion] = {
            "name": _unique_name(name, {method["name"] for method in methods.values()}),
            "about": sanitise_string(
                conversion.unit or ", ".join(text for _, text in conversion.names)
            ),
            "unit": sanitise_string(conversion.unit),
            "factor": repr(conversion.factor),
            "format": DISPLAY_FORMAT[number],
            "names": [(n, sanitise_string(text)) for n, text in conversion.names],
        }
    return methods


def _to_identifier(text: str) -> str:
    """Return a unit or path as an identifier: `rad/s` as rad_per_s."""
    words = text.replace("/", "_per_").replace("*", "_").replace(".", "_").replace("^-", "_m")
    word = re.sub(r"\W", "", words) or "none"
    return f"_{word}" if word[0].isdigit() else word


def _unique_name(name: str, taken: Collection[str]) -> str:
    """Return the name, with the first free number from 2 appended if it is in `taken`."""
    numbered = (f"{name}_{k}" for k in count(2))
    return name if name not in taken else next(one for one in numbered if one not in taken)


def _record_layouts(description: ModuleDescription) -> list[dict[str, str]]:
    """Return the contexts of one record layout for each data type of a characteristic."""
    kinds = {A2L_TYPES[one.type][0]: None for one in description.characteristics}
    return [{"name": f"layout.{kind}", "type": kind} for kind in kinds]


def _group_contexts(description: ModuleDescription) -> list[dict[str, Any]]:
    """Return the contexts of the groups with their members by keyword."""
    groups = []
    for group, inside in description.groups.items():
        members = [
            (word, [one.name for one in inside if isinstance(one, kind)])
            for kind, word in REFERENCES
        ]
        about = f"{group} of {description.name}"
        name = f"{description.name}.{group}"
        groups.append({"name": name, "about": about, "members": [m for m in members if m[1]]})
    return groups


def _bit_mask(measurement: Measurement) -> str | None:
    """Return the mask of a single bit in hexadecimal; None for a whole word."""
    return f"0x{1 << measurement.bit:X}" if measurement.bit >= 0 else None


def _format_number(value: float, kind: str, number: NumberType) -> str:
    """Return a limit as text: a real as its shortest decimal, others without a fraction."""
    is_real = kind in ("double", "float") or value != int(value)
    return shortest_decimal(float(value), number) if is_real else str(int(value))


def _format_address(address: int) -> str:
    """Return an address as eight hexadecimal digits."""
    return f"0x{address:08X}"
