"""Parameter text: values of parameters with units, for files and tables."""

from __future__ import annotations

from fractions import Fraction

from diagnosis.model.parameter import si_unit
from language.model.declaration import Parameter


def format_value(value: float, parameter: Parameter) -> str:
    """Return a value [SI] with six significant digits and its SI unit, such as `0.12 kg*m^2`.

    If the rounded value is outside the range of the parameter, the value is clipped to the range
    and written in full. Without a unit the text is the number alone.
    """
    text = f"{value:.6g}"
    if parameter.range:
        low, high = parameter.range
        if not low <= Fraction(text) <= high:
            text = repr(min(max(value, float(low)), float(high)))
    unit = si_unit(parameter)
    return text if unit == "1" else f"{text} {unit}"
