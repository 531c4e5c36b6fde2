"""Number literals: the exact value of a number, with or without a unit, from its text."""

from __future__ import annotations

import re
import sys
from fractions import Fraction
from functools import lru_cache

from language.expressions.syntax_tree import NumberLiteral
from language.expressions.tokens import UNIT_PATTERN
from language.expressions.units import NO_UNIT, Unit, UnitError, parse_unit, unit_hint
from language.text.diagnostic import Problem, Problems, Span, SpecError

UNIT_HINT = "a unit is written like `W`, `N*m`, `1/s`, a product with `*`: `2 * x`"
DECIMAL_PATTERN = re.compile(r"(0|[1-9]\d*)(\.\d+)?([eE][-+]?\d+)?")
PLAIN_DECIMAL_PATTERN = re.compile(r"(0|[1-9]\d*)(\.\d+)?")
QUANTITY_PATTERN = re.compile(rf"{DECIMAL_PATTERN.pattern} {UNIT_PATTERN}")
MAX_QUANTITY = Fraction(sys.float_info.max)
MAX_EXPONENT = 330
"""Largest decimal exponent that is accepted; beyond it a double overflows or underflows."""


def parse_number_literal(text: str, span: Span) -> NumberLiteral:
    """Return the literal of a number without a unit, with its exact value.

    Raises SpecError as `parse_decimal_literal`, and for a value above the largest double.
    """
    return NumberLiteral(
        _require_in_range(parse_decimal_literal(text, span), text, span), NO_UNIT, span
    )


def parse_quantity_literal(text: str, span: Span) -> NumberLiteral:
    """Return the literal of a number with a unit, separated by one blank; its value is in SI.

    The value is exact; the offset of `degC` is added. Raises SpecError as `parse_decimal_literal`,
    for a text that is not a unit ("unit"), and for a value above the largest double ("number").
    """
    digits, _, unit_text = text.partition(" ")
    value = parse_decimal_literal(digits, span.subspan(0, len(digits)))
    unit = _parse_unit(unit_text, span.subspan(len(digits) + 1, len(unit_text)))
    return NumberLiteral(
        _require_in_range(value * unit.factor + unit.offset, text, span), unit, span
    )


def parse_decimal_literal(text: str, span: Span) -> Fraction:
    """Return the exact value of a decimal literal without sign, like `12.5` or `1.0e-3`.

    Raises SpecError of kind "number" for a form that YAML tools read differently (`1e3`, `010`),
    for another text, and for an exponent above MAX_EXPONENT in size.
    """
    if PLAIN_DECIMAL_PATTERN.fullmatch(text):
        return _to_fraction(text)
    problems = Problems()
    if re.fullmatch(r"\d+[eE][-+]?\d+", text):
        digits, exponent = re.split("[eE]", text)
        hint = f"write `{digits}.0e{exponent}`: other YAML tools read `{text}` as a text"
        problems.error("number", span, f"`{text}` has an exponent but no point", hint)
    elif re.fullmatch(r"0\d+.*", text):
        shorter = re.sub(r"^0+(?=\d)", "", text)
        hint = f"write `{shorter}`: other YAML tools read `{text}` as octal"
        problems.error("number", span, f"`{text}` starts with a zero", hint)
    elif not DECIMAL_PATTERN.fullmatch(text):
        hint = _missing_blank_hint(text) or "write it as `1.0e-3` or `12.5`"
        problems.error("number", span, f"`{text}` is not a number", hint)
    elif abs(_exponent_of(text)) > MAX_EXPONENT:
        problems.error("number", span, f"`{text}` is out of the range of a double")
    problems.raise_if_errors()
    return _to_fraction(text)


@lru_cache(maxsize=4096)
def _to_fraction(text: str) -> Fraction:
    """Return the exact value of a decimal text; cached."""
    return Fraction(text)


def _missing_blank_hint(text: str) -> str:
    """Return the help text for a text like `100ms`.

    The help text is empty if `text` is not a number followed by a unit.
    """
    match = re.fullmatch(r"([0-9.]+?)\.?([A-Za-z].*)", text)
    if not match or not DECIMAL_PATTERN.fullmatch(match[1]):
        return ""
    try:
        parse_unit(match[2])
    except UnitError:
        return ""
    return f"one blank stands before the unit: `{match[1]} {match[2]}`"


def _require_in_range(value: Fraction, text: str, span: Span) -> Fraction:
    """Return the value. Raises SpecError if it is out of the range of a double."""
    if abs(value) > MAX_QUANTITY:
        label = f"`{text}` is out of the range of a double"
        raise SpecError([Problem("number", span, label)])
    return value


def _exponent_of(text: str) -> int:
    """Return the decimal exponent of a literal, 0 if it has none."""
    parts = re.split("[eE]", text)
    return int(parts[1]) if len(parts) == 2 else 0


def _parse_unit(text: str, span: Span) -> Unit:
    """Return a unit. Raises SpecError with a suggestion if the text is not a unit."""
    try:
        return parse_unit(text)
    except UnitError as error:
        hint = unit_hint(text) or UNIT_HINT
        raise SpecError([Problem("unit", span, str(error), hint)]) from None
