"""Values of parameters as text."""

from __future__ import annotations

from fractions import Fraction

from diagnosis.model.parameter import si_unit
from language.model.declaration import Parameter


def format_value(value: float, parameter: Parameter) -> str:
    """Return a value in SI with its unit, rounded, but not out of its range."""
    text = f"{value:.6g}"
    if parameter.range:
        low, high = parameter.range
        if not low <= Fraction(text) <= high:
            text = repr(min(max(value, float(low)), float(high)))
    unit = si_unit(parameter)
    return text if unit == "1" else f"{text} {unit}"
