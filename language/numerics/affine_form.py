"""Affine forms: the parts of rates that are linear in the states with constant coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from language.ir.ops import Assign, Binary, Block, Call, Expr, Ref, Select, Switch, Unary, Value
from language.ir.traversal import expr_names
from language.numerics.evaluate import Scalar, apply_function, divide, evaluate
from language.numerics.matrix import Matrix


@dataclass(frozen=True)
class AffineForm:
    """The form `sum(coefficients[x] * x) + constant` of a value in the states x.

    `constant` is None if the value has further terms that are not affine or not known at check
    time.
    """

    coefficients: Mapping[str, float] = field(default_factory=dict)
    constant: float | None = None

    @property
    def is_constant(self) -> bool:
        """Return whether the form has a known constant and no coefficients.

        A coefficient of value 0 counts.
        """
        return not self.coefficients and self.constant is not None


NOT_AFFINE = AffineForm()
"""The form of a value that is not affine in the states, or not known at check time."""


def jacobian(
    rates: Block, states: tuple[str, ...], constants: Mapping[str, Scalar | tuple[float, ...]]
) -> Matrix:
    """Return the matrix A (n, n) of the linear part of `work.rate_<state>` in `work.at_<state>`.

    `rates` is a block of assignments and switches; rows and columns are in the order of `states`.
    Entry i, j has the unit unit_i/(unit_j s). Terms that are not linear, or whose coefficient is
    not constant, are left out. Raises KeyError if a rate is not assigned.
    """
    return coefficient_matrix(affine_forms(rates, states, constants), states)


def coefficient_matrix(forms: Mapping[str, AffineForm], states: tuple[str, ...]) -> Matrix:
    """Return the matrix A (n, n) of the coefficients of all rates; a missing coefficient is 0.

    Row i is that of the form `work.rate_<state i>`, in the order of `states`. Raises KeyError if a
    form is missing.
    """
    rows = [forms[f"work.rate_{name}"].coefficients for name in states]
    return tuple(tuple(row.get(column, 0.0) for column in states) for row in rows)


def affine_forms(
    rates: Block, states: tuple[str, ...], constants: Mapping[str, Scalar | tuple[float, ...]]
) -> dict[str, AffineForm]:
    """Return the affine form in the states `work.at_<state>` of each name that a block assigns.

    The result also has the constants and the states. Names assigned inside a Switch are NOT_AFFINE,
    because the mode of a region is not known at check time; so are constant arrays. Raises
    AssertionError for another operation than an assignment or a switch.
    """
    forms: dict[str, AffineForm] = {}
    for name, value in constants.items():
        forms[name] = NOT_AFFINE if isinstance(value, tuple) else AffineForm({}, float(value))
    forms.update({f"work.at_{name}": AffineForm({name: 1.0}, 0.0) for name in states})
    for op in rates:
        if isinstance(op, Switch):  # the mode of a region is not known at check time
            forms.update({target: NOT_AFFINE for target in _targets(op)})
            continue
        assert isinstance(op, Assign)
        forms[op.target] = to_affine_form(op.value, forms)
    return forms


def _targets(choice: Switch) -> list[str]:
    """Return the variables that the cases of a switch assign."""
    return [op.target for _, block in choice.cases for op in block if isinstance(op, Assign)]


def to_affine_form(expr: Expr, forms: Mapping[str, AffineForm]) -> AffineForm:
    """Return the affine form of an expression; NOT_AFFINE if it is not linear in the states.

    `forms` gives the forms of names; an unknown name is NOT_AFFINE. A sum with a term that is not
    affine keeps the coefficients of its other terms and has no constant. Calls and choices are
    constant if all that they read is, else NOT_AFFINE, even if both alternatives are linear; so are
    relations and truth values.
    """
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
    """Return the constant form of an expression; NOT_AFFINE if a name is not a known constant."""
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
    """Return a + b; the constant is None if one of both is."""
    slopes = dict(a.coefficients)
    for name, slope in b.coefficients.items():
        slopes[name] = slopes.get(name, 0.0) + slope
    unknown = a.constant is None or b.constant is None
    return AffineForm(slopes, None if unknown else (a.constant or 0.0) + (b.constant or 0.0))


def _scale(a: AffineForm, factor: float) -> AffineForm:
    """Return a times a factor."""
    slopes = {name: slope * factor for name, slope in a.coefficients.items()}
    return AffineForm(slopes, None if a.constant is None else a.constant * factor)


def _product(a: AffineForm, b: AffineForm) -> AffineForm:
    """Return a b if one of both is a known constant, else NOT_AFFINE."""
    if a.is_constant and a.constant is not None:
        return _scale(b, a.constant)
    if b.is_constant and b.constant is not None:
        return _scale(a, b.constant)
    return NOT_AFFINE


def _quotient(a: AffineForm, b: AffineForm) -> AffineForm:
    """Return a / b if b is a known constant, else NOT_AFFINE."""
    if not b.is_constant or b.constant is None:
        return NOT_AFFINE
    slopes = {name: divide(slope, b.constant) for name, slope in a.coefficients.items()}
    return AffineForm(slopes, None if a.constant is None else divide(a.constant, b.constant))
