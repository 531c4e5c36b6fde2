"""FMI units: the units of a Program as FMI defines them, by exponents of SI base units."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from language.expressions.unit_symbols import BASE_SYMBOLS
from language.expressions.units import UnitError, display_unit, parse_unit

SECOND = "s"
"""The unit of time."""
BASE_ORDER = ("kg", "m", "s", "A", "K", "rad")
"""The order in which exponents are written."""


@dataclass(frozen=True)
class UnitDefinition:
    """An SI unit: its name and its base units with nonzero exponents."""

    name: str
    exponents: tuple[tuple[str, int], ...]


def unit_name(text: str) -> str:
    """Return the display name of a unit of a Program.

    Returns an empty text for a pure number, for an invalid unit and for an empty text.
    """
    return display_unit(text) if text and _is_unit(text) else ""


def unit_definitions(texts: Iterable[str]) -> tuple[UnitDefinition, ...]:
    """Return the definitions of units of a Program, each once, in the order of their names.

    Texts without a `unit_name` are left out. The exponents are nonzero, in the order of BASE_ORDER.
    """
    named = {unit_name(text): text for text in texts if unit_name(text)}
    return tuple(UnitDefinition(name, _exponents(named[name])) for name in sorted(named))


def _is_unit(text: str) -> bool:
    """Tell whether a text is a valid unit that is not a pure number."""
    try:
        return not parse_unit(text).dimension.is_number
    except UnitError:
        return False


def _exponents(text: str) -> tuple[tuple[str, int], ...]:
    """Return the base units of a unit with their nonzero exponents."""
    dimension = parse_unit(text).dimension
    powers = dict(zip(BASE_SYMBOLS, dimension.powers, strict=True))
    powers["rad"] = dimension.angle or 0
    return tuple((base, powers[base]) for base in BASE_ORDER if powers[base])
