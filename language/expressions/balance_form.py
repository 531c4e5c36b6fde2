"""Balance form: the coefficient of der(x) on the left side of `coefficient * der(x) = ...`."""

from __future__ import annotations

from language.expressions.syntax_tree import Arithmetic, FunctionCall, Name, SyntaxTree, walk
from language.text.diagnostic import Problem, SpecError


def coefficient_of(left: SyntaxTree, state: str) -> SyntaxTree | SpecError | None:
    """Return the factor of der(state) on the left side of a balance; None if there is no factor.

    `der(x)` gives None, `c * der(x)` and `der(x) * c` give c. A left side of another form, of
    another state or with a further der gives a SpecError of kind "balance", which is returned, not
    raised.
    """
    if isinstance(left, FunctionCall) and left.function == "der":
        return None if _is_derivative(left, state) else _balance_error(left, state)
    if isinstance(left, Arithmetic) and left.operator == "*":
        if isinstance(left.right, FunctionCall) and _is_derivative(left.right, state):
            return left.left if not _has_derivative(left.left) else _balance_error(left, state)
        if isinstance(left.left, FunctionCall) and _is_derivative(left.left, state):
            return left.right if not _has_derivative(left.right) else _balance_error(left, state)
    return _balance_error(left, state)


def _is_derivative(tree: FunctionCall, state: str) -> bool:
    """Return whether a call is `der(state)`."""
    match tree:
        case FunctionCall("der", (Name(path, _),), _):
            return path == state
        case _:
            return False


def _has_derivative(tree: SyntaxTree) -> bool:
    """Return whether an expression contains a call of der."""
    return any(isinstance(part, FunctionCall) and part.function == "der" for part in walk(tree))


def _balance_error(left: SyntaxTree, state: str) -> SpecError:
    """Return the error for a left side of another form."""
    label = f"the left side is `coefficient * der({state})` with der once"
    return SpecError([Problem("balance", left.span, label)])
