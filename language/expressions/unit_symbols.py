"""Unit symbols: the exact SI factor, the dimension and the power of the angle of each symbol."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

BASE_SYMBOLS = ("m", "kg", "s", "A", "K")
PI = Fraction("3.1415926535897932384626433832795028841971693993751")
"""pi to 50 digits; a double needs 17."""

Powers = tuple[int, int, int, int, int]
Symbol = tuple[Fraction, Powers, int]
"""Value in SI with rad = 1, exponents of the base units, power of the angle."""

PREFIXES = {
    "": Fraction(1),
    "k": Fraction(1000),
    "M": Fraction(10**6),
    "c": Fraction(1, 100),
    "m": Fraction(1, 1000),
    "u": Fraction(1, 10**6),
    "n": Fraction(1, 10**9),
}
PREFIXED_SYMBOLS: Mapping[str, tuple[Powers, str]] = {
    # symbol: powers of m, kg, s, A, K, prefixes that are known
    "m": ((1, 0, 0, 0, 0), "kcm"),
    "A": ((0, 0, 0, 1, 0), "m"),
    "V": ((2, 1, -3, -1, 0), "km"),
    "W": ((2, 1, -3, 0, 0), "k"),
    "N": ((1, 1, -2, 0, 0), "km"),
    "J": ((2, 1, -2, 0, 0), "k"),
    "Pa": ((-1, 1, -2, 0, 0), "kM"),
    "Hz": ((0, 0, -1, 0, 0), "kM"),
    "ohm": ((2, 1, -3, -2, 0), "kMm"),
    "F": ((-2, -1, 4, 2, 0), "mun"),
    "H": ((2, 1, -2, -2, 0), "mu"),
    "Wb": ((2, 1, -2, -1, 0), "m"),
    "T": ((0, 1, -2, -1, 0), "m"),
}
TIME: Powers = (0, 0, 1, 0, 0)
MASS: Powers = (0, 1, 0, 0, 0)
ENERGY: Powers = (2, 1, -2, 0, 0)
CHARGE: Powers = (0, 0, 1, 1, 0)
TEMPERATURE: Powers = (0, 0, 0, 0, 1)
DIMENSIONLESS: Powers = (0, 0, 0, 0, 0)

SYMBOLS: Mapping[str, Symbol] = {
    **{
        prefix + symbol: (PREFIXES[prefix], powers, 0)
        for symbol, (powers, prefixes) in PREFIXED_SYMBOLS.items()
        for prefix in ("", *prefixes)
    },
    "kg": (Fraction(1), MASS, 0),
    "g": (Fraction(1, 1000), MASS, 0),
    "s": (Fraction(1), TIME, 0),
    "ms": (Fraction(1, 1000), TIME, 0),
    "us": (Fraction(1, 10**6), TIME, 0),
    "ns": (Fraction(1, 10**9), TIME, 0),
    "min": (Fraction(60), TIME, 0),
    "h": (Fraction(3600), TIME, 0),
    "d": (Fraction(24 * 3600), TIME, 0),
    "Wh": (Fraction(3600), ENERGY, 0),
    "kWh": (Fraction(3600 * 1000), ENERGY, 0),
    "Ah": (Fraction(3600), CHARGE, 0),
    "mAh": (Fraction(3600, 1000), CHARGE, 0),
    "bar": (Fraction(10**5), (-1, 1, -2, 0, 0), 0),
    "L": (Fraction(1, 1000), (3, 0, 0, 0, 0), 0),
    "K": (Fraction(1), TEMPERATURE, 0),
    "degC": (Fraction(1), TEMPERATURE, 0),
    "percent": (Fraction(1, 100), DIMENSIONLESS, 0),
    "rad": (Fraction(1), DIMENSIONLESS, 1),
    "mrad": (Fraction(1, 1000), DIMENSIONLESS, 1),
    "deg": (PI / 180, DIMENSIONLESS, 1),
    "rev": (2 * PI, DIMENSIONLESS, 1),
    "rpm": (2 * PI / 60, (0, 0, -1, 0, 0), 1),
}

MISSPELLED_UNITS: Mapping[str, str] = {
    **dict.fromkeys(("Nm", "NM"), "N*m"),
    **dict.fromkeys(("Nms", "Nm*s"), "N*m*s"),
    **dict.fromkeys(("kmh", "kmph", "kph", "km/hr"), "km/h"),
    **dict.fromkeys(("sec", "seconds", "S"), "s"),
    **dict.fromkeys(("msec", "millis"), "ms"),
    **dict.fromkeys(("meter", "metre", "meters", "metres"), "m"),
    **dict.fromkeys(("degree", "degrees"), "deg"),
    **dict.fromkeys(("radian", "radians"), "rad"),
    **dict.fromkeys(("RPM", "U/min"), "rpm"),
    **dict.fromkeys(("C", "celsius", "Celsius"), "degC"),
    **dict.fromkeys(("Kg", "KG"), "kg"),
    **dict.fromkeys(("Ohm", "OHM", "Ohms", "ohms"), "ohm"),
    **dict.fromkeys(("kOhm", "KOhm"), "kohm"),
    **dict.fromkeys(("MOhm", "Megohm"), "Mohm"),
    **dict.fromkeys(("mOhm",), "mohm"),
    **dict.fromkeys(("farad", "Farad"), "F"),
    **dict.fromkeys(("henry", "Henry"), "H"),
    **dict.fromkeys(("volt", "Volt", "volts", "Volts"), "V"),
    **dict.fromkeys(("amp", "Amp", "amps", "ampere", "Ampere"), "A"),
    **dict.fromkeys(("watt", "Watt", "watts", "Watts"), "W"),
    **dict.fromkeys(("minute", "minutes", "mins"), "min"),
    **dict.fromkeys(("hour", "hours", "hr"), "h"),
}
"""Common wrong spellings of units, with the spelling of this language."""
