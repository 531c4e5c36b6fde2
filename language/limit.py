"""Limit: what a sampled automaton does with a value outside its declared range (rules 13 and 18).

A value about to be written passes unchanged where `low <= value <= high`. Else a fault bit is set
in the same step, and the variable gets the nearest bound, its fallback, or keeps its value.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from language.declaration import Input, Range, State
from language.evaluate import NO_NUMBER
from language.model import Automaton
from language.operation import (
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
from language.problem import Problems
from language.program import Variable, value_type

MAX_FAULTS = 32
"""Fault bits of an instance: one word."""
PENDING = "memory.fault_pending"
HAPPENED = "work.fault_happened"
MICRO_STEP_LIMIT = "micro_step_limit"
OWN_FAULTS = ("event_limit", MICRO_STEP_LIMIT, "rewind_limit", "stale_calibration")
"""Faults that the product names itself."""


def fault_of(thing: Input | State) -> str:
    """Return the fault bit that a range sets: its own unless it says another."""
    return thing.limits.fault or f"range_{thing.name}"


def limits_of(thing: Input | State) -> Range | None:
    """Return the range that values are held in; an enumeration's are the places in its list."""
    if isinstance(thing, Input) and thing.type == "enum":
        return Fraction(0), Fraction(len(thing.values) - 1)
    return thing.range


def is_limited(automaton: Automaton, thing: Input | State) -> bool:
    """Tell whether values of an input, state or discrete variable are held in a range."""
    return automaton.is_sampled and limits_of(thing) is not None


def stored(automaton: Automaton, name: str, value: Expr, key: str = "") -> list[Op]:
    """Return what writes a state or discrete variable, within its range if it has one."""
    thing = automaton.carried[name]
    target = f"{'discrete' if name in automaton.discrete else 'state'}.{name}"
    if not is_limited(automaton, thing):
        return [Assign(target, value, key)]
    return limited(automaton, thing, target, value, key)


def started(automaton: Automaton, name: str, value: Expr, key: str) -> list[Op]:
    """Return what gives a variable its first value; to keep there is its low bound."""
    ops = stored(automaton, name, value, key)
    thing = automaton.carried[name]
    if not is_limited(automaton, thing) or not _may_keep(thing):
        return ops
    target = f"{'discrete' if name in automaton.discrete else 'state'}.{name}"
    return [Assign(target, bounds(thing)[0]), *ops]


def kept(automaton: Automaton, names: Iterable[str]) -> tuple[list[Op], list[Op]]:
    """Return what stands before and after operations that write states by themselves (a run)."""
    before: list[Op] = []
    after: list[Op] = []
    for name in names:
        thing = automaton.states.get(name)
        if thing is None or not is_limited(automaton, thing):
            continue
        state, new, held = Ref(f"state.{name}"), f"work.new_{name}", f"work.held_{name}"
        after.append(Assign(new, state))
        if _may_keep(thing):
            before.append(Assign(held, state))
            after.append(Assign(state.name, Ref(held)))
        after += limited(automaton, thing, state.name, Ref(new))
    return before, after


def latch(automaton: Automaton) -> Block:
    """Return what takes the inputs of a tick: those with a range are held in it."""
    ops: list[Op] = []
    for name, thing in automaton.inputs.items():
        if is_limited(automaton, thing):
            value = Ref(f"input.{name}", value_type(thing.type) == "whole")
            ops += limited(automaton, thing, f"latched.{name}", value, thing.key)
    return tuple(ops)


def first_latched(automaton: Automaton) -> list[Op]:
    """Return what an input holds before the first tick: its default, or what is nearest to 0."""
    ops: list[Op] = []
    for name, thing in automaton.inputs.items():
        if is_limited(automaton, thing):
            low, high = limits_of(thing) or (Fraction(0), Fraction(0))
            first = thing.default if thing.default is not None else Fraction(0)
            ops.append(Assign(f"latched.{name}", _literal(thing, min(max(first, low), high))))
    return ops


def bounds(thing: Input | State) -> tuple[Expr, Expr]:
    """Return the bounds of a range as literals."""
    low, high = limits_of(thing) or (Fraction(0), Fraction(0))
    return _literal(thing, low), _literal(thing, high)


def limited(
    automaton: Automaton, thing: Input | State, target: str, value: Expr, key: str = ""
) -> list[Op]:
    """Return what writes a value within the range of a variable, or does what its limits say."""
    ops: list[Op] = []
    if not isinstance(value, Ref) or value.name == target:
        new = Ref(f"work.new_{thing.name}", value_type(thing.type) == "whole")
        ops.append(Assign(new.name, value, key))
        value, key = new, ""
    low, high = bounds(thing)
    inside = Binary("and", Compare(">=", value, low), Compare("<=", value, high))
    outside: list[Op] = [FaultBit(fault_of(thing), thing.name)]
    outside += _replaced(thing, target, value)
    outside += _pending(automaton, thing, value)
    ops.append(Branch(inside, (Assign(target, value, key),), tuple(outside)))
    return ops


def limited_things(automaton: Automaton) -> list[Input | State]:
    """Return all that may have a range: inputs, states, discrete variables."""
    return [*automaton.inputs.values(), *automaton.carried.values()]


def require_ranges(automaton: Automaton) -> None:
    """Refuse an automaton for C in which a number has no range (rule 18). Raises SpecError."""
    problems = Problems()
    for thing in limited_things(automaton):
        if thing.type in ("real", "int") and thing.range is None:
            kind, _, name = thing.key.partition(".")
            label = f"`{name}` has no `range`: in C every number of `{kind}` is held in one"
            problems.error(
                "range", thing.span, label, "add it in the unit of the value: `range: [0, 1]`"
            )
    problems.stop_if_any()


def limit_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables that ranges use."""
    found = [
        Variable(PENDING, "truth", about="a fault asks for the fault mode"),
        Variable(HAPPENED, "truth"),
    ]
    for name, thing in automaton.inputs.items():
        if is_limited(automaton, thing):
            unit = str(thing.unit.dimension)
            about = f"{thing.key} within its range"
            kind = value_type(thing.type)
            found.append(Variable(f"latched.{name}", kind, unit, about=about, values=thing.values))
    for name, variable in automaton.carried.items():
        unit = str(variable.unit.dimension)
        for verb in ("new", "held"):
            found.append(Variable(f"work.{verb}_{name}", value_type(variable.type), unit))
    return found


def _may_keep(thing: Input | State) -> bool:
    keeps = thing.limits.on_range in ("hold", "fault") or thing.type == "enum"
    return keeps or thing.limits.fallback == "hold"


def _replaced(thing: Input | State, target: str, value: Expr) -> list[Op]:
    """Return what an impossible value becomes; nothing where the variable keeps its value."""
    fallback = thing.limits.fallback
    keeps = thing.limits.on_range in ("hold", "fault") or thing.type == "enum"
    near: Block = ()
    if not keeps:
        near = (Assign(target, _clipped(thing, value, *bounds(thing))),)
    if fallback is None or (keeps and fallback == "hold"):
        return list(near)
    last: Block = () if fallback == "hold" else (Assign(target, _literal(thing, fallback)),)
    if thing.type == "enum":
        return list(last)
    if not near:
        return [Branch(Unary("not", _is_finite(thing, value)), last)]
    return [Branch(_is_finite(thing, value), near, last)]


def _pending(automaton: Automaton, thing: Input | State, value: Expr) -> list[Op]:
    """Return what asks for the fault mode: `on_range: fault`, or an input that is not finite."""
    if automaton.fault_mode is None:
        return []
    ask = Assign(PENDING, Value(True))
    if thing.limits.on_range == "fault":
        return [ask]
    if isinstance(thing, Input) and thing.type == "real":
        return [Branch(Unary("not", _is_finite(thing, value)), (ask,))]
    return []


def _clipped(thing: Input | State, value: Expr, low: Expr, high: Expr) -> Expr:
    """The nearest bound; NaN becomes the lower one (rule C7)."""
    if thing.type == "real":
        return Call("clip", (value, low, high))
    inner = Select(Compare("<", value, high), value, high)
    return Select(Compare(">", value, low), inner, low)


def _is_finite(thing: Input | State, value: Expr) -> Expr:
    """A difference with itself is 0 for what is finite and NaN, never >= 0, for the rest."""
    if thing.type == "real":
        return Compare(">=", subtract(value, value), real(0.0))
    return Compare("!=", value, Value(NO_NUMBER))


def _literal(thing: Input | State, value: Fraction) -> Value:
    return real(value) if thing.type == "real" else Value(int(value))
