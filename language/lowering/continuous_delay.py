"""History of a continuous automaton: `delay` as operations, `after` and `every` as time events.

A delayed quantity is kept at the major steps, when everything of that instant has happened, and
read by linear interpolation: a step of it becomes a ramp over one major step. What is read lies at
least one major step back, so a step of the integration never needs what it computes, and nothing is
kept while states flow (rule 1). Between two records only the three oldest values are read.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from language.expressions.syntax_tree import (
    TIME_FUNCTIONS,
    FunctionCall,
    Name,
    SyntaxTree,
    memory_key,
    walk,
)
from language.ir.ops import (
    Assign,
    Block,
    Call,
    Compare,
    Expr,
    Item,
    Loop,
    Op,
    Ref,
    Select,
    Store,
    Unary,
    add,
    divide,
    integer,
    multiply,
    real,
    subtract,
)
from language.ir.program import Alarm, Variable
from language.lowering.constants import evaluate_exactly
from language.lowering.delay_buffers import memory_calls_by_key
from language.lowering.expressions import NameBindings, lower_expression
from language.lowering.parameter_bindings import constant_bindings
from language.model.automaton import Automaton, Mode
from language.model.declaration import Formula

RECORD_AGE = Ref("memory.age")
"""Time since the last record [s]; an engine sets it."""


@dataclass(frozen=True)
class ContinuousDelay:
    """One delayed quantity: `steps` is its delay in major steps, the longest if it is `tunable`.

    `tunable` is the parameter [s] that the delay is, at least one major step.
    """

    number: int
    call: FunctionCall
    delay_steps: Fraction
    major_step: Fraction
    tunable_delay: Expr | None = None

    @property
    def whole_steps(self) -> int:
        """The delay in major steps, rounded up."""
        return math.ceil(self.delay_steps)

    def variable_name(self, part: str) -> str:
        """Return the variable of a part: `values`, `newest`, `far`, `middle`, `near`."""
        return f"memory.{part}_{self.number}"


def continuous_delays_of(automaton: Automaton) -> tuple[ContinuousDelay, ...]:
    """Return what a continuous automaton delays, what is inside another delay first."""
    found: list[ContinuousDelay] = []
    for tree in memory_calls_by_key(automaton, ("delay",)).values():
        time, step = tree.arguments[1], automaton.step
        tuned = tunable_delay_of(automaton, time)
        if tuned is None:
            steps = evaluate_exactly(Formula(time, ""), automaton) / step
            found.append(ContinuousDelay(len(found) + 1, tree, steps, step))
        else:
            steps = Fraction(max(1, math.ceil(tuned[1] / step)))
            parameter = constant_bindings(automaton)[tuned[0]]
            found.append(ContinuousDelay(len(found) + 1, tree, steps, step, parameter))
    return tuple(found)


def tunable_delay_of(automaton: Automaton, time: SyntaxTree) -> tuple[str, Fraction] | None:
    """Return the parameter that a time is if it is tunable, and the end of its range [s]."""
    if isinstance(time, Name):
        parameter = automaton.parameters.get(time.path)
        if parameter and parameter.kind == "tunable" and parameter.range:
            return parameter.name, parameter.range[1]
    return None


def delayed_value_bindings(
    automaton: Automaton, delays: tuple[ContinuousDelay, ...]
) -> dict[str, Expr]:
    """Return what each delayed quantity is at `work.s` after the start of a step.

    Counted in major steps back from the last record it is at q - (age + s) / step, q being the
    delay: between the values N and N - 1 back, N = ceil(q), or between those N - 1 and N - 2 back.
    """
    found: dict[str, Expr] = {}
    for history in delays:
        passed = divide(add(RECORD_AGE, Ref("work.s")), real(automaton.step))
        back = subtract(real(history.delay_steps), passed)
        count = history.whole_steps
        far, middle, near = (Ref(history.variable_name(part)) for part in ("far", "middle", "near"))
        if history.tunable_delay is not None:
            found[memory_key(history.call)] = _tunable_delay_value(history, passed)
            continue
        older = _interpolate(middle, far, subtract(back, real(Fraction(count - 1))))
        if history.delay_steps == count:
            found[memory_key(history.call)] = older
            continue
        newer = _interpolate(near, middle, subtract(back, real(Fraction(count - 2))))
        is_older = Compare(">=", back, real(Fraction(count - 1)))
        found[memory_key(history.call)] = Select(is_older, older, newer)
    return found


def _tunable_delay_value(delay: ContinuousDelay, elapsed_steps: Expr) -> Expr:
    """What a delay of a tunable length is, `elapsed_steps` major steps after the last record."""
    far, middle, near = (Ref(delay.variable_name(part)) for part in ("far", "middle", "near"))
    last = subtract(Call("real", (Ref(delay.variable_name("count"), is_integer=True),)), real(1.0))
    over = subtract(subtract(Ref(delay.variable_name("delay")), elapsed_steps), last)
    newer = _interpolate(near, middle, add(over, real(1.0)))
    return Select(Compare(">=", over, real(0.0)), _interpolate(middle, far, over), newer)


def record_block(delays: tuple[ContinuousDelay, ...], known: NameBindings) -> Block:
    """Return what a major step keeps: all read the values of before it."""
    ops: list[Op] = []
    commit: list[Op] = []
    for history in delays:
        kept = Ref(f"work.keep_{history.number}")
        newest = Ref(history.variable_name("newest"), is_integer=True)
        ops.append(Assign(kept.name, lower_expression(history.call.arguments[0], known)))
        commit.append(Assign(newest.name, _ring_index(history, newest, 1)))
        commit.append(Store(history.variable_name("values"), newest, kept))
        commit += _update_oldest(history)
    return (*ops, *commit)


def fill_block(delays: tuple[ContinuousDelay, ...], known: NameBindings) -> Block:
    """Return what fills each history with the value at the start."""
    ops: list[Op] = []
    for history in delays:
        kept, slot = Ref(f"work.keep_{history.number}"), Ref("work.slot")
        ops.append(Assign(kept.name, lower_expression(history.call.arguments[0], known)))
        store = Store(history.variable_name("values"), slot, kept)
        ops.append(Loop(history.whole_steps + 1, slot.name, (store,)))
        ops.append(Assign(history.variable_name("newest"), integer(0)))
        ops += _update_oldest(history)
    return tuple(ops)


def _interpolate(newer: Ref, older: Ref, fraction: Expr) -> Expr:
    return add(newer, multiply(fraction, subtract(older, newer)))


def _ring_index(delay: ContinuousDelay, newest: Ref, offset: int) -> Expr:
    """The place in the ring that comes `offset` places after the newest value."""
    size = delay.whole_steps + 1
    last = Compare(">=", newest, integer(size - offset))
    return Select(last, subtract(newest, integer(size - offset)), add(newest, integer(offset)))


def _update_oldest(delay: ContinuousDelay) -> list[Op]:
    newest = Ref(delay.variable_name("newest"), is_integer=True)
    if delay.tunable_delay is not None:
        return _update_oldest_tunable(delay, newest)
    parts = (
        ("far", "middle") if delay.delay_steps == delay.whole_steps else ("far", "middle", "near")
    )
    return [
        Assign(
            delay.variable_name(part),
            Item(delay.variable_name("values"), _ring_index(delay, newest, ahead)),
        )
        for ahead, part in enumerate(parts, start=1)
    ]


def _update_oldest_tunable(history: ContinuousDelay, newest: Ref) -> list[Op]:
    """The delay as it is now, and the values around its end."""
    delay, count = history.variable_name("delay"), history.variable_name("count")
    assert history.tunable_delay is not None
    steps = divide(history.tunable_delay, real(history.major_step))
    size = history.whole_steps + 1
    rounded_up = Unary("-", Call("floor", (Unary("-", Ref(delay)),)))
    ops: list[Op] = [
        Assign(delay, Call("clip", (steps, real(1.0), real(history.delay_steps)))),
        Assign(count, Call("whole", (rounded_up,))),
    ]
    for less, part in enumerate(("far", "middle", "near")):
        place = add(subtract(newest, Ref(count, is_integer=True)), integer(less))
        inside = Select(Compare("<", place, integer(0)), add(place, integer(size)), place)
        if part == "near":
            inside = Select(Compare(">", Ref(count, is_integer=True), integer(1)), inside, newest)
        ops.append(
            Assign(history.variable_name(part), Item(history.variable_name("values"), inside))
        )
    return ops


def continuous_delay_variables(delays: tuple[ContinuousDelay, ...]) -> list[Variable]:
    """Return the variables of histories; `finished` leaves out what is not used."""
    found = [
        Variable(RECORD_AGE.name, "real", "s", about="time since the last record"),
        Variable("work.slot", "whole"),
        Variable("work.round", "whole"),
    ]
    for history in delays:
        size = history.whole_steps + 1
        found.append(
            Variable(history.variable_name("values"), "real", size=size, about="a major step each")
        )
        found.append(
            Variable(history.variable_name("newest"), "whole", about="which is the newest")
        )
        found += [
            Variable(history.variable_name(part), "real") for part in ("far", "middle", "near")
        ]
        found.append(Variable(f"work.keep_{history.number}", "real"))
        found.append(Variable(history.variable_name("delay"), "real", about="delay in major steps"))
        found.append(Variable(history.variable_name("count"), "whole", about="delay, rounded up"))
    return found


def alarms_of(automaton: Automaton) -> tuple[Alarm, ...]:
    """Return the times after which an `after` or `every` in a guard is true, by mode."""
    found: list[Alarm] = []
    for mode in automaton.all_modes:
        for tree in _timer_calls(mode).values():
            time = evaluate_exactly(Formula(tree.arguments[0], ""), automaton)
            name = f"memory.{tree.function}_{len(found) + 1}"
            repeats = tree.function == "every"
            found.append(Alarm(name, mode.region, mode.number, time, repeats))
    return tuple(found)


def alarm_bindings(automaton: Automaton) -> Mapping[str, NameBindings]:
    """Return, by the key of a mode, what the times in its guards are."""
    alarms = iter(alarms_of(automaton))
    return {
        mode.key: {key: Ref(next(alarms).variable) for key in _timer_calls(mode)}
        for mode in automaton.all_modes
    }


def _timer_calls(mode: Mode) -> dict[str, FunctionCall]:
    parts = [part for t in mode.transitions for part in walk(t.when.tree)]
    found = [
        part for part in parts if isinstance(part, FunctionCall) and part.function in TIME_FUNCTIONS
    ]
    return {memory_key(part): part for part in found}
