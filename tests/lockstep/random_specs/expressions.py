"""Words: random expressions of the language as text, of reals, whole numbers and truth values.

`draw` is a seeded `random.Random`, or that of hypothesis, which shrinks what it drew.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from random import Random

RELATIONS = ("<", "<=", ">", ">=")
DIGITS = (
    *("0", "0.5", "2", "3", "1", "0.1", "0.3", "7.0e-3", "1.1e4", "0.0078125"),
    *("0.30000000000000004", "0.1234567890123456789", "2.7182818284590452", "1.0000001"),
)
"""Some need all 17 (or 9) digits to be read back as the same bits."""


@dataclass(frozen=True)
class Scope:
    """What may be read at one place, and the tables and delays that there are."""

    reals: tuple[str, ...]
    truths: tuple[str, ...] = ()
    wholes: tuple[str, ...] = ()
    tables: tuple[str, ...] = ()
    memory: tuple[str, ...] = ()

    def with_reals(self, *reals: str) -> Scope:
        """Return the scope with more reals."""
        return replace(self, reals=(*self.reals, *reals))

    def with_truths(self, *truths: str) -> Scope:
        """Return the scope with more truth values."""
        return replace(self, truths=(*self.truths, *truths))


def number(draw: Random) -> str:
    """Return a literal, some with a sign."""
    text = draw.choice(DIGITS)
    if draw.random() < 0.3:
        text = f"{draw.uniform(-9.0, 9.0):.17f}"
    return f"(-{text})" if draw.random() < 0.25 and text[0] != "-" else text


def leaf(draw: Random, scope: Scope) -> str:
    """Return a name or a literal."""
    if draw.random() < 0.2:
        return number(draw)
    return draw.choice((*scope.reals, *scope.memory))


def real(draw: Random, scope: Scope, depth: int = 2) -> str:
    """Return a real expression; divisors and roots are within their domains."""
    if depth == 0:
        return leaf(draw, scope)

    def part() -> str:
        return real(draw, scope, depth - 1)

    made = draw.choice(_FORMS)(part)
    if "?" in made:
        made = made.replace("?", truth(draw, scope, depth - 1))
    if "@" in made:
        made = made.replace("@", draw.choice(scope.tables) if scope.tables else f"abs({part()})")
    return made


Part = Callable[[], str]
_FORMS: tuple[Callable[[Part], str], ...] = (
    *(lambda p: f"{p()} + ({p()})", lambda p: f"{p()} - ({p()})", lambda p: f"({p()}) * ({p()})"),
    *(lambda p: f"({p()}) + ({p()}) + ({p()})", lambda p: f"({p()}) - (({p()}) - ({p()}))"),
    *(lambda p: f"({p()}) * ({p()}) / 3", lambda p: f"({p()}) * (({p()}) / 7)"),
    *(lambda p: f"({p()}) / (abs({p()}) + 1)", lambda p: f"({p()}) / 3 / (0.7 + abs({p()}))"),
    *(lambda p: f"({p()}) + ({p()}) * ({p()})", lambda p: f"-({p()})"),
    *(lambda p: f"(if ? then {p()} else {p()})",) * 2,
    *(lambda p: f"min({p()}, {p()})", lambda p: f"max({p()}, {p()})"),
    *(lambda p: f"min({p()}, 0)", lambda p: f"max(0, {p()})", lambda p: f"min(0, {p()})"),
    *(lambda p: f"clip({p()}, -2, {p()})", lambda p: f"clip({p()}, 0, 1.5)"),
    *(lambda p: f"sign({p()})", lambda p: f"floor({p()})", lambda p: f"abs({p()})"),
    *(lambda p: f"sqrt(abs({p()}))", lambda p: f"pow(max({p()}, 0), 1.5)"),
    *(lambda p: f"sin(({p()}) * 1 rad)", lambda p: f"cos(({p()}) * 1 rad)"),
    *(lambda p: f"tan(({p()}) * 1 rad)", lambda p: f"atan2({p()}, {p()}) / 1 rad"),
    *(lambda p: f"exp(-log(abs({p()}) + 1))", lambda p: f"exp(clip({p()}, -30, 4))"),
    *(lambda p: f"tanh({p()})", lambda p: "@", lambda p: "@"),
    *(lambda p: f"({p()})^2", lambda p: f"clip({p()}, -9, 9)^3", lambda p: f"(abs({p()}) + 1)^-2"),
)


def whole(draw: Random, scope: Scope) -> str:
    """Return a whole-number expression that fits 32 bits."""
    a, b = draw.choice(scope.wholes), draw.choice(scope.wholes)
    forms = (a, f"{a} + {b}", f"{a} - {b}", f"{a} * {b}", f"3 - 2 * {a}", f"-{a}")
    floors = [f"floor({draw.choice(scope.reals)})" for _ in range(3)]
    return draw.choice((*forms, *floors, f"{a} + 1", f"{a} + 1"))


def truth(draw: Random, scope: Scope, depth: int = 1) -> str:
    """Return a truth value in parentheses."""
    kind = draw.randrange(8) if depth > 0 else draw.choice((0, 0, 6, 7))

    def part() -> str:
        return truth(draw, scope, depth - 1)

    if kind in (1, 2):
        return f"({part()} {'and' if kind == 1 else 'or'} {part()})"
    if kind == 3:
        return f"(not {part()})"
    if kind == 6 and scope.truths:
        return f"({draw.choice(scope.truths)})"
    if kind == 7 and scope.wholes:
        relation = draw.choice((*RELATIONS, "==", "!="))
        return f"({draw.choice(scope.wholes)} {relation} {draw.randint(-2, 6)})"
    left, right = real(draw, scope, max(0, depth - 1)), leaf(draw, scope)
    return f"({left} {draw.choice(RELATIONS)} {right})"
