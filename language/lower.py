"""Lower: expressions and formulas of a model to expressions and operations of a Program."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from language.balance import coefficient_of
from language.declaration import Formula
from language.function import SAME, is_of_wholes
from language.limit import is_limited
from language.model import Automaton, Balance, Mode, Region
from language.once import once
from language.operation import (
    Assign,
    Binary,
    Block,
    Call,
    Choose,
    Compare,
    Expr,
    Item,
    Op,
    Ref,
    Select,
    Unary,
    Value,
    divide,
    multiply,
    real,
)
from language.order import equation_order
from language.problem import SpecError
from language.region import closure, region_of_equation, sources
from language.syntax import (
    MEMORY,
    Application,
    Arithmetic,
    Broken,
    Choice,
    Logic,
    Name,
    Negative,
    Not,
    Number,
    Power,
    Relation,
    Tree,
    Truth,
    memory_key,
    names,
    whole_literal,
)
from language.whole import of_wholes

WHOLE_TYPES = ("int", "enum")
Names = Mapping[str, Expr]
"""What each name of the model is at one place; `in(x.y)` is looked up as `in x.y`,
what functions with memory are under their `memory_key`."""


def expression(tree: Tree, known: Names) -> Expr:
    """Return the Program's expression of a tree: same order of operations, nothing simplified."""
    return _typed(tree, known)[0]


def _typed(tree: Tree, known: Names) -> tuple[Expr, bool]:
    """Return the expression of a tree, and whether its value is a whole number."""
    match tree:
        case Name(path, _):
            return known[path], is_whole(known[path])
        case Number(value, _, _):
            return real(value), False
        case Arithmetic("/", left, right, _):
            return Binary("/", _real(left, known), _real(right, known)), False
        case Arithmetic(operator, left, right, _):
            first, second, whole = _matched(left, right, known)
            return Binary(operator, first, second), whole  # type: ignore[arg-type]
        case Application():
            made = _application(tree, known)
            return made, is_whole(made)
        case Truth(value, _):
            return Value(value), False
        case Negative(operand, _):
            inner, whole = _typed(operand, known)
            return Unary("-", inner), whole
        case Not(operand, _):
            return Unary("not", expression(operand, known)), False
        case Logic(operator, left, right, _):
            sides = expression(left, known), expression(right, known)
            return Binary(operator, *sides), False  # type: ignore[arg-type]
        case Relation(operator, left, right, _):
            first, second, _ = _matched(left, right, known)
            return Compare(operator, first, second), False  # type: ignore[arg-type]
        case Power(base, exponent, _):
            return _power(_real(base, known), exponent), False
        case Choice(condition, then, other, _):
            first, second, whole = _matched(then, other, known)
            return Select(expression(condition, known), first, second), whole
        case Broken():
            raise TypeError(f"{tree.span}: an expression with a problem is not lowered")


def _application(tree: Application, known: Names) -> Expr:
    """Return a call; what reads the automaton's mode, memory or tables is known by its key."""
    match tree:
        case Application("in", (Name(path, _),), _):
            return known[f"in {path}"]
        case Application("lookup", (Name(path, _), *arguments), _):
            axes = [known[f"{path} axis {k}"] for k in range(1, len(arguments) + 1)]
            sizes = [known[f"{path} size {k}"] for k in range(1, len(arguments) + 1)]
            read = [_real(part, known) for part in arguments]
            function = "lookup" if len(arguments) == 1 else "lookup2"
            return Call(function, (*axes, *sizes, known[path], *read))
        case Application(function, _, _) if function in MEMORY:
            return known[memory_key(tree)]
        case Application(function, arguments, _):
            wholes = _wholes_of(arguments, known) if function in SAME else None
            if wholes:
                return of_wholes(function, wholes)
            return Call(function, tuple(_real(part, known) for part in arguments))


def _wholes_of(arguments: Sequence[Tree], known: Names) -> list[Expr] | None:
    """Return arguments as whole numbers, where they are and literals beside them; else None."""
    made = [_typed(argument, known) for argument in arguments]
    if not is_of_wholes(arguments, [whole for _, whole in made]):
        return None
    pairs = zip(arguments, made, strict=True)
    return [expr if whole else Value(whole_literal(tree) or 0) for tree, (expr, whole) in pairs]


def assigned(tree: Tree, known: Names, whole: bool) -> Expr:
    """Return the expression of a tree for a target that is whole, or not."""
    number = whole_literal(tree)
    if whole and number is not None:
        return Value(number)
    value = expression(tree, known)
    if whole:
        return value if is_whole(value) else Call("whole", (value,))
    return as_real(value)


def as_real(expr: Expr) -> Expr:
    """Return an expression that is whole as a real."""
    return Call("real", (expr,)) if is_whole(expr) else expr


def is_whole(expr: Expr) -> bool:
    """Tell whether the value of an expression is a whole number (an enumeration's too)."""
    match expr:
        case Ref(_, whole) | Item(_, _, whole):
            return whole
        case Value(value):
            return type(value) is int
        case Unary("-", operand):
            return is_whole(operand)
        case Binary(operator, left, _):
            return operator in "+-*" and is_whole(left)
        case Select(_, then, _):
            return is_whole(then)
        case Call(function, _):
            return function == "whole"
        case _:
            return False


def _real(tree: Tree, known: Names) -> Expr:
    value, whole = _typed(tree, known)
    return Call("real", (value,)) if whole else value


def _matched(left: Tree, right: Tree, known: Names) -> tuple[Expr, Expr, bool]:
    """Two operands of one type and whether they are whole.

    A literal like `2` beside a whole number is one, else they are reals.
    """
    (first, is_first), (second, is_second) = _typed(left, known), _typed(right, known)
    if is_first == is_second:
        return first, second, is_first
    if is_first and (number := whole_literal(right)) is not None:
        return first, Value(number), True
    if is_second and (number := whole_literal(left)) is not None:
        return Value(number), second, True
    return as_real(first), as_real(second), False


def _power(base: Expr, exponent: int) -> Expr:
    """x^n by multiplications from the left; a negative n divides 1 by it."""
    if exponent == 0:
        return real(1.0)
    result = base
    for _ in range(abs(exponent) - 1):
        result = multiply(result, base)
    return divide(real(1.0), result) if exponent < 0 else result


def rate(balance: Balance, known: Names) -> Expr:
    """Return der(state): the right side, divided once by the coefficient."""
    factor = coefficient_of(balance.left, balance.state)
    if isinstance(factor, SpecError):
        raise factor
    right = _real(balance.right, known)
    return right if factor is None else divide(right, _real(factor, known))


def equations(
    mode: Mode, known: dict[str, Expr], group: str, prefix: str, wanted: Iterable[str] | None = None
) -> list[Op]:
    """Return the assignments of a mode's equations in order, and make them known.

    `wanted` limits them to those that these names need, directly or through others.
    """
    order = equation_order(mode)
    needed = set(order) if wanted is None else closure(mode, wanted)
    ops: list[Op] = []
    for name in order:
        if name in needed:
            ops.append(_equation(mode, name, known, group, prefix))
            whole = any(formula.whole for formula in sources(mode)[name])
            known[name] = Ref(f"{group}{name}", whole)
    return ops


def _equation(mode: Mode, name: str, known: Names, group: str, prefix: str) -> Op:
    """Return what sets an equation: one formula, or that of the active mode of a region beside."""

    def set_to(formula: Formula) -> Assign:
        value = assigned(formula.tree, known, formula.whole)
        return Assign(f"{group}{name}", value, prefix + formula.key)

    region = region_of_equation(mode, name)
    if region is None:
        return set_to(mode.equations[name])
    return choice(
        region,
        known,
        {other.name: (set_to(other.equations[name]),) for other in region.modes.values()},
    )


def choice(region: Region, known: Names, blocks: Mapping[str, Block]) -> Choose:
    """Return the choice of a block by the mode that a region is in."""
    selector = known[f"mode {region.name}"]
    assert isinstance(selector, Ref)
    cases = tuple((region.modes[name].number, block) for name, block in blocks.items())
    return Choose(selector.name, cases)


def equation_names(automaton: Automaton, group: str) -> dict[str, Expr]:
    """Return the equations of all modes as what a Program reads."""
    return {name: Ref(f"{group}{name}", whole) for name, whole in _wholes(automaton).items()}


@once
def _wholes(automaton: Automaton) -> dict[str, bool]:
    """Return, for each equation that any mode has, whether it is a whole number."""
    modes = automaton.all_modes
    return {name: formula.whole for mode in modes for name, formula in mode.equations.items()}


def variable_names(automaton: Automaton, inputs: str) -> dict[str, Expr]:
    """Return inputs (of a group), states and discrete variables as what a Program reads."""
    found: dict[str, Expr] = {}
    for name, thing in automaton.inputs.items():
        group = "latched" if inputs == "input" and is_limited(automaton, thing) else inputs
        found[name] = Ref(f"{group}.{name}", thing.type in WHOLE_TYPES)
    found.update({name: Ref(f"state.{name}") for name in automaton.states})
    for name, variable in automaton.discrete.items():
        found[name] = Ref(f"discrete.{name}", variable.type in WHOLE_TYPES)
    return found


def reads_of(trees: Iterable[Tree]) -> list[str]:
    """Return the names read in some trees."""
    return [read.path for tree in trees for read in names(tree)]
