"""A2L: what a tool may measure and calibrate, as ASAM MCD-2 MC 1.7.1; addresses from an ELF."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from codegen.asam.conversion import TRUTH, Conversion
from codegen.asam.description import (
    PAGE,
    SELF,
    Axis,
    Characteristic,
    Description,
    Measurement,
    described,
)
from codegen.asam.image import Image, ImageError, Place, image_of
from codegen.rendering import render, version
from language.number import NumberType, decimal
from language.program import Program

TYPES: Mapping[str, tuple[str, int]] = {
    "double": ("FLOAT64_IEEE", 8),
    "float": ("FLOAT32_IEEE", 4),
    "bool": ("UBYTE", 1),
    "uint8_t": ("UBYTE", 1),
    "uint16_t": ("UWORD", 2),
    "int16_t": ("SWORD", 2),
    "int32_t": ("SLONG", 4),
    "uint32_t": ("ULONG", 4),
}
"""The name of a C type there, and its bytes."""
KINDS = ("VALUE", "CURVE", "MAP")
"""By how many axes a characteristic has."""
REFERENCES = ((Characteristic, "REF_CHARACTERISTIC"), (Measurement, "REF_MEASUREMENT"))
FORMAT: Mapping[NumberType, str] = {"float64": "%12.6", "float32": "%10.4"}


@dataclass(frozen=True)
class Located:
    """Where the page and one instance lie; `instance` is None where a program has not told."""

    image: Image
    page: Place
    instance: Place | None

    def place(self, one: Measurement | Characteristic) -> Place | None:
        """Return the structure that something is in."""
        return self.page if isinstance(one, Characteristic) else self.instance


def located(
    program: Program, elf: Path, page: str | None = None, instance: str | None = None
) -> Located:
    """Find a page and an instance of a Program's C in a linked program.

    `page` and `instance` name them where there are several. Raises ImageError: also for code of
    another Program; ToolMissing.
    """
    found = described(program)
    types = f"{found.name}_{PAGE}", f"{found.name}_{SELF}"
    image = image_of(elf, types, (f"{found.name}_Version",))
    told = image.texts.get(f"{found.name}_Version")
    if told is None:
        raise ImageError(f"{elf}: it has no {found.name}_Version")
    if told != found.digest:
        raise ImageError(f"{elf}: its {found.name} is of digest {told}, the spec's {found.digest}")
    default = f"{found.name}_default_cal"
    is_default = page is None and any(one.symbol == default for one in image.places[types[0]])
    selves = [one for one in image.places[types[1]] if not one.is_fixed]
    return Located(
        image,
        image.chosen(types[0], image.places[types[0]], default if is_default else page),
        image.chosen(types[1], selves, instance) if selves or instance else None,
    )


def a2l(program: Program, where: Located | None = None) -> str:
    """Return the A2L of a Program's C. Raises ImageError where the ELF has another layout.

    Without a place characteristics link to symbols, and measurements have no address.
    """
    found = described(program)
    methods = _methods(found, program.number)
    named = {conversion: method["name"] for conversion, method in methods.items()}
    return render(
        "a2l.jinja",
        {
            "name": found.name,
            "about": safe(found.about),
            "digest": found.digest,
            "version": version(),
            "note": safe(f"addresses of {where.image.path.name}") if where else "no addresses",
            "epk_address": _hex(where.image.symbols[f"{found.name}_Version"]) if where else None,
            "byte_order": "MSB_LAST"
            if where is None or where.image.is_little_endian
            else "MSB_FIRST",
            "methods": list(methods.values()),
            "layouts": _layouts(found),
            "characteristics": [
                {**_common(c, named, program, where), **_of_page(c, named, program.number)}
                for c in found.characteristics
            ],
            "measurements": [
                {**_common(m, named, program, where), "size": m.size, "mask": _mask(m)}
                for m in found.measurements
            ],
            "groups": _groups(found),
        },
    )


def safe(text: str) -> str:
    """Return a text as it can stand between quotes."""
    plain = text.encode("ascii", "replace").decode()
    return re.sub(r"\s+", " ", plain.replace("\\", "/").replace('"', "'")).strip()


def _common(
    one: Measurement | Characteristic,
    named: Mapping[Conversion, str],
    program: Program,
    where: Located | None,
) -> dict[str, Any]:
    """Return what both have: name, type, limits, address."""
    place = where.place(one) if where else None
    page = f"{program.name}_default_cal.{one.path}" if isinstance(one, Characteristic) else ""
    factor = one.conversion.factor
    low, high = (_number(end * factor, one.type, program.number) for end in one.limits)
    known = {
        "name": one.name,
        "about": safe(one.about),
        "type": TYPES[one.type][0],
        "method": named[one.conversion],
        "low": low,
        "high": high,
    }
    if place is None:
        return {**known, "address": None, "symbol": page, "offset": 0}
    offset = _offset(place, one)
    return {
        **known,
        "address": _hex(place.address + offset),
        "symbol": place.symbol,
        "offset": offset,
    }


def _offset(place: Place, one: Measurement | Characteristic) -> int:
    """Return where a member is. Raises ImageError where it is not, or of another size."""
    count = one.size if isinstance(one, Measurement) else 1
    for axis in one.axes if isinstance(one, Characteristic) else ():
        count *= len(axis.points)
    offset, size = place.members.get(one.path, (0, 0))
    if size != TYPES[one.type][1] * max(count, 1):
        raise ImageError(f"{place.symbol}.{one.path} has {size} bytes: it is of another version")
    return offset


def _of_page(
    one: Characteristic, named: Mapping[Conversion, str], number: NumberType
) -> dict[str, Any]:
    """Return what a characteristic has beside: its kind, layout and axes."""
    return {
        "kind": KINDS[len(one.axes)],
        "layout": f"layout.{TYPES[one.type][0]}",
        "axes": [_axis(axis, named, number) for axis in one.axes],
    }


def _axis(axis: Axis, named: Mapping[Conversion, str], number: NumberType) -> dict[str, Any]:
    points = [decimal(point, number) for point in axis.points]
    return {
        "method": named[axis.conversion],
        "points": points,
        "low": points[0],
        "high": points[-1],
    }


def _methods(found: Description, number: NumberType) -> dict[Conversion, dict[str, Any]]:
    """Return the conversions that are used, each with the name of its unit or its first user."""
    used = [(one.conversion, one.path) for one in found.characteristics]
    used += [(axis.conversion, one.path) for one in found.characteristics for axis in one.axes]
    used += [(one.conversion, one.path) for one in found.measurements]
    methods: dict[Conversion, dict[str, Any]] = {}
    for conversion, path in used:
        if conversion in methods:
            continue
        name = f"names.{_word(path)}" if conversion.names else f"unit.{_word(conversion.unit)}"
        name = "names.truth" if conversion == TRUTH else name
        methods[conversion] = {
            "name": _unlike(name, {method["name"] for method in methods.values()}),
            "about": safe(conversion.unit or ", ".join(text for _, text in conversion.names)),
            "unit": safe(conversion.unit),
            "factor": repr(conversion.factor),
            "format": FORMAT[number],
            "names": [(n, safe(text)) for n, text in conversion.names],
        }
    return methods


def _word(text: str) -> str:
    """Return a unit or path as a word: `rad/s` as rad_per_s."""
    words = text.replace("/", "_per_").replace("*", "_").replace(".", "_").replace("^-", "_m")
    word = re.sub(r"\W", "", words) or "none"
    return f"_{word}" if word[0].isdigit() else word


def _unlike(name: str, taken: Collection[str]) -> str:
    """Return a name that is not taken: with a number behind it where it is."""
    numbered = (f"{name}_{k}" for k in count(2))
    return name if name not in taken else next(one for one in numbered if one not in taken)


def _layouts(found: Description) -> list[dict[str, str]]:
    kinds = {TYPES[one.type][0]: None for one in found.characteristics}
    return [{"name": f"layout.{kind}", "type": kind} for kind in kinds]


def _groups(found: Description) -> list[dict[str, Any]]:
    groups = []
    for group, inside in found.groups.items():
        members = [
            (word, [one.name for one in inside if isinstance(one, kind)])
            for kind, word in REFERENCES
        ]
        about = f"{group} of {found.name}"
        name = f"{found.name}.{group}"
        groups.append({"name": name, "about": about, "members": [m for m in members if m[1]]})
    return groups


def _mask(one: Measurement) -> str | None:
    return f"0x{1 << one.bit:X}" if one.bit >= 0 else None


def _number(value: float, kind: str, number: NumberType) -> str:
    is_real = kind in ("double", "float") or value != int(value)
    return decimal(float(value), number) if is_real else str(int(value))


def _hex(address: int) -> str:
    return f"0x{address:08X}"
