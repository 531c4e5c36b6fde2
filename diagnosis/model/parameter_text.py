"""Parameter text: values of parameters in their declared units, for files and tables."""

from __future__ import annotations

from fractions import Fraction

from language.expressions.units import Unit
from language.model.declaration import Parameter


def format_value(value: float, parameter: Parameter) -> str:
    """Return a value [SI] with six significant digits in the declared unit, as `0.12 kg*m^2`.

    If the rounded value is outside the range of the parameter, the value is clipped to the range
    and written in full. Without a unit the text is the number alone.
    """
    unit = parameter.unit
    text = f"{in_unit(value, unit):.6g}"
    if parameter.range:
        low, high = ((end - unit.offset) / unit.factor for end in parameter.range)
        if not low <= Fraction(text) <= high:
            text = repr(min(max(in_unit(value, unit), float(low)), float(high)))
    return text if unit.text == "1" else f"{text} {unit.text}"


def in_unit(value: float, unit: Unit) -> float:
    """Return a value [SI] in a unit."""
    return (value - float(unit.offset)) / float(unit.factor)
