"""The major step of a continuous automaton, from event to event (rules 1, 4d and 7 to 12).

The block `step` is X_Step in C: it integrates over the step under the inputs of the previous step,
then latches the present inputs and takes the transitions that they enable. The engine runs the same
blocks one by one, so it observes each event and computes the same bits:

    limit         set `work.h` to the rest of the step, or to the earliest end of a wait
    flow          (continuous_program.py) integrate over `work.h` or up to the first crossing
    advance_time  subtract the elapsed time from `work.left` and the waits; set `work.event`
    macro_step    run micro-steps until no transition is enabled
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction

from language.integration.vector_field import VectorField, run_block_by_mode
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Expr,
    FaultBit,
    Loop,
    Op,
    Ref,
    RunBlock,
    Switch,
    Unary,
    Value,
    add,
    multiply,
    real,
    subtract,
)
from language.ir.program import Alarm, TransitionInfo, Variable
from language.ir.traversal import names_used, reachable_blocks
from language.lowering.event_tolerance import merge_time
from language.lowering.expressions import WHOLE_TYPES
from language.lowering.program_builder import any_fired_condition, clear_fired
from language.model.automaton import Mode

MAX_EVENTS_PER_STEP = 100
"""The largest number of located events in a major step; more are Zeno behaviour (rule 12)."""
ZENO = "zeno"
"""The fault bit of a major step with too many events."""
LIVELOCK = "livelock"
"""The fault bit of a cycle of transitions at one instant."""


@dataclass(frozen=True)
class WaitTimer:
    """A timer that runs down while a mode of a region is active.

    The timer of a wait starts when the guard of its transition becomes true; those of `after` and
    `every` start on entry. `duration` is in s. `is_running` is the condition under which it runs;
    `on_begin` and `on_end` are the operations at its start and end. `is_restarted` marks a wait,
    which returns to its start when its guard is false or its mode is left.
    """

    timer: str
    duration: Fraction
    region: str
    mode: int
    is_running: Expr
    on_end: Block
    on_begin: Block
    is_restarted: bool

    @property
    def restart(self) -> Assign:
        """The assignment that sets the timer to its duration [s]."""
        return Assign(self.timer, real(self.duration))


WaitTimers = tuple[WaitTimer, ...]


def wait_timers_of(infos: tuple[TransitionInfo, ...], alarms: tuple[Alarm, ...]) -> WaitTimers:
    """Return the timers of transitions with a wait, then those of `after` and `every`.

    The k-th alarm has `timer.after_<k>`, from 1, also for `every`.
    """
    found = []
    for info in infos:
        if info.timer:
            armed = Ref(f"memory.armed_{info.slot}")
            place = (info.timer, info.wait, info.region, info.source)
            found.append(WaitTimer(*place, armed, (Assign(info.timer, real(0.0)),), (), True))
    for number, alarm in enumerate(alarms, start=1):
        set_alarm, clear_alarm = (Assign(alarm.variable, Value(value)) for value in (True, False))
        timer = f"timer.after_{number}"
        end: Block = (set_alarm,)
        if alarm.repeats:
            end = (set_alarm, Assign(timer, add(Ref(timer), real(alarm.time))))
        place = (timer, alarm.time, alarm.region, alarm.mode)
        is_running = Unary("not", Ref(alarm.variable))
        found.append(WaitTimer(*place, is_running, end, (clear_alarm,), False))
    return tuple(found)


BlocksByMode = Mapping[tuple[str, int], Block]
"""Blocks by the name of a region and the number of a mode in it."""


def begin_blocks(waits: WaitTimers) -> BlocksByMode:
    """Return the operations on entry of each mode that start its timers, by region and mode.

    Modes without timers are left out.
    """
    found: dict[tuple[str, int], list[Op]] = {}
    for wait in waits:
        found.setdefault((wait.region, wait.mode), []).extend((*wait.on_begin, wait.restart))
    return {place: tuple(ops) for place, ops in found.items()}


def end_blocks(waits: WaitTimers) -> BlocksByMode:
    """Return the operations on exit of each mode that restart its waits (rule 4).

    Keys are region and number of the mode; `after` and `every` are left out.
    """
    found: dict[tuple[str, int], list[Op]] = {}
    for wait in waits:
        if wait.is_restarted:
            found.setdefault((wait.region, wait.mode), []).append(wait.restart)
    return {place: tuple(ops) for place, ops in found.items()}


def block_of_mode(blocks: BlocksByMode, mode: Mode) -> Block:
    """Return the block of a mode; empty if it has none."""
    return blocks.get((mode.region, mode.number), ())


def major_step_blocks(
    field: VectorField, waits: WaitTimers, age_variables: tuple[str, ...]
) -> dict[str, Block]:
    """Return the blocks of a major step, by name.

    They are `latch` (present inputs to `before.<name>`), `limit`, `advance_time`, `restart_waits`
    (waits whose guard is false), `macro_step` and `segment`: limit, flow, time and, if an event
    happened before the end of the step, a macro-step. `age_variables` [s] are the times since a
    record at a major step; `advance_time` increases them.
    """
    inputs = field.automaton.inputs
    return {
        "latch": tuple(Assign(f"before.{name}", Ref(f"input.{name}")) for name in inputs),
        "limit": _limit_block(field, waits),
        "advance_time": _advance_time_block(field, waits, age_variables),
        "restart_waits": _for_each_wait(
            field, tuple(w for w in waits if w.is_restarted), _restart_if_idle
        ),
        "macro_step": _macro_step_block(field),
        "segment": _segment_block(field),
    }


def major_step_variables(waits: WaitTimers) -> list[Variable]:
    """Return the timers of the waits and the other variables of the blocks of a major step."""
    return [
        *(Variable(wait.timer, "real", "s", about="rest of the wait") for wait in waits),
        Variable("memory.started", "truth", about="the first step is done"),
        Variable("memory.time", "real", "s", about="time since the start: for tolerances only"),
        Variable("memory.faults", "whole", about="latched fault bits"),
        Variable("work.left", "real", "s", about="rest of the major step"),
        Variable("work.is_wait", "truth", about="a wait ends with the segment"),
        Variable("work.event", "truth", about="a guard changed or a wait ended"),
        Variable("work.in_macro_step", "truth"),
        Variable("work.micro_step", "whole"),
        Variable("work.piece", "whole"),
    ]


def is_wait_over(info: TransitionInfo) -> Expr:
    """Return the condition that the wait of a transition is over: its timer is at most 0.

    The transition has to have a timer.
    """
    assert info.timer
    return Compare("<=", Ref(info.timer), real(0.0))


def _limit_block(field: VectorField, waits: WaitTimers) -> Block:
    """Return the block that sets `work.h` to the rest of the step or to the end of a wait.

    A wait that ends within `work.merge` after the rest of the step counts as ending with it.
    """
    h = Ref("work.h")

    def limit_to_timer(wait: WaitTimer) -> Block:
        """Return the operations that shorten the segment to the end of a running timer."""
        timer = Ref(wait.timer)
        near = Compare("<=", timer, add(h, Ref("work.merge")))
        ends = Binary("and", wait.is_running, near)
        nearer = Assign(h.name, Call("min", (timer, h)))
        return (Branch(ends, (nearer, Assign("work.is_wait", Value(True)))),)

    return (
        Assign(h.name, Ref("work.left")),
        Assign("work.merge", _merge_window(field)),
        Assign("work.is_wait", Value(False)),
        *_for_each_wait(field, waits, limit_to_timer),
    )


def _merge_window(field: VectorField) -> Expr:
    """Return the time [s] within which events are one instant (rule 10).

    In float64 it grows with the time since the start; in float32 it is a part of the step.
    """
    step, numbers = field.automaton.step, field.automaton.numbers
    if numbers == "float32":
        return real(merge_time(numbers, step))
    end = add(Ref("memory.time"), Ref("work.h"))
    per_second = real(merge_time(numbers, Fraction(1)))
    return multiply(per_second, Call("max", (end, real(step))))


def _advance_time_block(
    field: VectorField, waits: WaitTimers, age_variables: tuple[str, ...]
) -> Block:
    """Return the block that advances time by `work.elapsed`.

    Events within `work.merge` [s] of the end of the segment are at the same instant (rule 10).
    """
    elapsed, left = Ref("work.elapsed"), Ref("work.left")
    h, merge = Ref("work.h"), Ref("work.merge")
    near = Binary("and", Ref("work.crossed"), Compare("<=", subtract(h, elapsed), merge))

    def count_down(wait: WaitTimer) -> Block:
        """Return the operations that count a running timer down and detect its end."""
        timer = Ref(wait.timer)
        over = Branch(
            Compare("<=", timer, merge), (*wait.on_end, Assign("work.event", Value(True)))
        )
        return (Branch(wait.is_running, (Assign(timer.name, subtract(timer, elapsed)), over)),)

    return (
        Branch(near, (Assign("work.elapsed", h),)),
        Assign("work.event", Ref("work.crossed")),
        Assign(left.name, subtract(left, elapsed)),
        Branch(Compare("<=", left, merge), (Assign(left.name, real(0.0)),)),
        Assign("memory.time", add(Ref("memory.time"), elapsed)),
        *(Assign(name, add(Ref(name), elapsed)) for name in age_variables),
        *_for_each_wait(field, waits, count_down),
    )


def _restart_if_idle(wait: WaitTimer) -> Block:
    """Return the operation that restarts a wait while its guard is false (rule 4)."""
    return (Branch(wait.is_running, (), (wait.restart,)),)


def _macro_step_block(field: VectorField) -> Block:
    """Return the block that runs micro-steps until none fires.

    As many micro-steps as the regions have modes may fire; one more sets the fault bit `livelock`
    (rule 7).
    """
    regions = field.automaton.all_regions
    bound = sum(len(region.modes) for region in regions)
    going = Ref("work.in_macro_step")
    fired = any_fired_condition(field.automaton)
    micro_step: Block = (Branch(going, (RunBlock("jump"), Assign(going.name, fired))),)
    return (
        Assign(going.name, Value(True)),
        Loop(bound + 1, "work.micro_step", micro_step),
        Branch(going, (FaultBit(LIVELOCK), *clear_fired(field.automaton))),
        RunBlock("evaluate_guards"),
    )


def _segment_block(field: VectorField) -> Block:
    """Return the block of one segment of a major step, up to an event or the end."""
    inside = Binary("and", Ref("work.event"), Compare(">", Ref("work.left"), real(0.0)))
    return (
        RunBlock("limit"),
        run_block_by_mode(field, "flow"),
        RunBlock("advance_time"),
        Branch(inside, (RunBlock("macro_step"),)),
    )


def major_step_block(field: VectorField, has_record: bool, blocks: Mapping[str, Block]) -> Block:
    """Return the block `step`; `blocks` are the blocks that it runs.

    The first call latches the inputs and starts the automaton. Later calls record (if
    `has_record`), integrate in at most MAX_EVENTS_PER_STEP + 1 segments (else the fault bit `zeno`
    is set) and then latch. A macro-step follows at the start, after an event at the end and if an
    input that it reads has changed. The equations come last.
    """
    left, event = Ref("work.left"), Ref("work.event")
    is_left = Compare(">", left, real(0.0))
    segments = Loop(
        MAX_EVENTS_PER_STEP + 1, "work.piece", (Branch(is_left, (RunBlock("segment"),)),)
    )
    flow: Block = (
        *((RunBlock("record"),) if has_record else ()),
        Assign(left.name, real(field.automaton.step)),
        Assign(event.name, Value(False)),
        segments,
        Branch(is_left, (FaultBit(ZENO),)),
        *_detect_input_change(field, event, blocks),
        RunBlock("latch"),
    )
    enter: Block = (RunBlock("latch"), RunBlock("start"), Assign(event.name, Value(True)))
    return (
        Branch(Ref("memory.started"), flow, enter),
        Branch(event, (RunBlock("macro_step"),)),
        RunBlock("equations"),
    )


def _detect_input_change(field: VectorField, event: Ref, blocks: Mapping[str, Block]) -> Block:
    """Return the operation that requests `macro_step` if an input has changed that it reads.

    It is empty if `macro_step` reads no input.
    """
    due: Expr = event
    read = names_used(blocks[name] for name in reachable_blocks("macro_step", blocks))
    for name, thing in field.automaton.inputs.items():
        if f"before.{name}" not in read:
            continue
        is_whole = thing.type in WHOLE_TYPES
        now, before = Ref(f"input.{name}", is_whole), Ref(f"before.{name}", is_whole)
        due = Binary("or", due, Compare("!=", now, before))
    return () if due == event else (Assign(event.name, due),)


def _for_each_wait(
    field: VectorField, waits: WaitTimers, block_of: Callable[[WaitTimer], Block]
) -> tuple[Switch, ...]:
    """Return a Switch for each region with timers, which runs the blocks of its active mode.

    `block_of` gives the block of one timer.
    """
    found = []
    for region in field.automaton.all_regions:
        cases: dict[int, Block] = {}
        for wait in waits:
            if wait.region == region.name:
                cases[wait.mode] = (*cases.get(wait.mode, ()), *block_of(wait))
        if cases:
            found.append(Switch(field.mode_variable_of(region.name), tuple(cases.items())))
    return tuple(found)
