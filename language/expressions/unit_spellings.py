"""Unit spellings: the units that the text of a unit in a file can mean.

Loggers, CAN databases, MF4 files and calibration tools write units in many ways (`Nm`, `1/min`,
`[deg/s]`, `degC`). This module is the one table of these spellings.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache

from language.expressions.unit_symbols import SYMBOLS
from language.expressions.units import Unit, UnitError, parse_unit

NO_UNIT_WORDS = ("-", "--", "---", "unitless", "dimensionless", "no unit", "none", "n/a")
"""Texts, in small letters, that tools write where no unit is declared."""
UNIT_WORDS: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("rpm", "1/min", "/min", "min^-1", "min-1"), ("rpm", "1/min")),
    **dict.fromkeys(("U/min", "r/min", "rev/min", "tr/min", "rot/min", "upm"), ("rpm", "1/min")),
    **dict.fromkeys(("rps", "rev/s", "r/s", "U/s"), ("rev/s", "1/s")),
    **dict.fromkeys(("km/h", "kph", "kmh", "kmph", "km/hr"), ("km/h",)),
    **dict.fromkeys(("m/s", "mps"), ("m/s",)),
    **dict.fromkeys(("rad/s", "rad/sec", "radps"), ("rad/s",)),
    **dict.fromkeys(("deg/s", "deg/sec", "dps", "degps"), ("deg/s",)),
    **dict.fromkeys(("kgm^2", "kgm2"), ("kg*m^2",)),
    **dict.fromkeys(("1", *NO_UNIT_WORDS), ("1",)),
    **dict.fromkeys(("bool", "boolean", "flag", "enum", "state", "count", "counts"), ("1",)),
    **dict.fromkeys(("%", "pct", "prozent", "per cent"), ("percent",)),
    **dict.fromkeys(("deg C", "degrees C", "degree C", "degCelsius", "celsius"), ("degC",)),
    "grad C": ("degC",),
    "kelvin": ("K",),
    "C": ("degC", "A*s"),
    **dict.fromkeys(("sec", "secs", "second", "seconds", "sek"), ("s",)),
    **dict.fromkeys(("msec", "millis", "millisecond", "milliseconds"), ("ms",)),
    **dict.fromkeys(("usec", "micros", "microsecond", "microseconds"), ("us",)),
    **dict.fromkeys(("nsec", "nanosecond", "nanoseconds"), ("ns",)),
    **dict.fromkeys(("minute", "minutes", "mins"), ("min",)),
    **dict.fromkeys(("hour", "hours", "hr", "hrs"), ("h",)),
    **dict.fromkeys(("day", "days"), ("d",)),
}  # fmt: skip
"""Whole texts that are no products of SYMBOL_WORDS, in any case, and the units they can mean."""
SYMBOL_WORDS: Mapping[str, str] = {
    **dict.fromkeys(("Nm", "NM"), "N*m"),
    **dict.fromkeys(("kNm", "kNM", "KNm"), "kN*m"),
    "mNm": "mN*m",
    "Nmm": "N*mm",
    "Ncm": "N*cm",
    "Nms": "N*m*s",
    "Ws": "W*s",
    "As": "A*s",
    "Vs": "V*s",
    "kgm": "kg*m",
    "l": "L",
    "mOhm": "mohm",
    "kOhm": "kohm",
    "MOhm": "Mohm",
}  # fmt: skip
"""Symbols of files that are products of symbols of the language, in this case only."""
NAMES: Mapping[str, str] = {
    "rpm": "rpm",
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("degree", "degrees", "deg"), "deg"),
    **dict.fromkeys(("radian", "radians", "rad"), "rad"),
    **dict.fromkeys(("rev", "revs", "revolution", "revolutions"), "rev"),
    **dict.fromkeys(("sec", "second", "seconds"), "s"),
    **dict.fromkeys(("hour", "hr"), "h"),
    "minute": "min",
    **dict.fromkeys(("volt", "volts"), "V"),
    **dict.fromkeys(("amp", "amps", "ampere", "amperes"), "A"),
    **dict.fromkeys(("watt", "watts"), "W"),
    "newton": "N",
    **dict.fromkeys(("ohm", "ohms"), "ohm"),
    "farad": "F",
    "henry": "H",
    "pascal": "Pa",
    **dict.fromkeys(("liter", "litre", "liters", "litres"), "L"),
    "km": "km",
    **dict.fromkeys(("kg", "kgs"), "kg"),
    "degc": "degC",
    "percent": "percent",
    "bar": "bar",
    **dict.fromkeys(("hz", "hertz"), "Hz"),
    "kwh": "kWh",
    "ah": "Ah",
}
"""Names of symbols in any case; a symbol whose case tells a prefix (`mW`, `MW`) is not here."""
UNIT_EQUIVALENTS: Mapping[str, tuple[str, str]] = {
    **dict.fromkeys(("mph", "mi/h"), ("0.44704", "m/s")),
    "kn": ("0.514444444444444", "m/s"),
    "ft": ("0.3048", "m"),
    **dict.fromkeys(("in", "inch"), ("0.0254", "m")),
    "mi": ("1609.344", "m"),
    "lbf": ("4.4482216152605", "N"),
    **dict.fromkeys(("lbft", "ftlb", "lb*ft", "ft*lb"), ("1.3558179483314", "N*m")),
    "psi": ("6894.757293168", "Pa"),
    **dict.fromkeys(("mbar", "hPa"), ("100", "Pa")),
    **dict.fromkeys(("PS", "hp_M"), ("735.49875", "W")),
    "hp": ("745.69987158227", "W"),
    "kA": ("1000", "A"),
    "MN": ("1000", "kN"),
    "MW": ("1000", "kW"),
    "MNm": ("1000", "kN*m"),
    "ppm": ("1e-6", "1"),
    "t": ("1000", "kg"),
}
"""Units that the language lacks: the factor and the unit that a map can give instead."""
CHARACTERS = str.maketrans(
    {
        "\N{SUPERSCRIPT ONE}": "1",
        "\N{SUPERSCRIPT TWO}": "2",
        "\N{SUPERSCRIPT THREE}": "3",
        "\N{SUPERSCRIPT MINUS}": "-",
        "\N{MIDDLE DOT}": "*",
        "\N{DOT OPERATOR}": "*",
        "\N{BULLET}": "*",
        "\N{MULTIPLICATION SIGN}": "*",
        "\N{DIVISION SLASH}": "/",
        "\N{MINUS SIGN}": "-",
        "\N{MICRO SIGN}": "u",
        "\N{GREEK SMALL LETTER MU}": "u",
        "\N{GREEK CAPITAL LETTER OMEGA}": "ohm",
        "\N{OHM SIGN}": "ohm",
        "\N{DEGREE SIGN}": "deg",
        "\N{MASCULINE ORDINAL INDICATOR}": "deg",
        "\N{DEGREE CELSIUS}": "degC",
        "\N{NO-BREAK SPACE}": " ",
    }
)
"""Characters of units in files, and their notation in the language."""
MISREAD_DEGREE = "\N{LATIN CAPITAL LETTER A WITH CIRCUMFLEX}\N{DEGREE SIGN}"
"""The degree sign in UTF-8 that a tool has read as cp1252."""
BRACKETS = re.compile(r"\[(.*)\]|\((.*)\)|<(.*)>|\{(.*)\}")
"""Pattern of a text in brackets, such as `[Nm]`."""
FACTOR = re.compile(r"([*/]?)([A-Za-z%]+)(?:\^?(-?\d))?")
"""Pattern of a factor with its operator and its exponent: `*m`, `/s^2`, `s-1`."""
GROUP = re.compile(r"(/?)\(([^()]*)\)")
"""Pattern of a part of a unit in parentheses, with the division sign before it."""
INVERSE = str.maketrans("*/. ", "/*//")
"""Operators of a part of a unit by which something is divided."""
MAX_UNIT_LENGTH = 60
"""Largest number of characters of a unit."""


@cache
def unit_meanings(written: str) -> tuple[Unit, ...]:
    """Return the units that a text of a file can mean; empty if it is not understood or blank.

    The first unit is the usual one: `1/min` is `rpm`, and also the frequency `1/min`. Brackets
    around the text, superscripts and blanks are accepted. Cached.
    """
    text = normalise_unit_text(written)
    if not text or len(text) > MAX_UNIT_LENGTH:
        return ()
    meanings = UNIT_WORDS.get(text) or FOLDED_WORDS.get(text.casefold())
    if meanings:
        return tuple(map(parse_unit, meanings))
    composed = _compose(text)
    if composed is None:
        return ()
    try:
        return (parse_unit(composed),)
    except UnitError:
        return ()


def normalise_unit_text(written: str) -> str:
    """Return the text of a unit without brackets around it and with characters of the language."""
    text = written.strip().replace(MISREAD_DEGREE, "\N{DEGREE SIGN}").translate(CHARACTERS).strip()
    while match := BRACKETS.fullmatch(text):
        text = next(group for group in match.groups() if group is not None).strip() or "-"
    return re.sub(r"\s+", " ", text)


def _compose(text: str) -> str | None:
    """Return a product of symbols in the notation of the language; None for another text.

    A denominator in parentheses divides by each of its factors: `1/(kg*m^2)` -> `1/kg/m^2`, and
    `N*m/(rad/s)` -> `N*m*s/rad`.
    """
    text = GROUP.sub(lambda m: m[1] + (m[2].translate(INVERSE) if m[1] else m[2]), text)
    text = re.sub(r" ?([*/^]) ?", r"\1", text.replace("**", "^")).replace(".", "*")
    text = text.replace(" ", "*")
    body = text.removeprefix("1/")
    if body != text:
        text = body if body.startswith("/") else f"/{body}"
    products: list[str] = []
    position = 0
    for match in FACTOR.finditer(text):
        operator, symbol, exponent = match.groups()
        if match.start() != position or (bool(operator) == (not products) and operator != "/"):
            return None
        position = match.end()
        known = symbol if symbol in SYMBOLS else SYMBOL_WORDS.get(symbol)
        known = known or NAMES.get(symbol.casefold()) or ("percent" if symbol == "%" else None)
        if known is None:
            return None
        power = int(exponent or "1") * (-1 if operator == "/" else 1)
        if abs(power) != 1 and "*" in known:
            return None
        products += [_power_text(part, power) for part in known.split("*")]
    if position != len(text) or not products:
        return None
    over = [part for part in products if not part.startswith("/")]
    under = [part for part in products if part.startswith("/")]
    if not over:
        return "1" + "".join(under)
    return "*".join(over) + "".join(under)


def _power_text(symbol: str, power: int) -> str:
    """Return a factor in the notation of the language; one of a denominator starts with `/`."""
    exponent = "" if abs(power) == 1 else f"^{abs(power)}"
    return f"{'/' if power < 0 else ''}{symbol}{exponent}"


FOLDED_WORDS: Mapping[str, tuple[str, ...]] = {
    word.casefold(): meanings for word, meanings in UNIT_WORDS.items() if word != "C"
}
"""UNIT_WORDS by their text in lower case; the single letter `c` has no meaning."""
