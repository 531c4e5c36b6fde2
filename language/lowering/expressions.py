"""Lowering of expressions, equations and balances to expressions and operations of a Program.

The order of operations of the source is kept and nothing is simplified (rule 17b).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from language.expressions.balance_form import coefficient_of
from language.expressions.syntax_tree import (
    MEMORY_FUNCTIONS,
    Arithmetic,
    BoolLiteral,
    Conditional,
    ErrorNode,
    FunctionCall,
    Logic,
    Name,
    Negation,
    Not,
    NumberLiteral,
    Power,
    Relation,
    SyntaxTree,
    integer_literal,
    memory_key,
    names,
)
from language.ir.analysis_cache import cache_on_owner
from language.ir.expression_type import is_whole
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Call,
    Compare,
    Expr,
    Op,
    Ref,
    Select,
    Switch,
    Unary,
    Value,
    divide,
    multiply,
    real,
)
from language.lowering.range_saturation import has_saturation
from language.model.automaton import Automaton, Balance, Mode, Region
from language.model.declaration import Formula
from language.model.evaluation_order import equation_order
from language.model.region_queries import equation_closure, equation_formulas, region_of_equation
from language.text.diagnostic import SpecError
from language.typecheck.function_calls import SAME_UNIT_FUNCTIONS, is_integer_call
from language.typecheck.integer_functions import lower_integer_call

WHOLE_TYPES = ("int", "enum")
NameBindings = Mapping[str, Expr]
"""The Program's expression of each name of the model at one place of the Program.

`in(x.y)` has the key `in x.y`; a call of a function with memory has its `memory_key`.
"""


def lower_expression(tree: SyntaxTree, known: NameBindings) -> Expr:
    """Return the Program's expression of a syntax tree, in the same order of operations.

    A whole number beside a real is converted to a real; a literal like `2` beside a whole number is
    one. A power becomes multiplications. Raises KeyError for a name that `known` lacks, and
    TypeError for an expression with a problem.
    """
    return _lower_typed(tree, known)[0]


def _lower_typed(tree: SyntaxTree, known: NameBindings) -> tuple[Expr, bool]:
    """Return the Program's expression of a tree, and whether its value is a whole number."""
    match tree:
        case Name(path, _):
            return known[path], is_whole(known[path])
        case NumberLiteral(value, _, _):
            return real(value), False
        case Arithmetic("/", left, right, _):
            return Binary("/", _lower_real(left, known), _lower_real(right, known)), False
        case Arithmetic(operator, left, right, _):
            first, second, whole = _lower_operands(left, right, known)
            return Binary(operator, first, second), whole  # type: ignore[arg-type]
        case FunctionCall():
            call = _lower_application(tree, known)
            return call, is_whole(call)
        case BoolLiteral(value, _):
            return Value(value), False
        case Negation(operand, _):
            inner, whole = _lower_typed(operand, known)
            return Unary("-", inner), whole
        case Not(operand, _):
            return Unary("not", lower_expression(operand, known)), False
        case Logic(operator, left, right, _):
            sides = lower_expression(left, known), lower_expression(right, known)
            return Binary(operator, *sides), False  # type: ignore[arg-type]
        case Relation(operator, left, right, _):
            first, second, _ = _lower_operands(left, right, known)
            return Compare(operator, first, second), False  # type: ignore[arg-type]
        case Power(base, exponent, _):
            return _expand_power(_lower_real(base, known), exponent), False
        case Conditional(condition, then, other, _):
            first, second, whole = _lower_operands(then, other, known)
            return Select(lower_expression(condition, known), first, second), whole
        case ErrorNode():
            raise TypeError(f"{tree.span}: an expression with a problem is not lowered")


def _lower_application(tree: FunctionCall, known: NameBindings) -> Expr:
    """Return the expression of a function call.

    `in(...)` and functions with memory are looked up in `known`; `lookup` passes the axes, the
    sizes and the values of its table; a function of whole numbers is lowered by
    `lower_integer_call`.
    """
    match tree:
        case FunctionCall("in", (Name(path, _),), _):
            return known[f"in {path}"]
        case FunctionCall("lookup", (Name(path, _), *arguments), _):
            axes = [known[f"{path} axis {k}"] for k in range(1, len(arguments) + 1)]
            sizes = [known[f"{path} size {k}"] for k in range(1, len(arguments) + 1)]
            read = [_lower_real(part, known) for part in arguments]
            function = "lookup" if len(arguments) == 1 else "lookup2"
            return Call(function, (*axes, *sizes, known[path], *read))
        case FunctionCall(function, _, _) if function in MEMORY_FUNCTIONS:
            return known[memory_key(tree)]
        case FunctionCall(function, arguments, _):
            lowered = [_lower_typed(argument, known) for argument in arguments]
            are_whole = [whole for _, whole in lowered]
            if function in SAME_UNIT_FUNCTIONS and is_integer_call(arguments, are_whole):
                return lower_integer_call(function, _to_whole_arguments(arguments, lowered))
            return Call(function, tuple(_convert_to_real(expr, whole) for expr, whole in lowered))


def _to_whole_arguments(
    arguments: Sequence[SyntaxTree], lowered: Sequence[tuple[Expr, bool]]
) -> list[Expr]:
    """Return the arguments of a call of whole numbers; a literal like `2` becomes a whole number.

    `lowered` has the expression of each argument, and whether its value is a whole number.
    """
    pairs = zip(arguments, lowered, strict=True)
    return [expr if whole else Value(integer_literal(tree) or 0) for tree, (expr, whole) in pairs]


def lower_assigned_value(tree: SyntaxTree, known: NameBindings, whole: bool) -> Expr:
    """Return the expression of a tree, converted to the type of its target.

    If `whole` is true the result is a whole number, by the call `whole` where the tree is a real;
    otherwise a whole number becomes a real by the call `real`, and a bool stays.
    """
    number = integer_literal(tree)
    if whole and number is not None:
        return Value(number)
    value = lower_expression(tree, known)
    if whole:
        return value if is_whole(value) else Call("whole", (value,))
    return to_real(value)


def to_real(expr: Expr) -> Expr:
    """Return the call `real` of a whole-number expression; other expressions are unchanged."""
    return Call("real", (expr,)) if is_whole(expr) else expr


def _lower_real(tree: SyntaxTree, known: NameBindings) -> Expr:
    """Return the Program's expression of a tree, converted to a real if it is a whole number."""
    return _convert_to_real(*_lower_typed(tree, known))


def _convert_to_real(expr: Expr, whole: bool) -> Expr:
    """Return the call `real` of an expression if its value is a whole number, else the same."""
    return Call("real", (expr,)) if whole else expr


def _lower_operands(
    left: SyntaxTree, right: SyntaxTree, known: NameBindings
) -> tuple[Expr, Expr, bool]:
    """Return two operands of one type, and whether they are whole numbers.

    A literal like `2` beside a whole number becomes a whole number. Otherwise both become reals if
    one of them is.
    """
    (first, is_first), (second, is_second) = _lower_typed(left, known), _lower_typed(right, known)
    if is_first == is_second:
        return first, second, is_first
    if is_first and (number := integer_literal(right)) is not None:
        return first, Value(number), True
    if is_second and (number := integer_literal(left)) is not None:
        return Value(number), second, True
    return to_real(first), to_real(second), False


def _expand_power(base: Expr, exponent: int) -> Expr:
    """Return base^exponent as multiplications from left to right.

    A negative exponent gives 1 divided by the product, the exponent 0 gives 1.0.
    """
    if exponent == 0:
        return real(1.0)
    result = base
    for _ in range(abs(exponent) - 1):
        result = multiply(result, base)
    return divide(real(1.0), result) if exponent < 0 else result


def lower_rate(balance: Balance, known: NameBindings) -> Expr:
    """Return der(state) of a balance: its right side divided by the coefficient of the derivative.

    A coefficient of 1 is left out. Raises SpecError if the left side has no such coefficient.
    """
    factor = coefficient_of(balance.left, balance.state)
    if isinstance(factor, SpecError):
        raise factor
    right = _lower_real(balance.right, known)
    return right if factor is None else divide(right, _lower_real(factor, known))


def lower_equations(
    mode: Mode,
    known: dict[str, Expr],
    group: str,
    prefix: str,
    required_names: Iterable[str] | None = None,
) -> list[Op]:
    """Return the assignments `<group><name> = ...` of a mode's equations, in evaluation order.

    `required_names` limits them to the equations that these names need, directly or through other
    equations. `known` is changed: it gets the variable of each equation returned. An equation that
    a parallel region defines is a Switch over its mode. `prefix` opens the key paths.
    """
    order = equation_order(mode)
    needed = set(order) if required_names is None else equation_closure(mode, required_names)
    ops: list[Op] = []
    for name in order:
        if name in needed:
            ops.append(_lower_equation(mode, name, known, group, prefix))
            whole = any(formula.is_integer for formula in equation_formulas(mode)[name])
            known[name] = Ref(f"{group}{name}", whole)
    return ops


def _lower_equation(mode: Mode, name: str, known: NameBindings, group: str, prefix: str) -> Op:
    """Return the operation that sets an equation of a mode.

    An equation that a parallel region defines becomes a Switch over the mode of that region.
    """

    def set_to(formula: Formula) -> Assign:
        """Return the assignment of a formula to the equation."""
        value = lower_assigned_value(formula.tree, known, formula.is_integer)
        return Assign(f"{group}{name}", value, prefix + formula.key)

    region = region_of_equation(mode, name)
    if region is None:
        return set_to(mode.equations[name])
    return choose_by_mode(
        region,
        known,
        {other.name: (set_to(other.equations[name]),) for other in region.modes.values()},
    )


def choose_by_mode(region: Region, known: NameBindings, blocks: Mapping[str, Block]) -> Switch:
    """Return a Switch over the mode of a region; `blocks` has a block for each mode by its name.

    The mode variable is `known["mode <region>"]`. Modes without a block do nothing.
    """
    selector = known[f"mode {region.name}"]
    assert isinstance(selector, Ref)
    cases = tuple((region.modes[name].number, block) for name, block in blocks.items())
    return Switch(selector.name, cases)


def equation_bindings(automaton: Automaton, prefix: str) -> dict[str, Expr]:
    """Return the variable `<prefix><name>` of each equation of any mode, by name.

    It is a whole-number reference for an int or an enumeration.
    """
    return {
        name: Ref(f"{prefix}{name}", whole) for name, whole in _whole_equations(automaton).items()
    }


@cache_on_owner
def _whole_equations(automaton: Automaton) -> dict[str, bool]:
    """Return, for each equation of any mode, whether its value is a whole number."""
    modes = automaton.all_modes
    return {name: formula.is_integer for mode in modes for name, formula in mode.equations.items()}


def variable_bindings(automaton: Automaton, input_group: str) -> dict[str, Expr]:
    """Return the variables of inputs, states and discrete variables, by name.

    An input is `<input_group>.<name>`, or `latched.<name>` if the group is `input` and the input is
    held in a range; states are `state.<name>`, discrete variables `discrete.<name>`.
    """
    found: dict[str, Expr] = {}
    for name, thing in automaton.inputs.items():
        group = (
            "latched"
            if input_group == "input" and has_saturation(automaton, thing)
            else input_group
        )
        found[name] = Ref(f"{group}.{name}", thing.type in WHOLE_TYPES)
    found.update({name: Ref(f"state.{name}") for name in automaton.states})
    for name, variable in automaton.discrete.items():
        found[name] = Ref(f"discrete.{name}", variable.type in WHOLE_TYPES)
    return found


def names_read(trees: Iterable[SyntaxTree]) -> list[str]:
    """Return the names that some trees read, in order, with repetitions."""
    return [read.path for tree in trees for read in names(tree)]
