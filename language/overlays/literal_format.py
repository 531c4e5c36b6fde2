"""Literal format: values in SI as the shortest texts of the language with the same bits."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from decimal import Context, Decimal
from fractions import Fraction

from language.expressions.number_literal import MAX_EXPONENT
from language.expressions.units import Unit
from language.ir.number_type import NumberType, round_to_type
from language.model.declaration import Parameter, Range
from language.text.diagnostic import Span
from language.text.document import Entry, MappingNode, ScalarNode
from language.typecheck.lookup_table import Axis

MAX_DIGITS = 60
"""Largest number of digits that is tried; a unit with an offset needs many near its zero."""
PLAIN_EXPONENTS = range(-5, 16)
"""Decimal exponents of values that are written without an exponent."""


def format_value_in_unit(parameter: Parameter, value: float, number_type: NumberType) -> str:
    """Return a value [SI] as a literal in the unit of a parameter, such as `0.05 s`.

    It is the decimal with the fewest digits that gives `value` again when it is read and rounded to
    `number_type`, and that is within the range of the parameter. Without such a decimal the literal
    is in the SI unit; ValueError if there is none either. The unit 1 is not written.

    A bool is `true` or `false`, an enum the name at the index `value`, an int an integer without a
    unit.
    """
    if parameter.type == "bool":
        return "true" if value else "false"
    if parameter.type == "enum":
        return parameter.values[int(value)]
    if parameter.type == "int":
        return str(int(value))
    number, unit = _shortest_in_any_unit(parameter, value, number_type)
    return format_decimal(number) if unit.text == "1" else f"{format_decimal(number)} {unit.text}"


def table_points(
    parameter: Parameter, values: Sequence[float], number_type: NumberType, span: Span
) -> MappingNode:
    """Return the values [SI] of a lookup table as `{points: {...}}`; the last axis varies fastest.

    `values` are in the order of `parameter.table`; StopIteration if there are too few. They are
    formatted by `format_value_in_unit`, points as in the spec; a second axis gives nested mappings.
    `span` is the place of all nodes.
    """
    assert parameter.table
    texts = iter([format_value_in_unit(parameter, value, number_type) for value in values])

    def rows(axes: Sequence[Axis]) -> MappingNode:
        """Return the nested mapping of the remaining axes; take its values from the iterator."""
        axis, *inner = axes
        entries = {}
        for key in axis.point_texts:
            node = rows(inner) if inner else ScalarNode(next(texts), span)
            entries[key] = Entry(key, span, node)
        return MappingNode(entries, span)

    return MappingNode({"points": Entry("points", span, rows(parameter.table.axes))}, span)


def has_exact_literal(parameter: Parameter, number_type: NumberType) -> bool:
    """Tell whether the shortest literal of the value of a real parameter has exactly this value.

    The shortest literal is that of the value rounded to `number_type` (see `format_value_in_unit`),
    so it is false for a value with more digits than the type holds, such as `0.06000000001` in
    float32. Raises ValueError if there is no such literal.
    """
    assert parameter.value is not None
    number, unit = _shortest_in_any_unit(
        parameter, round_to_type(parameter.value, number_type), number_type
    )
    return Fraction(number) * unit.factor + unit.offset == parameter.value


def format_calibration(
    name: str, of: str, origin: str, date: str, values: Mapping[str, str]
) -> str:
    """Return the text of a calibration file; `values` are literals by parameter, in their order.

    The lines are `language: 1`, `calibration`, `of`, `from` (as a quoted string), `date` and
    `parameters`. An empty `origin` or `date` is left out; without values it is `parameters: {}`.
    """
    lines = ["language: 1", f"calibration: {name}", f"of: {of}"]
    lines += [f"from: {json.dumps(origin, ensure_ascii=False)}"] if origin else []
    lines += [f"date: {date}"] if date else []
    lines += ["parameters:"] if values else ["parameters: {}"]
    lines += [f"  {parameter}: {text}" for parameter, text in values.items()]
    return "\n".join(lines) + "\n"


def format_exact(number: Fraction) -> str:
    """Return a number as a decimal literal, rounded to MAX_DIGITS significant digits.

    Trailing zeros are left out. An exponent is written outside of PLAIN_EXPONENTS: `0.05`,
    `1.0e-7`.
    """
    return format_decimal(_round_to_digits(number, MAX_DIGITS))


def format_exact_in_unit(value: Fraction, unit: Unit) -> str:
    """Return a value [SI] exactly as a literal with its unit, also for the unit 1.

    If it has no decimal of MAX_DIGITS digits in `unit`, the literal is in the SI unit, there
    rounded to MAX_DIGITS digits.
    """
    number = (value - unit.offset) / unit.factor
    if Fraction(_round_to_digits(number, MAX_DIGITS)) == number:
        return f"{format_exact(number)} {unit.text}"
    return f"{format_exact(value)} {unit.dimension}"


def _shortest_in_any_unit(
    parameter: Parameter, value: float, number_type: NumberType
) -> tuple[Decimal, Unit]:
    """Return the shortest decimal of a value and its unit: that of the parameter, else the SI unit.

    Raises ValueError if there is none in either.
    """
    own, limits = parameter.unit, parameter.range
    for unit in (own, Unit(str(own.dimension), Fraction(1), own.dimension)):
        number = _shortest_decimal(value, unit, number_type, limits)
        if number is not None:
            return number, unit
    raise ValueError(f"{value!r} of `{parameter.name}` has no literal in {own.text}")


def _shortest_decimal(
    value: float, unit: Unit, number_type: NumberType, limits: Range | None
) -> Decimal | None:
    """Return the decimal with the fewest digits that gives `value` again, within the limits.

    Returns None if none with less than `MAX_DIGITS` digits does, or if its exponent is too large
    for a literal.
    """
    target = Fraction(value)
    if limits:
        target = min(max(target, limits[0]), limits[1])
    exact = (target - unit.offset) / unit.factor
    for digits in range(1, MAX_DIGITS):
        rounded = _round_to_digits(exact, digits)
        reread = Fraction(rounded) * unit.factor + unit.offset
        is_inside = limits is None or limits[0] <= reread <= limits[1]
        if is_inside and round_to_type(reread, number_type) == value:
            return rounded if abs(rounded.adjusted()) < MAX_EXPONENT else None
    return None


def _round_to_digits(exact: Fraction, digits: int) -> Decimal:
    """Return a number rounded to a number of significant digits, without trailing zeros."""
    context = Context(prec=digits)
    return context.divide(Decimal(exact.numerator), Decimal(exact.denominator)).normalize(context)


def format_decimal(number: Decimal) -> str:
    """Return a decimal as a literal of the language, such as `0.05` or `1.0e-7`."""
    exponent = number.adjusted() if number else 0
    if exponent in PLAIN_EXPONENTS:
        return f"{number:f}"
    sign, figures, _ = number.as_tuple()
    first, *further = map(str, figures)
    return f"{'-' if sign else ''}{first}.{''.join(further) or '0'}e{exponent}"
