"""Units: the exact factor, dimension and power of the angle of a unit from its text (rule 20)."""

from __future__ import annotations

import difflib
import re
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

from language.expressions.tokens import UNIT_PATTERN
from language.expressions.unit_symbols import BASE_SYMBOLS, MISSPELLED_UNITS, SYMBOLS

CELSIUS_OFFSET = Fraction(27315, 100)
"""0 degC in kelvin."""

MECHANICAL_NAMES: dict[tuple[int, ...], str] = {
    (2, 1, -2): "N*m",
    (2, 1, -1): "N*m*s",
    (1, 1, -2): "N",
    (2, 1, -3): "W",
    (-1, 1, -2): "Pa",
    (2, 1, 0): "kg*m^2",
}
"""Names of dimensions of mechanics, by the powers of m, kg, s."""
COMMON_NAMES: dict[tuple[int, ...], str] = {
    (2, 1, -3, -1, 0): "V",
    (2, 1, -3, -2, 0): "ohm",
    (-2, -1, 3, 2, 0): "A/V",
    (2, 1, -2, -2, 0): "V*s/A",
    (-2, -1, 4, 2, 0): "A*s/V",
    (0, 0, 1, 1, 0): "A*s",
    (2, 1, -2, -1, 0): "N*m/A",
    (1, 1, -3, -1, 0): "V/m",
    (2, 1, -4, -1, 0): "V/s",
    (0, 1, -2, 0, 0): "N/m",
    (2, 1, -2, 0, -1): "N*m/K",
    (2, 1, -3, 0, -1): "W/K",
    (-2, -1, 3, 0, 1): "K/W",
    (-1, 1, -3, 0, 0): "Pa/s",
}
"""Further names, by the powers of m, kg, s, A, K; used in messages, never in a Program."""

FACTOR_PATTERN = re.compile(r"([*/]?)([A-Za-z]+)(?:\^(-?\d))?")


@dataclass(frozen=True)
class Dimension:
    """Exponents of m, kg, s, A, K; `angle` is the power of the angle, or None if it is free."""

    powers: tuple[int, ...] = (0, 0, 0, 0, 0)
    angle: int | None = 0

    @property
    def is_number(self) -> bool:
        """Return whether this is a pure number: all exponents and the power of the angle are 0.

        A free power of the angle (None) is not 0.
        """
        return not any(self.powers) and self.angle == 0

    @property
    def is_dimensionless(self) -> bool:
        """Return whether the exponents of all base units are 0; the angle does not count.

        An unknown dimension counts as dimensionless.
        """
        return not any(self.powers)

    @property
    def display_name(self) -> str:
        """The dimension for messages: its name in COMMON_NAMES, else its text in SI symbols."""
        return DISPLAY_NAMES.get(str(self), str(self))

    def __str__(self) -> str:
        """Return the dimension in SI symbols: `N*m`, `kg*m^2`, `rad/s`, `1`; `?` if unknown.

        Dimensions of MECHANICAL_NAMES have that name, with `*rad`, `/rad` or `*rad^n` behind it.
        Others are products of `rad` and the base units, negative powers behind `/`. A free power of
        the angle is not shown.
        """
        if not self.powers:
            return "?"
        known = MECHANICAL_NAMES.get(self.powers[:3])
        if known and not any(self.powers[3:]):
            angle = self.angle or 0
            return known + {0: "", 1: "*rad", -1: "/rad"}.get(angle, f"*rad^{angle}")
        parts = list(zip(BASE_SYMBOLS, self.powers, strict=True))
        parts.insert(0, ("rad", self.angle or 0))
        over = [_format_power(name, power) for name, power in parts if power > 0]
        under = [_format_power(name, -power) for name, power in parts if power < 0]
        return "*".join(over or ["1"]) + "".join(f"/{name}" for name in under)


@dataclass(frozen=True)
class Unit:
    """A unit: value in SI = factor * value + offset."""

    text: str
    factor: Fraction
    dimension: Dimension
    offset: Fraction = Fraction(0)


class UnitError(ValueError):
    """The error of a text that is not a unit; the message gives the reason."""


PURE_NUMBER = Dimension()
UNKNOWN_DIMENSION = Dimension((), None)
"""Dimension of an erroneous unit: compatible with everything, so no further problem follows."""
SECOND = Dimension((0, 0, 1, 0, 0))
RADIAN = Dimension((0, 0, 0, 0, 0), 1)
NO_UNIT = Unit("1", Fraction(1), PURE_NUMBER)
UNKNOWN_UNIT = Unit("?", Fraction(1), UNKNOWN_DIMENSION)


def _format_power(name: str, power: int) -> str:
    """Return `m^2`, or `m` for the power 1."""
    return name if power == 1 else f"{name}^{power}"


DISPLAY_NAMES = {str(Dimension(powers)): text for powers, text in COMMON_NAMES.items()}


def display_unit(text: str) -> str:
    """Return the name in COMMON_NAMES of a unit given in SI symbols, or the text if it has none."""
    return DISPLAY_NAMES.get(text, text)


@cache
def parse_unit(text: str) -> Unit:
    """Return the unit of a text like `N*m*s/rad`, `1/s`, `kg*m^2`, `degC`.

    `1/` inverts the first symbol only, and `/` the next one. `1` gives NO_UNIT; only `degC` alone
    has an offset. Raises UnitError for a text of another form and for a symbol that is not in
    SYMBOLS. Cached.
    """
    if text == "1":
        return NO_UNIT
    if not re.fullmatch(UNIT_PATTERN, text):
        raise UnitError(f"`{text}` is not written as a unit")
    body = text.removeprefix("1/")
    sign = -1 if body != text else 1
    factor, powers, angle = Fraction(1), [0] * len(BASE_SYMBOLS), 0
    for operator, symbol, exponent in FACTOR_PATTERN.findall(body):
        if symbol not in SYMBOLS:
            raise UnitError(f"`{symbol}` is not a unit")
        power = int(exponent or 1) * (-1 if operator == "/" else sign)
        sign = 1
        value, base, turn = SYMBOLS[symbol]
        factor *= value**power
        powers = [old + power * new for old, new in zip(powers, base, strict=True)]
        angle += power * turn
    offset = CELSIUS_OFFSET if text == "degC" else Fraction(0)
    return Unit(text, factor, Dimension(tuple(powers), angle), offset)


def dimension_product(a: Dimension, b: Dimension, sign: int = 1) -> Dimension:
    """Return the dimension of a * b (sign 1) or a / b (sign -1), with the angle power of rule 20.

    A factor that is a pure number keeps the angle power of the other (negated for a divisor).
    Powers of angles alone add exactly. The power is free (None) for all other products. An unknown
    factor gives UNKNOWN_DIMENSION.
    """
    if UNKNOWN_DIMENSION in (a, b):
        return UNKNOWN_DIMENSION
    powers = tuple(x + sign * y for x, y in zip(a.powers, b.powers, strict=True))
    if b.is_number:
        return a
    if a.is_number:
        return Dimension(powers, None if b.angle is None else sign * b.angle)
    if a.is_dimensionless and b.is_dimensionless and a.angle is not None and b.angle is not None:
        return Dimension(powers, a.angle + sign * b.angle)
    return Dimension(powers, None)


def rate_dimension(a: Dimension) -> Dimension:
    """Return the dimension of the time derivative of a quantity: one power of the second less.

    The power of the angle stays the same; UNKNOWN_DIMENSION stays unknown.
    """
    if a == UNKNOWN_DIMENSION:
        return UNKNOWN_DIMENSION
    return Dimension(tuple(x - y for x, y in zip(a.powers, SECOND.powers, strict=True)), a.angle)


def dimension_power(a: Dimension, exponent: int) -> Dimension:
    """Return the dimension of a^exponent; the angle power is free unless a is a pure angle.

    Exponent 0 gives a pure number; exponent 1, and a pure number as base, give a unchanged.
    """
    if a.is_number or exponent == 1:
        return a
    if exponent == 0:
        return PURE_NUMBER
    powers = tuple(exponent * x for x in a.powers)
    is_angle_known = a.angle is not None and a.is_dimensionless
    return Dimension(powers, exponent * (a.angle or 0) if is_angle_known else None)


def dimension_sqrt(a: Dimension) -> Dimension | None:
    """Return the dimension of sqrt(a), or None if an exponent or the angle power is odd.

    A free angle power stays free; UNKNOWN_DIMENSION stays unknown.
    """
    if a == UNKNOWN_DIMENSION:
        return UNKNOWN_DIMENSION
    odd_angle = a.angle is not None and a.angle % 2 != 0
    if any(x % 2 for x in a.powers) or odd_angle:
        return None
    return Dimension(tuple(x // 2 for x in a.powers), None if a.angle is None else a.angle // 2)


def are_compatible(a: Dimension, b: Dimension) -> bool:
    """Return whether two quantities may be added, compared or assigned (rule 20).

    The exponents have to be equal, and the angle powers too unless one is free. UNKNOWN_DIMENSION
    is compatible with every dimension.
    """
    if UNKNOWN_DIMENSION in (a, b):
        return True
    return a.powers == b.powers and (a.angle is None or b.angle is None or a.angle == b.angle)


def is_same_unit(first: Unit, second: Unit) -> bool:
    """Return whether two units have the same dimension, factor and offset."""
    same = (first.factor, first.offset) == (second.factor, second.offset)
    return same and are_compatible(first.dimension, second.dimension)


def common_dimension(a: Dimension, b: Dimension) -> Dimension:
    """Return the dimension of a sum of two compatible quantities; compatibility is not checked.

    It is a, or b if the angle power of a is free; UNKNOWN_DIMENSION if one is unknown.
    """
    if UNKNOWN_DIMENSION in (a, b):
        return UNKNOWN_DIMENSION
    return b if a.angle is None else a


def unit_hint(text: str) -> str:
    """Return "did you mean `N*m`?" for a text that is not a unit; empty without a suggestion.

    A text in MISSPELLED_UNITS gives its unit. Else each symbol is replaced by the one most similar
    to it, and the result is suggested if it is a unit. Else a text with a blank gives examples of
    units.
    """
    if written := unit_without_parentheses(text):
        return f"a unit has no parentheses: write `{written}`"
    if text in MISSPELLED_UNITS:
        return f"did you mean `{MISSPELLED_UNITS[text]}`?"
    changed = re.sub(r"[A-Za-z]+", lambda match: _nearest_symbol(match.group()), text)
    try:
        return f"did you mean `{parse_unit(changed).text}`?"
    except UnitError:
        return "a unit is written like `N*m`, `kg*m^2`, `1/s`" if " " in text else ""


def unit_without_parentheses(text: str) -> str:
    """Return a unit with its parentheses resolved: `1/(kg*m^2) -> 1/kg/m^2`; else "".

    A divisor in parentheses has its `*` and `/` exchanged. The result is "" for a text without
    parentheses, with nested ones, or that is no unit afterwards.
    """
    flipped = str.maketrans("*/", "/*")
    written = re.sub(r"/\(([^()]+)\)", lambda match: f"/{match[1].translate(flipped)}", text)
    written = re.sub(r"(^|\*)\(([^()]+)\)", r"\1\2", written)
    try:
        parse_unit(written)
    except UnitError:
        return ""
    return written if written != text else ""


def matching_units_hint(dimension: Dimension) -> str:
    """Return the help text "units that fit: `s`, `ms`, `min`" with the symbols of a dimension.

    Exponents and angle power have to be equal; symbols are in the order of SYMBOLS, without
    products. The text is empty if there are none, and for a pure number.
    """
    matching = [
        f"`{name}`"
        for name, (_, powers, angle) in SYMBOLS.items()
        if Dimension(powers, angle) == dimension and not dimension.is_number
    ]
    return f"units that fit: {', '.join(matching)}" if matching else ""


def _nearest_symbol(symbol: str) -> str:
    """Return the symbol most similar to a text; the text itself if there is none."""
    if symbol in SYMBOLS:
        return symbol
    matches = difflib.get_close_matches(symbol, SYMBOLS, n=1)
    return MISSPELLED_UNITS.get(symbol, matches[0] if matches else symbol)


def angle_hint(left: Dimension, right: Dimension) -> str:
    """Return the help text for two dimensions with equal exponents, which differ in the angle only.

    For an angle and a number it proposes to give the unit of the angle. The text is empty if the
    exponents differ.
    """
    if left.powers != right.powers:
        return ""
    if left.is_dimensionless and 0 in (left.angle, right.angle):
        return "give the unit of the angle: `0.02 rad`, `3 deg`"
    return "they differ in the power of the angle (rad)"
