"""Ranges of a sampled automaton: saturation, fallback and fault bits (rules 13 and 18).

    x = v    ->    if v >= low and v <= high: x = v
                   else: fault bit; x = clip(v, low, high), the fallback, or unchanged

The policy of the range (`on_range`, `fallback`) selects the value of the second line.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from language.expressions.syntax_tree import FunctionCall, walk
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Expr,
    FaultBit,
    Op,
    Ref,
    Select,
    Unary,
    Value,
    real,
    subtract,
)
from language.ir.program import Variable, value_type
from language.ir.traversal import subexpressions
from language.model.automaton import Automaton
from language.model.declaration import Input, Range, State
from language.numerics.evaluate import INTEGER_OF_NAN
from language.text.diagnostic import Problems
from language.typecheck.types import MAX_INT

MAX_FAULT_BITS = 32
"""The number of fault bits of an instance, which are one uint32 word."""

FAULT_PENDING = "memory.fault_pending"
"""The variable that a fault has requested the fault mode."""

FAULT_HAPPENED = "work.fault_happened"
"""The variable that the fault mode is requested in this tick."""


def range_fault_of(variable: Input | State) -> str:
    """Return the name of the fault bit of a range: the declared one, else `range_<name>`."""
    return variable.range_policy.fault or f"range_{variable.name}"


def saturation_range(variable: Input | State) -> Range | None:
    """Return the range that values are held in; None if there is none.

    It is the declared one. An input of an enumeration has the range of the indices of its literals,
    whatever is declared.
    """
    if isinstance(variable, Input) and variable.type == "enum":
        return Fraction(0), Fraction(len(variable.values) - 1)
    return variable.range


def has_saturation(automaton: Automaton, variable: Input | State) -> bool:
    """Return whether a variable is held in a range.

    It is if the automaton is sampled and `saturation_range` is not None.
    """
    return automaton.is_sampled and saturation_range(variable) is not None


def store_saturated(automaton: Automaton, name: str, value: Expr, key: str = "") -> list[Op]:
    """Return the operations that write a state or discrete variable.

    In a sampled automaton a variable with a range (`saturation_range`) is held in it by
    `assign_saturated`. Without a range, and in a continuous automaton, which holds no variable in
    its range, they are one assignment.
    """
    thing = automaton.state_variables[name]
    target = f"{'discrete' if name in automaton.discrete else 'state'}.{name}"
    if not has_saturation(automaton, thing):
        return [Assign(target, value, key)]
    return assign_saturated(automaton, thing, target, value, key)


def store_initial_value(automaton: Automaton, name: str, value: Expr, key: str) -> list[Op]:
    """Return the operations that write the start value of a variable, like `store_saturated`.

    If the range policy of a sampled automaton leaves the variable unchanged at an invalid value,
    the lower bound is written first.
    """
    ops = store_saturated(automaton, name, value, key)
    thing = automaton.state_variables[name]
    if not has_saturation(automaton, thing) or not _may_hold_value(thing):
        return ops
    target = f"{'discrete' if name in automaton.discrete else 'state'}.{name}"
    return [Assign(target, bound_literals(thing)[0]), *ops]


def saturate_written_states(
    automaton: Automaton, names: Iterable[str]
) -> tuple[list[Op], list[Op]]:
    """Return the operations to insert before and after code that writes states without saturation.

    The first list saves the states whose policy keeps the old value; the second one holds the new
    values in their ranges. Both are empty for names that are no states or have no range, and in a
    continuous automaton.
    """
    before: list[Op] = []
    after: list[Op] = []
    for name in names:
        thing = automaton.states.get(name)
        if thing is None or not has_saturation(automaton, thing):
            continue
        state, new, held = Ref(f"state.{name}"), f"work.new_{name}", f"work.held_{name}"
        after.append(Assign(new, state))
        if _may_hold_value(thing):
            before.append(Assign(held, state))
            after.append(Assign(state.name, Ref(held)))
        after += assign_saturated(automaton, thing, state.name, Ref(new))
    return before, after


def latch_inputs(automaton: Automaton) -> Block:
    """Return the operations that copy each input with a range to `latched.<name>`, saturated.

    They are empty in a continuous automaton.
    """
    ops: list[Op] = []
    for name, thing in automaton.inputs.items():
        if has_saturation(automaton, thing):
            value = Ref(f"input.{name}", value_type(thing.type) == "whole")
            ops += assign_saturated(automaton, thing, f"latched.{name}", value, thing.key)
    return tuple(ops)


def initialise_latched_inputs(automaton: Automaton) -> list[Op]:
    """Return the assignments of `latched.<name>` before the first tick, for inputs with a range.

    The value is the default of the input, or 0, moved to the nearest bound of the range.
    """
    ops: list[Op] = []
    for name, thing in automaton.inputs.items():
        if has_saturation(automaton, thing):
            low, high = saturation_range(thing) or (Fraction(0), Fraction(0))
            first = thing.default if thing.default is not None else Fraction(0)
            ops.append(Assign(f"latched.{name}", _literal(thing, min(max(first, low), high))))
    return ops


def bound_literals(variable: Input | State) -> tuple[Value, Value]:
    """Return the lower and the upper bound of a range as literals of the variable's type.

    They are (0, 0) without a range.
    """
    low, high = saturation_range(variable) or (Fraction(0), Fraction(0))
    return _literal(variable, low), _literal(variable, high)


def assign_saturated(
    automaton: Automaton, variable: Input | State, target: str, value: Expr, key: str = ""
) -> list[Op]:
    """Return the operations that write a value to `target`, held in the range of `variable`.

    A value that is no variable, or is the target itself, is stored in `work.new_<name>` first. A
    value outside the range sets the fault bit; the policy then clips it, takes the fallback or
    keeps the old value. It requests the fault mode, if there is one, for `on_range: fault` and for
    a real input that is not finite. A range that ends at +-MAX_INT does not contain this end if the
    value may be a converted real, because one too large for the type is converted to it (rule C8).
    """
    ops: list[Op] = []
    is_converted = _may_be_converted(automaton, variable, value)
    if not isinstance(value, Ref) or value.name == target:
        new = Ref(f"work.new_{variable.name}", value_type(variable.type) == "whole")
        ops.append(Assign(new.name, value, key))
        value, key = new, ""
    low, high = bound_literals(variable)
    above = Compare(">" if is_converted and low.value == -MAX_INT else ">=", value, low)
    below = Compare("<" if is_converted and high.value == MAX_INT else "<=", value, high)
    inside = Binary("and", above, below)
    outside: list[Op] = [FaultBit(range_fault_of(variable), variable.name)]
    outside += _assign_out_of_range(variable, target, value)
    outside += _request_fault_mode(automaton, variable, value)
    ops.append(Branch(inside, (Assign(target, value, key),), tuple(outside)))
    return ops


def _may_be_converted(automaton: Automaton, variable: Input | State, value: Expr) -> bool:
    """Return whether the value of an int may come from `floor(...)` of a real.

    For a variable, such as the value of a stage, it is whether an assignment of the automaton to
    the int contains a `floor`.
    """
    if variable.type != "int" or isinstance(variable, Input):
        return False
    if not isinstance(value, Ref):
        return any(
            isinstance(part, Call) and part.function == "whole" for part in subexpressions(value)
        )
    return any(
        isinstance(part, FunctionCall) and part.function == "floor"
        for mode in automaton.all_modes
        for formulas in (mode.update, *mode.jump_assignments)
        if variable.name in formulas
        for part in walk(formulas[variable.name].tree)
    )


def saturable_variables(automaton: Automaton) -> list[Input | State]:
    """Return all variables that may have a range: inputs, states and discrete variables."""
    return [*automaton.inputs.values(), *automaton.state_variables.values()]


def require_ranges(automaton: Automaton) -> None:
    """Raise SpecError with a problem for each real or int variable without a range (rule 18).

    Checked are inputs, states and discrete variables; generated C needs their ranges.
    """
    problems = Problems()
    for thing in saturable_variables(automaton):
        if thing.type in ("real", "int") and thing.range is None:
            kind, _, name = thing.key.partition(".")
            label = f"`{name}` has no `range`: in C every number of `{kind}` is held in one"
            problems.error(
                "range", thing.span, label, "add it in the unit of the value: `range: [0, 1]`"
            )
    problems.raise_if_errors()


def saturation_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of fault requests, latched inputs, and new and held values.

    `latched.<name>` is only for inputs with a range; `work.new_<name>` and `work.held_<name>` are
    for all states and discrete variables.
    """
    found = [
        Variable(FAULT_PENDING, "truth", about="a fault asks for the fault mode"),
        Variable(FAULT_HAPPENED, "truth"),
    ]
    for name, thing in automaton.inputs.items():
        if has_saturation(automaton, thing):
            unit = str(thing.unit.dimension)
            about = f"{thing.key} within its range"
            kind = value_type(thing.type)
            found.append(Variable(f"latched.{name}", kind, unit, about=about, values=thing.values))
    for name, variable in automaton.state_variables.items():
        unit = str(variable.unit.dimension)
        for verb in ("new", "held"):
            found.append(Variable(f"work.{verb}_{name}", value_type(variable.type), unit))
    return found


def _may_hold_value(variable: Input | State) -> bool:
    """Return whether a variable keeps its old value for some value outside its range."""
    keeps = variable.range_policy.on_range in ("hold", "fault") or variable.type == "enum"
    return keeps or variable.range_policy.fallback == "hold"


def _assign_out_of_range(variable: Input | State, target: str, value: Expr) -> list[Op]:
    """Return the operations that write a value outside the range; none if the old value stays."""
    fallback = variable.range_policy.fallback
    keeps = variable.range_policy.on_range in ("hold", "fault") or variable.type == "enum"
    near: Block = ()
    if not keeps:
        near = (Assign(target, _clip(variable, value, *bound_literals(variable))),)
    if fallback is None or (keeps and fallback == "hold"):
        return list(near)
    last: Block = () if fallback == "hold" else (Assign(target, _literal(variable, fallback)),)
    if variable.type == "enum":
        return list(last)
    if not near:
        return [Branch(Unary("not", _is_finite(variable, value)), last)]
    return [Branch(_is_finite(variable, value), near, last)]


def _request_fault_mode(automaton: Automaton, variable: Input | State, value: Expr) -> list[Op]:
    """Return the operations that request the fault mode after a value outside the range.

    `on_range: fault` requests it always; a real input requests it if the value is not finite.
    """
    if automaton.fault_mode is None:
        return []
    ask = Assign(FAULT_PENDING, Value(True))
    if variable.range_policy.on_range == "fault":
        return [ask]
    if isinstance(variable, Input) and variable.type == "real":
        return [Branch(Unary("not", _is_finite(variable, value)), (ask,))]
    return []


def _clip(variable: Input | State, value: Expr, low: Expr, high: Expr) -> Expr:
    """Return the value clipped to (low, high); a NaN becomes `low` (rule C7)."""
    if variable.type == "real":
        return Call("clip", (value, low, high))
    inner = Select(Compare("<", value, high), value, high)
    return Select(Compare(">", value, low), inner, low)


def _is_finite(variable: Input | State, value: Expr) -> Expr:
    """Return the condition that a value is finite.

    For a real it is `v - v >= 0`, which is false for an infinity and for NaN. For a whole number it
    is that the value is not the conversion of a NaN (rule C8).
    """
    if variable.type == "real":
        return Compare(">=", subtract(value, value), real(0.0))
    return Compare("!=", value, Value(INTEGER_OF_NAN))


def _literal(variable: Input | State, value: Fraction) -> Value:
    """Return a number as a literal of a variable's type; a fraction is truncated if not real."""
    return real(value) if variable.type == "real" else Value(int(value))
