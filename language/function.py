"""Function: what the elementary functions and `in` take, and what they return (rule 20)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from language.aliases import FUNCTIONS
from language.call import WHERE, lookup_kind, memory_kind
from language.kind import Whole
from language.problem import nearest
from language.syntax import MEMORY, Application, Name, Tree, children, is_zero, whole_literal
from language.units import NUMBER, Dimension, root
from language.whole import range_of

if TYPE_CHECKING:
    from language.dimension import DimensionCheck
    from language.kind import Kind

ANGLE = Dimension(angle=1)
SAME = {"abs": 1, "min": 2, "max": 2, "clip": 3}
"""Functions whose arguments and value have one dimension, with their number of arguments."""
MOST_LAYERS = 4
"""Functions of whole numbers inside each other: each holds copies of what is inside."""
NUMBERS = {"exp": 1, "log": 1, "tanh": 1, "floor": 1, "sign": 1, "pow": 2}
ANGLES = {"sin": 1, "cos": 1, "tan": 1}
ARGUMENTS = {**SAME, **NUMBERS, **ANGLES, "sqrt": 1, "atan2": 2}
KNOWN = (*ARGUMENTS, *MEMORY, "lookup", "in", "der")


def function_kind(check: DimensionCheck, tree: Application) -> Kind | None:
    """Return what a function returns; None where a problem was reported."""
    name, arguments = tree.function, tree.arguments
    if name == "in":
        return _in(check, tree)
    if name in WHERE:
        return memory_kind(check, tree)
    if name == "lookup":
        return lookup_kind(check, tree)
    wanted = ARGUMENTS.get(name)
    if wanted is None:
        label = f"`{name}` is not a function that can be used here"
        usable = (*ARGUMENTS, *sorted(check.scope.memory), "lookup")
        hint = FUNCTIONS.get(name) or nearest(name, KNOWN) or f"there are `{' '.join(usable)}`"
        check.report("name", tree.span, label, hint)
        return None
    if label := miscounted(tree):
        check.report("arguments", tree.span, label)
        return None
    given = [check.kind(argument) for argument in arguments]
    if name in SAME and is_of_wholes(arguments, [isinstance(kind, Whole) for kind in given]):
        return _whole(check, tree, given)
    pairs = zip(given, arguments, strict=True)
    kinds = [check.number(kind, argument) for kind, argument in pairs]
    if any(kind is None for kind in kinds):
        return None
    return _elementary(check, tree, [kind for kind in kinds if kind is not None])


def miscounted(tree: Application) -> str:
    """Return what is wrong with the number of arguments of an elementary function."""
    wanted, given = ARGUMENTS.get(tree.function), len(tree.arguments)
    is_right = wanted is None or given == wanted
    return "" if is_right else f"`{tree.function}` takes {wanted} argument(s), not {given}"


def is_of_wholes(arguments: Sequence[Tree], wholes: Sequence[bool]) -> bool:
    """Tell whether some arguments are whole numbers, and all others literals like `2`."""
    pairs = zip(arguments, wholes, strict=True)
    return any(wholes) and all(whole or whole_literal(tree) is not None for tree, whole in pairs)


def _whole(check: DimensionCheck, tree: Application, given: Sequence[Kind | None]) -> Whole | None:
    """`min`, `max`, `abs` and `clip` of whole numbers are whole; what is inside is copied."""
    if _layers(tree) > MOST_LAYERS:
        label = f"`{tree.function}` of whole numbers is nested too deeply"
        check.report("expression", tree.span, label, "give what is inside an equation of its own")
        return None
    ranges = []
    for argument, kind in zip(tree.arguments, given, strict=True):
        value = whole_literal(argument) or 0
        ranges.append(kind if isinstance(kind, Whole) else Whole(value, value))
    return range_of(tree.function, ranges)


def _layers(tree: Tree) -> int:
    """Return how many functions of one kind stand inside each other."""
    inside = max((_layers(part) for part in children(tree)), default=0)
    return inside + (isinstance(tree, Application) and tree.function in SAME)


def _elementary(
    check: DimensionCheck, tree: Application, kinds: list[Dimension]
) -> Dimension | None:
    name, first = tree.function, kinds[0]
    if name in SAME or name == "atan2":
        base: Tree = tree.arguments[0]
        sum_so_far: Dimension = first
        for argument, kind in zip(tree.arguments[1:], kinds[1:], strict=True):
            joined = check.together(base, sum_so_far, argument, kind, tree.span, name)
            if joined is None:
                return None
            base, sum_so_far = (argument if is_zero(base) else base), joined
        return ANGLE if name == "atan2" else sum_so_far
    if name == "sqrt":
        result = root(first)
        if result is None:
            check.report("dimension", tree.span, f"`{first.shown}` has no square root")
        return result
    if name == "sign":
        return NUMBER
    want, angle = ("an angle", 1) if name in ANGLES else ("a number", 0)
    for argument, kind in zip(tree.arguments, kinds, strict=True):
        fine = kind.is_bare and kind.angle in (None, angle)
        if not fine and not is_zero(argument):
            label = f"`{name}` takes {want}, this is in `{kind.shown}`"
            check.report("dimension", tree.span, label)
    return NUMBER


def _in(check: DimensionCheck, tree: Application) -> Kind:
    name = tree.arguments[0]
    if not isinstance(name, Name) or name.path not in check.scope.modes:
        shown = name.path if isinstance(name, Name) else "..."
        label = f"`in({shown})` does not name a mode of the run of this mode or of a region"
        hint = nearest(shown, check.scope.modes)
        check.report("name", tree.span, label, hint)
    return "truth"
