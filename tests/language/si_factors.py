"""What each unit of the language is in SI, written by hand."""

from __future__ import annotations

from fractions import Fraction

M, KG, S, A, K = ("m", "kg", "s", "A", "K")
N, PA = {M: 1, KG: 1, S: -2}, {M: -1, KG: 1, S: -2}
J, W = {M: 2, KG: 1, S: -2}, {M: 2, KG: 1, S: -3}
V = {M: 2, KG: 1, S: -3, A: -1}
MEANING: dict[str, tuple[Fraction, dict[str, int]]] = {
    # symbol: (factor to SI, powers of the base units)
    "m": (Fraction(1), {M: 1}),
    "mm": (Fraction(1, 10**3), {M: 1}),
    "cm": (Fraction(1, 10**2), {M: 1}),
    "km": (Fraction(10**3), {M: 1}),
    "kg": (Fraction(1), {KG: 1}),
    "g": (Fraction(1, 10**3), {KG: 1}),
    "s": (Fraction(1), {S: 1}),
    "ms": (Fraction(1, 10**3), {S: 1}),
    "us": (Fraction(1, 10**6), {S: 1}),
    "min": (Fraction(60), {S: 1}),
    "h": (Fraction(60 * 60), {S: 1}),
    "A": (Fraction(1), {A: 1}),
    "mA": (Fraction(1, 10**3), {A: 1}),
    "V": (Fraction(1), V),
    "mV": (Fraction(1, 10**3), V),
    "kV": (Fraction(10**3), V),
    "W": (Fraction(1), W),
    "kW": (Fraction(10**3), W),
    "N": (Fraction(1), N),
    "kN": (Fraction(10**3), N),
    "mN": (Fraction(1, 10**3), N),
    "J": (Fraction(1), J),
    "kJ": (Fraction(10**3), J),
    "Wh": (Fraction(60 * 60), J),
    "kWh": (Fraction(10**3 * 60 * 60), J),
    "Pa": (Fraction(1), PA),
    "kPa": (Fraction(10**3), PA),
    "MPa": (Fraction(10**6), PA),
    "bar": (Fraction(10**5), PA),
    "Hz": (Fraction(1), {S: -1}),
    "kHz": (Fraction(10**3), {S: -1}),
    "MHz": (Fraction(10**6), {S: -1}),
    "ohm": (Fraction(1), {M: 2, KG: 1, S: -3, A: -2}),
    "kohm": (Fraction(10**3), {M: 2, KG: 1, S: -3, A: -2}),
    "Mohm": (Fraction(10**6), {M: 2, KG: 1, S: -3, A: -2}),
    "mohm": (Fraction(1, 10**3), {M: 2, KG: 1, S: -3, A: -2}),
    "F": (Fraction(1), {M: -2, KG: -1, S: 4, A: 2}),
    "mF": (Fraction(1, 10**3), {M: -2, KG: -1, S: 4, A: 2}),
    "nF": (Fraction(1, 10**9), {M: -2, KG: -1, S: 4, A: 2}),
    "uF": (Fraction(1, 10**6), {M: -2, KG: -1, S: 4, A: 2}),
    "H": (Fraction(1), {M: 2, KG: 1, S: -2, A: -2}),
    "uH": (Fraction(1, 10**6), {M: 2, KG: 1, S: -2, A: -2}),
    "mH": (Fraction(1, 10**3), {M: 2, KG: 1, S: -2, A: -2}),
    "Wb": (Fraction(1), {M: 2, KG: 1, S: -2, A: -1}),
    "mWb": (Fraction(1, 10**3), {M: 2, KG: 1, S: -2, A: -1}),
    "mT": (Fraction(1, 10**3), {KG: 1, S: -2, A: -1}),
    "T": (Fraction(1), {KG: 1, S: -2, A: -1}),
    "Ah": (Fraction(60 * 60), {S: 1, A: 1}),
    "mAh": (Fraction(36, 10), {S: 1, A: 1}),
    "L": (Fraction(1, 10**3), {M: 3}),
    "K": (Fraction(1), {K: 1}),
    "degC": (Fraction(1), {K: 1}),
    "percent": (Fraction(1, 100), {}),
    "rad": (Fraction(1), {}),
    "mrad": (Fraction(1, 10**3), {}),
}
