"""Parameter text: values of parameters with units, for files and tables."""

from __future__ import annotations

from fractions import Fraction

from diagnosis.model.parameter import si_unit
from language.model.declaration import Parameter


def format_value(value: float, parameter: Parameter) -> str:
    """Return a value [SI] as `0.12 kg*m^2`, with six digits unless these are outside its range."""
    text = f"{value:.6g}"
    if parameter.range:
        low, high = parameter.range
        if not low <= Fraction(text) <= high:
            text = repr(min(max(value, float(low)), float(high)))
    unit = si_unit(parameter)
    return text if unit == "1" else f"{text} {unit}"
