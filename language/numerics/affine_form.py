"""Affine: the terms of a mode's rates that are linear in the states with constant coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from language.ir.ops import Assign, Binary, Block, Call, Expr, Ref, Select, Switch, Unary, Value
from language.ir.traversal import expr_names
from language.numerics.evaluate import Scalar, apply_function, divide, evaluate
from language.numerics.matrix import Matrix


@dataclass(frozen=True)
class AffineForm:
    """`sum(slopes) + constant`; the constant is None where there is anything else besides."""

    coefficients: Mapping[str, float] = field(default_factory=dict)
    constant: float | None = None

    @property
    def is_constant(self) -> bool:
        """Tell whether there is nothing but a known constant."""
        return not self.coefficients and self.constant is not None


NOT_AFFINE = AffineForm()
"""Something that is not affine, or not known before the program runs."""


def jacobian(
    rates: Block, states: tuple[str, ...], constants: Mapping[str, Scalar | tuple[float, ...]]
) -> Matrix:
    """Return A (n, n) of the terms of `work.rate_<state>` linear in `work.at_<state>`.

    Entry i j in unit_i/(unit_j s). What is not linear, or has no constant coefficient, is left out.
    """
    return coefficient_matrix(affine_forms(rates, states, constants), states)


def coefficient_matrix(forms: Mapping[str, AffineForm], states: tuple[str, ...]) -> Matrix:
    """Return A (n, n) of rates whose affine parts are known."""
    rows = [forms[f"work.rate_{name}"].coefficients for name in states]
    return tuple(tuple(row.get(column, 0.0) for column in states) for row in rows)


def affine_forms(
    rates: Block, states: tuple[str, ...], constants: Mapping[str, Scalar | tuple[float, ...]]
) -> dict[str, AffineForm]:
    """Return what each name of a block of rates is in the states `work.at_<state>`."""
    forms: dict[str, AffineForm] = {}
    for name, value in constants.items():
        forms[name] = NOT_AFFINE if isinstance(value, tuple) else AffineForm({}, float(value))
    forms.update({f"work.at_{name}": AffineForm({name: 1.0}, 0.0) for name in states})
    for op in rates:
        if isinstance(op, Switch):  # it depends on a region's mode: not known before
            forms.update({target: NOT_AFFINE for target in _targets(op)})
            continue
        assert isinstance(op, Assign)
        forms[op.target] = to_affine_form(op.value, forms)
    return forms


def _targets(choice: Switch) -> list[str]:
    return [op.target for _, block in choice.cases for op in block if isinstance(op, Assign)]


def to_affine_form(expr: Expr, forms: Mapping[str, AffineForm]) -> AffineForm:
    """Return what an expression is in the states; `OTHER` where it is not linear in them."""
    match expr:
        case Ref(name):
            return forms.get(name, NOT_AFFINE)
        case Value(bool()):
            return NOT_AFFINE
        case Value(value):
            return AffineForm({}, float(value))
        case Unary("-", operand):
            return _scale(to_affine_form(operand, forms), -1.0)
        case Binary("+", left, right):
            return _sum(to_affine_form(left, forms), to_affine_form(right, forms))
        case Binary("-", left, right):
            return _sum(to_affine_form(left, forms), _scale(to_affine_form(right, forms), -1.0))
        case Binary("*", left, right):
            return _product(to_affine_form(left, forms), to_affine_form(right, forms))
        case Binary("/", left, right):
            return _quotient(to_affine_form(left, forms), to_affine_form(right, forms))
        case Call(function, arguments):
            parts = [to_affine_form(argument, forms) for argument in arguments]
            if all(part.is_constant for part in parts):
                values: list[Scalar] = [part.constant or 0.0 for part in parts]
                return AffineForm({}, float(apply_function(function, values)))
            return NOT_AFFINE
        case Select():
            return _fold_constant(expr, forms)
        case _:
            return NOT_AFFINE


def _fold_constant(expr: Expr, forms: Mapping[str, AffineForm]) -> AffineForm:
    values: dict[str, Scalar] = {}
    for name in expr_names(expr):
        part = forms.get(name, NOT_AFFINE)
        if part.is_constant and part.constant is not None:
            values[name] = part.constant
    try:
        return AffineForm({}, float(evaluate(expr, values)))
    except (KeyError, TypeError):
        return NOT_AFFINE


def _sum(a: AffineForm, b: AffineForm) -> AffineForm:
    slopes = dict(a.coefficients)
    for name, slope in b.coefficients.items():
        slopes[name] = slopes.get(name, 0.0) + slope
    unknown = a.constant is None or b.constant is None
    return AffineForm(slopes, None if unknown else (a.constant or 0.0) + (b.constant or 0.0))


def _scale(a: AffineForm, factor: float) -> AffineForm:
    slopes = {name: slope * factor for name, slope in a.coefficients.items()}
    return AffineForm(slopes, None if a.constant is None else a.constant * factor)


def _product(a: AffineForm, b: AffineForm) -> AffineForm:
    if a.is_constant and a.constant is not None:
        return _scale(b, a.constant)
    if b.is_constant and b.constant is not None:
        return _scale(a, b.constant)
    return NOT_AFFINE


def _quotient(a: AffineForm, b: AffineForm) -> AffineForm:
    if not b.is_constant or b.constant is None:
        return NOT_AFFINE
    slopes = {name: divide(slope, b.constant) for name, slope in a.coefficients.items()}
    return AffineForm(slopes, None if a.constant is None else divide(a.constant, b.constant))
