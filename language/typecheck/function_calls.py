"""Function calls: argument and result types of the elementary functions and of `in` (rule 20)."""

from __future__ import annotations

from collections.abc import Sequence

from language.expressions.migration_hints import FUNCTION_HINTS
from language.expressions.syntax_tree import (
    MEMORY_FUNCTIONS,
    FunctionCall,
    Name,
    SyntaxTree,
    children,
    integer_literal,
    is_bare_zero,
)
from language.expressions.units import PURE_NUMBER, Dimension, dimension_sqrt
from language.text.diagnostic import suggest_name
from language.typecheck.checker_protocol import TypingContext
from language.typecheck.integer_functions import integer_call_range
from language.typecheck.stateful_functions import ALLOWED_PLACES, infer_lookup, infer_memory_call
from language.typecheck.types import ExprType, IntType

ANGLE = Dimension(angle=1)
SAME_UNIT_FUNCTIONS = {"abs": 1, "min": 2, "max": 2, "clip": 3}
"""Functions whose arguments and result have one dimension, with their number of arguments."""
MAX_NESTING = 4
"""Deepest nesting of functions of whole numbers; each level copies its arguments."""
NUMBER_FUNCTIONS = {"exp": 1, "log": 1, "tanh": 1, "floor": 1, "sign": 1, "pow": 2}
ANGLE_FUNCTIONS = {"sin": 1, "cos": 1, "tan": 1}
ARGUMENT_COUNTS = {
    **SAME_UNIT_FUNCTIONS,
    **NUMBER_FUNCTIONS,
    **ANGLE_FUNCTIONS,
    "sqrt": 1,
    "atan2": 2,
}
FUNCTION_NAMES = (*ARGUMENT_COUNTS, *MEMORY_FUNCTIONS, "lookup", "in", "der")


def infer_function_call(checker: TypingContext, tree: FunctionCall) -> ExprType | None:
    """Return the type of a function call; None if a problem leaves it open.

    `in` is a truth value, also after a problem; functions with memory and `lookup` have the types
    of `infer_memory_call` and `infer_lookup`. `abs`, `min`, `max` and `clip` of whole numbers give
    a whole number, of quantities their common dimension. `sqrt` halves the dimension, `atan2` gives
    an angle, and the others a pure number, also after a problem of dimension. Reported are an
    unknown function, a wrong number of arguments, and arguments of a wrong type or dimension.
    """
    name, arguments = tree.function, tree.arguments
    if name == "in":
        return _infer_in(checker, tree)
    if name in ALLOWED_PLACES:
        return infer_memory_call(checker, tree)
    if name == "lookup":
        return infer_lookup(checker, tree)
    expected = ARGUMENT_COUNTS.get(name)
    if expected is None:
        label = f"`{name}` is not a function that can be used here"
        usable = (*ARGUMENT_COUNTS, *sorted(checker.environment.memory_functions), "lookup")
        hint = (
            FUNCTION_HINTS.get(name)
            or suggest_name(name, FUNCTION_NAMES)
            or f"there are `{' '.join(usable)}`"
        )
        checker.report("name", tree.span, label, hint)
        return None
    if label := argument_count_error(tree):
        checker.report("arguments", tree.span, label)
        return None
    argument_types = [checker.infer_type(argument) for argument in arguments]
    if name in SAME_UNIT_FUNCTIONS and is_integer_call(
        arguments, [isinstance(kind, IntType) for kind in argument_types]
    ):
        return _infer_integer_call(checker, tree, argument_types)
    pairs = zip(argument_types, arguments, strict=True)
    kinds = [checker.require_real(kind, argument) for kind, argument in pairs]
    if any(kind is None for kind in kinds):
        return None
    return _infer_elementary(checker, tree, [kind for kind in kinds if kind is not None])


def argument_count_error(tree: FunctionCall) -> str:
    """Return a message if an elementary function or `in` has a wrong number of arguments.

    The message is like "`sin` takes 1 argument(s), not 2". It is empty if the number is correct and
    for every other function.
    """
    expected, actual = {**ARGUMENT_COUNTS, "in": 1}.get(tree.function), len(tree.arguments)
    is_correct = expected is None or actual == expected
    return "" if is_correct else f"`{tree.function}` takes {expected} argument(s), not {actual}"


def alternatives_hint(function: str) -> str:
    """Return the help text for a truth function of one name that has several, like `in(a, b)`."""
    return f"write `{function}(a) or {function}(b)` if one of two is meant"


def is_integer_call(arguments: Sequence[SyntaxTree], are_integers: Sequence[bool]) -> bool:
    """Return whether an argument is a whole number and all others are or are literals like `2`.

    `are_integers` says of each argument whether its type is a whole number. Literals alone give
    false.
    """
    pairs = zip(arguments, are_integers, strict=True)
    return any(are_integers) and all(
        whole or integer_literal(tree) is not None for tree, whole in pairs
    )


def _infer_integer_call(
    checker: TypingContext, tree: FunctionCall, argument_types: Sequence[ExprType | None]
) -> IntType | None:
    """Return the range of `min`, `max`, `abs` or `clip` of whole numbers.

    Report calls that are nested too deeply and return None.
    """
    if _nesting_depth(tree) > MAX_NESTING:
        label = f"`{tree.function}` of whole numbers is nested too deeply"
        checker.report("expression", tree.span, label, "write an equation for the inner expression")
        return None
    ranges = []
    for argument, kind in zip(tree.arguments, argument_types, strict=True):
        value = integer_literal(argument) or 0
        ranges.append(kind if isinstance(kind, IntType) else IntType(value, value))
    return integer_call_range(tree.function, ranges)


def _nesting_depth(tree: SyntaxTree) -> int:
    """Return the largest number of SAME_UNIT_FUNCTIONS that are nested in a tree."""
    inside = max((_nesting_depth(part) for part in children(tree)), default=0)
    return inside + (isinstance(tree, FunctionCall) and tree.function in SAME_UNIT_FUNCTIONS)


def _infer_elementary(
    checker: TypingContext, tree: FunctionCall, dimensions: list[Dimension]
) -> Dimension | None:
    """Return the dimension of an elementary function of reals; None if its arguments do not fit."""
    name, first = tree.function, dimensions[0]
    if name in SAME_UNIT_FUNCTIONS or name == "atan2":
        base: SyntaxTree = tree.arguments[0]
        sum_so_far: Dimension = first
        for argument, kind in zip(tree.arguments[1:], dimensions[1:], strict=True):
            joined = checker.unify_dimensions(base, sum_so_far, argument, kind, tree.span, name)
            if joined is None:
                return None
            base, sum_so_far = (argument if is_bare_zero(base) else base), joined
        return ANGLE if name == "atan2" else sum_so_far
    if name == "sqrt":
        result = dimension_sqrt(first)
        if result is None:
            checker.report("dimension", tree.span, f"`{first.display_name}` has no square root")
        return result
    if name == "sign":
        return PURE_NUMBER
    want, angle = ("an angle", 1) if name in ANGLE_FUNCTIONS else ("a number", 0)
    for argument, kind in zip(tree.arguments, dimensions, strict=True):
        fine = kind.is_dimensionless and kind.angle in (None, angle)
        if not fine and not is_bare_zero(argument):
            label = f"`{name}` takes {want}, this is in `{kind.display_name}`"
            checker.report("dimension", tree.span, label)
    return PURE_NUMBER


def _infer_in(checker: TypingContext, tree: FunctionCall) -> ExprType:
    """Return the type of `in(mode)`.

    Report more than one argument, and an argument that is not a mode of a run or a region.
    """
    name = tree.arguments[0]
    if label := argument_count_error(tree):
        checker.report("arguments", tree.span, label, alternatives_hint("in"))
    elif not isinstance(name, Name) or name.path not in checker.environment.modes:
        shown = name.path if isinstance(name, Name) else "..."
        label = f"`in({shown})` does not name a mode of the run of this mode or of a region"
        hint = suggest_name(shown, checker.environment.modes)
        checker.report("name", tree.span, label, hint)
    return "truth"
