"""Limit: what a sampled automaton does with a value outside its declared range (rules 13 and 18).

A value about to be written passes unchanged where `low <= value <= high`. Else a fault bit is set
in the same step, and the variable gets the nearest bound, its fallback, or keeps its value.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

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
from language.model.automaton import Automaton
from language.model.declaration import Input, Range, State
from language.numerics.evaluate import INTEGER_OF_NAN
from language.text.diagnostic import Problems

MAX_FAULT_BITS = 32
"""Fault bits of an instance: one word."""

FAULT_PENDING = "memory.fault_pending"

FAULT_HAPPENED = "work.fault_happened"


def range_fault_of(variable: Input | State) -> str:
    """Return the fault bit that a range sets: its own unless it says another."""
    return variable.range_policy.fault or f"range_{variable.name}"


def saturation_range(variable: Input | State) -> Range | None:
    """Return the range that values are held in; an enumeration's are the places in its list."""
    if isinstance(variable, Input) and variable.type == "enum":
        return Fraction(0), Fraction(len(variable.values) - 1)
    return variable.range


def has_saturation(automaton: Automaton, variable: Input | State) -> bool:
    """Tell whether values of an input, state or discrete variable are held in a range."""
    return automaton.is_sampled and saturation_range(variable) is not None


def store_saturated(automaton: Automaton, name: str, value: Expr, key: str = "") -> list[Op]:
    """Return what writes a state or discrete variable, within its range if it has one."""
    thing = automaton.state_variables[name]
    target = f"{'discrete' if name in automaton.discrete else 'state'}.{name}"
    if not has_saturation(automaton, thing):
        return [Assign(target, value, key)]
    return assign_saturated(automaton, thing, target, value, key)


def store_initial_value(automaton: Automaton, name: str, value: Expr, key: str) -> list[Op]:
    """Return what gives a variable its first value; to keep there is its low bound."""
    ops = store_saturated(automaton, name, value, key)
    thing = automaton.state_variables[name]
    if not has_saturation(automaton, thing) or not _may_hold_value(thing):
        return ops
    target = f"{'discrete' if name in automaton.discrete else 'state'}.{name}"
    return [Assign(target, bound_literals(thing)[0]), *ops]


def saturate_written_states(
    automaton: Automaton, names: Iterable[str]
) -> tuple[list[Op], list[Op]]:
    """Return what stands before and after operations that write states by themselves (a run)."""
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
    """Return what takes the inputs of a tick: those with a range are held in it."""
    ops: list[Op] = []
    for name, thing in automaton.inputs.items():
        if has_saturation(automaton, thing):
            value = Ref(f"input.{name}", value_type(thing.type) == "whole")
            ops += assign_saturated(automaton, thing, f"latched.{name}", value, thing.key)
    return tuple(ops)


def initialise_latched_inputs(automaton: Automaton) -> list[Op]:
    """Return what an input holds before the first tick: its default, or what is nearest to 0."""
    ops: list[Op] = []
    for name, thing in automaton.inputs.items():
        if has_saturation(automaton, thing):
            low, high = saturation_range(thing) or (Fraction(0), Fraction(0))
            first = thing.default if thing.default is not None else Fraction(0)
            ops.append(Assign(f"latched.{name}", _literal(thing, min(max(first, low), high))))
    return ops


def bound_literals(variable: Input | State) -> tuple[Expr, Expr]:
    """Return the bounds of a range as literals."""
    low, high = saturation_range(variable) or (Fraction(0), Fraction(0))
    return _literal(variable, low), _literal(variable, high)


def assign_saturated(
    automaton: Automaton, variable: Input | State, target: str, value: Expr, key: str = ""
) -> list[Op]:
    """Return what writes a value within the range of a variable, or does what its limits say."""
    ops: list[Op] = []
    if not isinstance(value, Ref) or value.name == target:
        new = Ref(f"work.new_{variable.name}", value_type(variable.type) == "whole")
        ops.append(Assign(new.name, value, key))
        value, key = new, ""
    low, high = bound_literals(variable)
    inside = Binary("and", Compare(">=", value, low), Compare("<=", value, high))
    outside: list[Op] = [FaultBit(range_fault_of(variable), variable.name)]
    outside += _assign_out_of_range(variable, target, value)
    outside += _request_fault_mode(automaton, variable, value)
    ops.append(Branch(inside, (Assign(target, value, key),), tuple(outside)))
    return ops


def saturable_variables(automaton: Automaton) -> list[Input | State]:
    """Return all that may have a range: inputs, states, discrete variables."""
    return [*automaton.inputs.values(), *automaton.state_variables.values()]


def require_ranges(automaton: Automaton) -> None:
    """Refuse an automaton for C in which a number has no range (rule 18). Raises SpecError."""
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
    """Return the variables that ranges use."""
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
    keeps = variable.range_policy.on_range in ("hold", "fault") or variable.type == "enum"
    return keeps or variable.range_policy.fallback == "hold"


def _assign_out_of_range(variable: Input | State, target: str, value: Expr) -> list[Op]:
    """Return what an impossible value becomes; nothing where the variable keeps its value."""
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
    """Return what asks for the fault mode: `on_range: fault`, or an input that is not finite."""
    if automaton.fault_mode is None:
        return []
    ask = Assign(FAULT_PENDING, Value(True))
    if variable.range_policy.on_range == "fault":
        return [ask]
    if isinstance(variable, Input) and variable.type == "real":
        return [Branch(Unary("not", _is_finite(variable, value)), (ask,))]
    return []


def _clip(variable: Input | State, value: Expr, low: Expr, high: Expr) -> Expr:
    """The nearest bound; NaN becomes the lower one (rule C7)."""
    if variable.type == "real":
        return Call("clip", (value, low, high))
    inner = Select(Compare("<", value, high), value, high)
    return Select(Compare(">", value, low), inner, low)


def _is_finite(variable: Input | State, value: Expr) -> Expr:
    """A difference with itself is 0 for what is finite and NaN, never >= 0, for the rest."""
    if variable.type == "real":
        return Compare(">=", subtract(value, value), real(0.0))
    return Compare("!=", value, Value(INTEGER_OF_NAN))


def _literal(variable: Input | State, value: Fraction) -> Value:
    return real(value) if variable.type == "real" else Value(int(value))
