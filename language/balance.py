"""Balance: the coefficient of the one der(x) on the left side of `coefficient * der(x) = ...`."""

from __future__ import annotations

from language.problem import Problems, SpecError
from language.syntax import Application, Arithmetic, Name, Tree, walk


def coefficient_of(left: Tree, state: str) -> Tree | SpecError | None:
    """Return the factor of der(state) on the left side of a balance, None where it is 1."""
    if isinstance(left, Application) and left.function == "der":
        return None if _is_derivative(left, state) else _bad_balance(left, state)
    if isinstance(left, Arithmetic) and left.operator == "*":
        if isinstance(left.right, Application) and _is_derivative(left.right, state):
            return left.left if not _has_derivative(left.left) else _bad_balance(left, state)
        if isinstance(left.left, Application) and _is_derivative(left.left, state):
            return left.right if not _has_derivative(left.right) else _bad_balance(left, state)
    return _bad_balance(left, state)


def _is_derivative(tree: Application, state: str) -> bool:
    match tree:
        case Application("der", (Name(path, _),), _):
            return path == state
        case _:
            return False


def _has_derivative(tree: Tree) -> bool:
    return any(isinstance(part, Application) and part.function == "der" for part in walk(tree))


def _bad_balance(left: Tree, state: str) -> SpecError:
    problems = Problems()
    label = f"the left side is `coefficient * der({state})` with der once"
    problems.error("balance", left.span, label)
    return SpecError(problems.found)
