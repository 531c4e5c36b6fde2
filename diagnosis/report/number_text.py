"""Number text: numbers with significant digits and units, for sentences and tables."""

from __future__ import annotations

import math

from diagnosis.estimation.quantity import Quantity

DIMENSIONLESS = ("1", "")


def format_with_std(value: float, std: float) -> str:
    """Return `3.770 ± 0.051`: a value with the places of a two-digit standard deviation.

    Without a finite positive one the value has four significant digits.
    """
    if not (math.isfinite(value) and math.isfinite(std)) or std <= 0.0:
        return format_significant(value, 4)
    std = float(f"{std:.2g}")
    places = max(0, 1 - math.floor(math.log10(std)))
    if places > 8 or abs(value) >= 1e6:
        return f"{value:.6g} ± {std:.2g}"
    if places == 0:
        step = 10 ** (math.floor(math.log10(std)) - 1)
        return f"{round(value / step) * step:.0f} ± {round(std / step) * step:.0f}"
    return f"{value:.{places}f} ± {std:.{places}f}"


def format_quantity(quantity: Quantity) -> str:
    """Return an estimated value as `3.770 ± 0.051 N*m`; without the unit if that is "1" or ""."""
    text = format_with_std(quantity.value, quantity.std)
    return text if quantity.unit in DIMENSIONLESS else f"{text} {quantity.unit}"


def format_significant(value: float, digits: int = 3) -> str:
    """Return `0.500`: a number with significant digits, without exponent from 1e-4 to 1e6."""
    if not math.isfinite(value):
        return "-"
    value = float(f"{value:.{digits}g}")
    if value == 0.0 or not 1e-4 <= abs(value) < 1e6:
        return f"{value:.{digits}g}"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    return f"{value:.{max(0, places)}f}"


def format_percent(part: float) -> str:
    """Return a fraction as `0.96 %`, `3.2 %` or `45 %`; `-` if it is not finite."""
    value = 100.0 * part
    if not math.isfinite(value):
        return "-"
    size = abs(value)
    return f"{value:.{2 if size < 1.0 else 1 if size < 10.0 else 0}f} %"


def format_change(before: float, after: float) -> str:
    """Return a relative change: `−52 %`, `+7 %`, `as before` below 0.5 %, `-` if undefined."""
    if not (math.isfinite(before) and math.isfinite(after)) or before <= 0.0:
        return "-"
    part = 100.0 * (after / before - 1.0)
    return "as before" if abs(part) < 0.5 else f"{part:+.0f} %".replace("-", "\N{MINUS SIGN}")


def format_probability(share: float) -> str:
    """Return a probability as `12.3 %`, or `< 0.1 %` below and `> 99.9 %` above these limits."""
    if share < 0.001:
        return "< 0.1 %"
    return "> 99.9 %" if share > 0.999 else f"{100.0 * share:.1f} %"
