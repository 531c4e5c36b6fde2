"""Delays and timers of a continuous automaton: `delay` as buffers, `after` and `every` as alarms.

A delayed quantity is recorded at the major steps, after all events of that instant, and read by
linear interpolation; a step of it becomes a ramp over one major step. Each delay is at least one
major step, so a step of the integration never reads values that it computes itself, and nothing is
recorded during flow (rule 1). Between two records, at most the three oldest values are read.
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
    Value,
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
from language.lowering.event_tolerance import is_instantaneous
from language.lowering.expressions import NameBindings, lower_expression
from language.lowering.program_parameters import constant_bindings
from language.model.automaton import Automaton, Mode
from language.model.declaration import Formula

RECORD_AGE = Ref("memory.age")
"""The time since the last record [s]."""


@dataclass(frozen=True)
class ContinuousDelay:
    """A delayed quantity; `delay_steps` is its delay in major steps.

    A tunable delay has the parameter [s] as `tunable_delay` and the upper end of its range as
    `delay_steps`. It is clipped to one major step at least.
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
        """Return `memory.<part>_<number>`.

        The parts are values (ring buffer), newest (its index), far, middle and near (the oldest
        records), and delay and count of a tunable delay.
        """
        return f"memory.{part}_{self.number}"


def continuous_delays_of(automaton: Automaton) -> tuple[ContinuousDelay, ...]:
    """Return the different delays of a continuous automaton, numbered from 1.

    Inner delays come before those that contain them. Equal calls share one delay. Raises SpecError
    if a time is not made of numbers and parameters.
    """
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
    """Return the parameter that a delay is, and the upper end of its range [s].

    `time` is the expression of the delay. The result is None unless it is the name of a tunable
    parameter with a range.
    """
    if isinstance(time, Name):
        parameter = automaton.parameters.get(time.path)
        if parameter and parameter.kind == "tunable" and parameter.range:
            return parameter.name, parameter.range[1]
    return None


def delayed_value_bindings(
    automaton: Automaton, delays: tuple[ContinuousDelay, ...]
) -> dict[str, Expr]:
    """Return each delayed quantity at `work.s` after the start of a step, by its memory key.

    Let q be the delay in major steps and N = ceil(q). The value lies q - (age + s) / step major
    steps before the last record: between the records N and N - 1 steps back, or N - 1 and N - 2
    steps back.
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
    """Return the value of a tunable delay, `elapsed_steps` major steps after the last record."""
    far, middle, near = (Ref(delay.variable_name(part)) for part in ("far", "middle", "near"))
    last = subtract(Call("real", (Ref(delay.variable_name("count"), is_integer=True),)), real(1.0))
    over = subtract(subtract(Ref(delay.variable_name("delay")), elapsed_steps), last)
    newer = _interpolate(near, middle, add(over, real(1.0)))
    return Select(Compare(">=", over, real(0.0)), _interpolate(middle, far, over), newer)


def record_block(delays: tuple[ContinuousDelay, ...], known: NameBindings) -> Block:
    """Return the operations that record the delayed quantities at a major step.

    All quantities are evaluated before the first one is stored in its ring buffer; then the oldest
    records are copied. Nothing resets `memory.age`.
    """
    ops: list[Op] = []
    commit: list[Op] = []
    for history in delays:
        value = Ref(f"work.keep_{history.number}")
        newest = Ref(history.variable_name("newest"), is_integer=True)
        ops.append(Assign(value.name, lower_expression(history.call.arguments[0], known)))
        commit.append(Assign(newest.name, _ring_index(history, newest, 1)))
        commit.append(Store(history.variable_name("values"), newest, value))
        commit += _update_oldest(history)
    return (*ops, *commit)


def fill_block(delays: tuple[ContinuousDelay, ...], known: NameBindings) -> Block:
    """Return the operations that fill all records of each delay with its present value.

    The delays are filled one after the other, so that a later one reads the earlier ones.
    """
    ops: list[Op] = []
    for history in delays:
        value, slot = Ref(f"work.keep_{history.number}"), Ref("work.slot")
        ops.append(Assign(value.name, lower_expression(history.call.arguments[0], known)))
        store = Store(history.variable_name("values"), slot, value)
        ops.append(Loop(history.whole_steps + 1, slot.name, (store,)))
        ops.append(Assign(history.variable_name("newest"), integer(0)))
        ops += _update_oldest(history)
    return tuple(ops)


def _interpolate(newer: Ref, older: Ref, fraction: Expr) -> Expr:
    """Return newer + fraction * (older - newer)."""
    return add(newer, multiply(fraction, subtract(older, newer)))


def _ring_index(delay: ContinuousDelay, newest: Ref, offset: int) -> Expr:
    """Return the index that lies `offset` places after the newest value in the ring buffer."""
    size = delay.whole_steps + 1
    last = Compare(">=", newest, integer(size - offset))
    return Select(last, subtract(newest, integer(size - offset)), add(newest, integer(offset)))


def _update_oldest(delay: ContinuousDelay) -> list[Op]:
    """Return the operations that copy the oldest records of a delay to far, middle and near.

    A delay of whole major steps does not need `near`.
    """
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
    """Return the operations that read a tunable delay and copy the records around it."""
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
    """Return the variables of the delays; `finalise_program` removes the unused ones.

    There is one set for all delays and one for each: a ring buffer of `whole_steps` + 1 values, its
    index, and those of `ContinuousDelay.variable_name`.
    """
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
    """Return an alarm for each different `after` and `every` in the guards of each mode.

    The variables are `memory.after_<n>` and `memory.every_<n>`, numbered from 1 over both. The
    times [s] are exact; `every` repeats. An `after` that is true from the entry on has no alarm.
    Raises SpecError if a time is not made of numbers and parameters.
    """
    found: list[Alarm] = []
    for mode in automaton.all_modes:
        for tree in _timer_calls(mode).values():
            time = _time_of(automaton, tree)
            if _is_always_true(automaton, tree):
                continue
            name = f"memory.{tree.function}_{len(found) + 1}"
            repeats = tree.function == "every"
            found.append(Alarm(name, mode.region, mode.number, time, repeats))
    return tuple(found)


def alarm_bindings(automaton: Automaton) -> Mapping[str, NameBindings]:
    """Return the conditions of `after` and `every`, by key path of mode, then memory key.

        after(d)    ->    true               if d is at most the tolerance of rule 10
        after(d)    ->    memory.after_<n>   else
        every(d)    ->    memory.every_<n>

    Each mode has an entry, which may be empty.
    """
    alarms = iter(alarms_of(automaton))
    return {
        mode.key: {
            key: Value(True) if _is_always_true(automaton, tree) else Ref(next(alarms).variable)
            for key, tree in _timer_calls(mode).items()
        }
        for mode in automaton.all_modes
    }


def _time_of(automaton: Automaton, tree: FunctionCall) -> Fraction:
    """Return the exact time [s] of an `after` or `every`."""
    return evaluate_exactly(Formula(tree.arguments[0], ""), automaton)


def _is_always_true(automaton: Automaton, tree: FunctionCall) -> bool:
    """Return whether a call is an `after` whose time has passed at the entry of its mode."""
    return tree.function == "after" and is_instantaneous(automaton, _time_of(automaton, tree))


def _timer_calls(mode: Mode) -> dict[str, FunctionCall]:
    """Return the different `after` and `every` calls in the guards of a mode, by memory key."""
    parts = [part for t in mode.transitions for part in walk(t.when.tree)]
    found = [
        part for part in parts if isinstance(part, FunctionCall) and part.function in TIME_FUNCTIONS
    ]
    return {memory_key(part): part for part in found}
