"""Affine: the terms of a mode's rates that are linear in the states with constant coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from language.evaluate import Scalar, apply, divide, evaluate
from language.matrix import Matrix
from language.operation import (
    Assign,
    Binary,
    Block,
    Call,
    Choose,
    Expr,
    Ref,
    Select,
    Unary,
    Value,
)
from language.traversal import expr_names


@dataclass(frozen=True)
class Affine:
    """`sum(slopes) + constant`; the constant is None where there is anything else besides."""

    slopes: Mapping[str, float] = field(default_factory=dict)
    constant: float | None = None

    @property
    def is_constant(self) -> bool:
        """Tell whether there is nothing but a known constant."""
        return not self.slopes and self.constant is not None


OTHER = Affine()
"""Something that is not affine, or not known before the program runs."""


def jacobian(
    rates: Block, states: tuple[str, ...], constants: Mapping[str, Scalar | tuple[float, ...]]
) -> Matrix:
    """Return A (n, n) of the terms of `work.rate_<state>` linear in `work.at_<state>`.

    Entry i j in unit_i/(unit_j s). What is not linear, or has no constant coefficient, is left out.
    """
    return matrix_of(affine_parts(rates, states, constants), states)


def matrix_of(parts: Mapping[str, Affine], states: tuple[str, ...]) -> Matrix:
    """Return A (n, n) of rates whose affine parts are known."""
    rows = [parts[f"work.rate_{name}"].slopes for name in states]
    return tuple(tuple(row.get(column, 0.0) for column in states) for row in rows)


def affine_parts(
    rates: Block, states: tuple[str, ...], constants: Mapping[str, Scalar | tuple[float, ...]]
) -> dict[str, Affine]:
    """Return what each name of a block of rates is in the states `work.at_<state>`."""
    known: dict[str, Affine] = {}
    for name, value in constants.items():
        known[name] = OTHER if isinstance(value, tuple) else Affine({}, float(value))
    known.update({f"work.at_{name}": Affine({name: 1.0}, 0.0) for name in states})
    for op in rates:
        if isinstance(op, Choose):  # it depends on a region's mode: not known before
            known.update({target: OTHER for target in _targets(op)})
            continue
        assert isinstance(op, Assign)
        known[op.target] = affine(op.value, known)
    return known


def _targets(choice: Choose) -> list[str]:
    return [op.target for _, block in choice.cases for op in block if isinstance(op, Assign)]


def affine(expr: Expr, known: Mapping[str, Affine]) -> Affine:
    """Return what an expression is in the states; `OTHER` where it is not linear in them."""
    match expr:
        case Ref(name):
            return known.get(name, OTHER)
        case Value(bool()):
            return OTHER
        case Value(value):
            return Affine({}, float(value))
        case Unary("-", operand):
            return _scaled(affine(operand, known), -1.0)
        case Binary("+", left, right):
            return _sum(affine(left, known), affine(right, known))
        case Binary("-", left, right):
            return _sum(affine(left, known), _scaled(affine(right, known), -1.0))
        case Binary("*", left, right):
            return _product(affine(left, known), affine(right, known))
        case Binary("/", left, right):
            return _quotient(affine(left, known), affine(right, known))
        case Call(function, arguments):
            parts = [affine(argument, known) for argument in arguments]
            if all(part.is_constant for part in parts):
                values: list[Scalar] = [part.constant or 0.0 for part in parts]
                return Affine({}, float(apply(function, values)))
            return OTHER
        case Select():
            return _constant(expr, known)
        case _:
            return OTHER


def _constant(expr: Expr, known: Mapping[str, Affine]) -> Affine:
    values: dict[str, Scalar] = {}
    for name in expr_names(expr):
        part = known.get(name, OTHER)
        if part.is_constant and part.constant is not None:
            values[name] = part.constant
    try:
        return Affine({}, float(evaluate(expr, values)))
    except (KeyError, TypeError):
        return OTHER


def _sum(a: Affine, b: Affine) -> Affine:
    slopes = dict(a.slopes)
    for name, slope in b.slopes.items():
        slopes[name] = slopes.get(name, 0.0) + slope
    unknown = a.constant is None or b.constant is None
    return Affine(slopes, None if unknown else (a.constant or 0.0) + (b.constant or 0.0))


def _scaled(a: Affine, factor: float) -> Affine:
    slopes = {name: slope * factor for name, slope in a.slopes.items()}
    return Affine(slopes, None if a.constant is None else a.constant * factor)


def _product(a: Affine, b: Affine) -> Affine:
    if a.is_constant and a.constant is not None:
        return _scaled(b, a.constant)
    if b.is_constant and b.constant is not None:
        return _scaled(a, b.constant)
    return OTHER


def _quotient(a: Affine, b: Affine) -> Affine:
    if not b.is_constant or b.constant is None:
        return OTHER
    slopes = {name: divide(slope, b.constant) for name, slope in a.slopes.items()}
    return Affine(slopes, None if a.constant is None else divide(a.constant, b.constant))
