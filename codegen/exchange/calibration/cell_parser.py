"""Cell parser: the exact number of a cell, and the unit that stands beside it."""

from __future__ import annotations

import re
from fractions import Fraction

from codegen.exchange.calibration.characteristic import Cell
from language.expressions.unit_spellings import (
    NO_UNIT_WORDS,
    normalise_unit_text,
    unit_meanings,
)
from language.expressions.units import Unit, UnitError, are_compatible, parse_unit
from language.text.diagnostic import Problems
from language.text.sanitise import truncate

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
"""A decimal number with an optional exponent."""
MAX_EXPONENT = 400
"""Largest decimal exponent that is accepted; a double overflows or underflows beyond it."""
MAX_LENGTH, MAX_SHOWN = 400, 60
"""Maximum length of a number that is read, and of a text that is quoted [characters]."""


def parse_cell_number(cell: Cell, problems: Problems) -> Fraction | None:
    """Return the exact number of a cell; None with a problem reported for any other text.

    A number is decimal with a point, with an optional exponent of at most MAX_EXPONENT, and has at
    most MAX_LENGTH characters. Blanks, a decimal comma, NaN and infinities are problems.
    """
    text = cell.text
    shown = truncate(text, MAX_SHOWN)
    label = f"`{shown}` is not a number"
    hint = "a number is written like `0.05` or `1.0e-3`"
    if NUMBER.fullmatch(text) and len(text) <= MAX_LENGTH:
        exponent = re.split("[eE]", text)[1:]
        if not exponent or (len(exponent[0]) < 8 and abs(int(exponent[0])) <= MAX_EXPONENT):
            return Fraction(text)
        label, hint = f"`{shown}` is out of the range of a double", ""
    elif re.fullmatch(r"[+-]?\d+,\d+", text):
        hint = f"a decimal point is a point: `{shown.replace(',', '.')}`"
    elif text.lower().lstrip("+-") in ("nan", "inf", "infinity", "1.#inf", "1.#qnan"):
        label, hint = f"`{text}` is no finite number", ""
    problems.error("number", cell.span, label, hint)
    return None


def is_blank_unit(cell: Cell | None) -> bool:
    """Tell whether a file declares no unit: the cell is None, empty, or one of NO_UNIT_WORDS."""
    return cell is None or normalise_unit_text(cell.text).lower() in ("", *NO_UNIT_WORDS)


def parse_unit_cell(cell: Cell | None, declared_unit: Unit, problems: Problems) -> Unit | None:
    """Return the unit of a cell; the SI unit of `declared_unit` if the cell declares none.

    Spellings of tools (`unit_meanings`) are accepted. Returns None with a problem reported if the
    unit has another dimension than `declared_unit`. Raises UnitError if it is unknown.
    """
    si = Unit(str(declared_unit.dimension), Fraction(1), declared_unit.dimension)
    if cell is None or is_blank_unit(cell) or cell.text == si.text:
        return si
    for unit in _meanings(cell.text.strip()):
        if are_compatible(unit.dimension, declared_unit.dimension):
            return unit
    label = f"`{cell.text}` does not fit the unit `{declared_unit.text}`"
    problems.error("dimension", cell.span, label)
    return None


def _meanings(text: str) -> tuple[Unit, ...]:
    """Return a unit of the language, else the units that a text of a tool can mean (UnitError)."""
    try:
        return (parse_unit(text),)
    except UnitError:
        if meanings := unit_meanings(text):
            return meanings
        raise
