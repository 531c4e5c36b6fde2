"""Edge detection and activation timers of guards in a sampled automaton (rule 8).

`rising` and `falling` store one truth value: whether the opposite level was present at the previous
tick of the same activation of the mode. `changed` stores the value of the previous tick. `after` is
a counter of ticks for each mode; `every` is a counter that restarts at its period.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from language.expressions.syntax_tree import EDGE_FUNCTIONS, FunctionCall, memory_key, walk
from language.ir.analysis_cache import cache_on_owner
from language.ir.ops import (
    Assign,
    Binary,
    Branch,
    Compare,
    Count,
    Expr,
    Op,
    Ref,
    Select,
    Unary,
    Value,
    add,
    integer,
)
from language.ir.program import ValueType, Variable, mode_variable
from language.lowering.chart_activity import is_active
from language.lowering.delay_buffers import evaluate_ticks, expression_type
from language.lowering.expressions import NameBindings, lower_expression
from language.model.automaton import Automaton, Mode


@dataclass(frozen=True)
class EdgeDetector:
    """A call of `rising`, `falling` or `changed` in the guards of a mode, given by its key path."""

    number: int
    mode_key: str
    call: FunctionCall

    @property
    def armed_variable(self) -> str:
        """The variable `memory.opposite_<number>`: an edge is possible now.

        An earlier tick of this activation had the opposite level or, for `changed`, any value.
        """
        return f"memory.opposite_{self.number}"

    @property
    def is_change(self) -> bool:
        """Whether the call is `changed`, for which each different value is an edge."""
        return self.call.function == "changed"


@dataclass(frozen=True)
class PeriodicTrigger:
    """A call of `every` in the guards of a mode: true each `period_ticks` ticks after its entry."""

    timer: str
    mode: Mode
    period_ticks: int


@cache_on_owner
def edge_detectors_of(automaton: Automaton) -> tuple[EdgeDetector, ...]:
    """Return the different edge calls in the guards of each mode, numbered from 1.

    Equal calls in two modes are two detectors. Truth tables are not searched.
    """
    found: dict[tuple[str, str], EdgeDetector] = {}
    for mode in automaton.all_modes:
        for part in _calls_in_guards(mode, EDGE_FUNCTIONS):
            key = mode.key, memory_key(part)
            found.setdefault(key, EdgeDetector(len(found) + 1, mode.key, part))
    return tuple(found.values())


@cache_on_owner
def edge_detectors_by_mode(automaton: Automaton) -> Mapping[str, list[EdgeDetector]]:
    """Return the edge detectors by the key path of their mode; modes without any are left out."""
    found: dict[str, list[EdgeDetector]] = {}
    for edge in edge_detectors_of(automaton):
        found.setdefault(edge.mode_key, []).append(edge)
    return found


def edge_value_type(automaton: Automaton, edge: EdgeDetector) -> ValueType:
    """Return the value type of the argument of an edge call."""
    return expression_type(automaton, edge.call.arguments[0])


def edge_value_ref(automaton: Automaton, edge: EdgeDetector, name: str) -> Ref:
    """Return the reference to a variable `name` of the type of an edge call's argument.

    It is a whole-number reference for an int or an enumeration.
    """
    return Ref(name, edge_value_type(automaton, edge) == "whole")


def guard_memory_bindings(automaton: Automaton, mode: Mode) -> dict[str, Expr]:
    """Return the conditions of the edge, `after` and `every` calls in a mode's guards.

    The keys are the memory keys of the calls. An edge is `work.edge_<n>`; `after` and `every`
    compare the counter of ticks with their time. `after` of a time of 0 ticks is true.
    """
    found: dict[str, Expr] = {}
    for edge in edge_detectors_by_mode(automaton).get(mode.key, ()):
        found[memory_key(edge.call)] = Ref(f"work.edge_{edge.number}")
    timers = _after_timers(automaton)
    for part in _calls_in_guards(mode, ("after",)):
        ticks = evaluate_ticks(automaton, part.arguments[0])
        over: Expr = Value(True)
        if ticks:
            over = Compare(">=", Ref(timers[mode.key][0]), integer(ticks))
        found[memory_key(part)] = over
    for key, trigger in _periodic_triggers(automaton).items():
        if key[0] == mode.key:
            found[key[1]] = Compare(">=", Ref(trigger.timer), integer(trigger.period_ticks))
    return found


def detect_edges(automaton: Automaton, mode: Mode, known: NameBindings) -> list[Op]:
    """Return the operations that set `work.edge_<n>` of a mode's edges and store their levels.

    `known` has the names that the arguments read. `changed` needs a value of an earlier tick of
    this activation that differs; the others need the opposite level then.
    """
    ops: list[Op] = []
    for edge in edge_detectors_by_mode(automaton).get(mode.key, ()):
        level, seen = lower_expression(edge.call.arguments[0], known), Ref(edge.armed_variable)
        here = edge_value_ref(automaton, edge, f"work.level_{edge.number}")
        is_edge: Expr = Binary("and", here, seen)
        left = [Assign(seen.name, Unary("not", here))]
        if edge.is_change:
            last = edge_value_ref(automaton, edge, f"memory.last_{edge.number}")
            is_edge = Binary("and", seen, Compare("!=", here, last))
            left = [Assign(seen.name, Value(True)), Assign(last.name, here)]
        is_fall = edge.call.function == "falling"
        ops.append(Assign(here.name, Unary("not", level) if is_fall else level))
        ops.append(Assign(f"work.edge_{edge.number}", is_edge))
        ops += left
    return ops


def count_ticks(automaton: Automaton) -> Iterator[Op]:
    """Yield the operations that count a tick for each `after` and `every` whose mode is active.

        after    timer.after_n += 1 if its mode is active, up to the longest time of that mode
        every    timer.every_n = 1 if timer.every_n >= period else timer.every_n + 1

    The counter of `after` is set to 0 while its mode is not active; that of `every` is unchanged.
    All modes of the automaton are included.
    """
    for timer, mode, longest in _after_timers(automaton).values():
        yield Count(timer, _is_active(automaton, mode), longest, f"{automaton.name} {mode.key}")
    for trigger in _periodic_triggers(automaton).values():
        count = Ref(trigger.timer)
        full = Compare(">=", count, integer(trigger.period_ticks))
        on = Assign(trigger.timer, Select(full, integer(1), add(count, integer(1))))
        yield Branch(_is_active(automaton, trigger.mode), (on,))


def reset_activation(automaton: Automaton, source: Mode, target: Mode) -> list[Op]:
    """Return the operations that disarm the edges of `source` and start the timers of `target`."""
    ops: list[Op] = [
        Assign(edge.armed_variable, Value(False))
        for edge in edge_detectors_by_mode(automaton).get(source.key, ())
    ]
    return [*ops, *start_timers(automaton, target)]


def start_timers(automaton: Automaton, target: Mode) -> list[Op]:
    """Return the operations that set the `after` and `every` counters of an entered mode to 0.

    The list is empty for a mode whose guards have neither.
    """
    timers = _after_timers(automaton)
    ops: list[Op] = []
    if target.key in timers:
        ops.append(Assign(timers[target.key][0], integer(0)))
    triggers = [
        trigger
        for trigger in _periodic_triggers(automaton).values()
        if trigger.mode.key == target.key
    ]
    return [*ops, *(Assign(trigger.timer, integer(0)) for trigger in triggers)]


def activation_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of edge detectors and of the counters of `after` and `every`.

    An edge has `memory.opposite_<n>`, `work.level_<n>`, `work.edge_<n>` and, for `changed`,
    `memory.last_<n>`.
    """
    found: list[Variable] = []
    for edge in edge_detectors_of(automaton):
        kind = edge_value_type(automaton, edge)
        seen = "value" if edge.is_change else "opposite"
        found.append(
            Variable(edge.armed_variable, "truth", about=f"{seen} seen in `{edge.mode_key}`")
        )
        about = "level whose edge is detected"
        found.append(Variable(f"work.level_{edge.number}", kind, about=about))
        found.append(Variable(f"work.edge_{edge.number}", "truth", about="edge in this tick"))
        if edge.is_change:
            about = f"value of the tick before in `{edge.mode_key}`"
            found.append(Variable(f"memory.last_{edge.number}", kind, about=about))
    for timer, mode, longest in _after_timers(automaton).values():
        about = f"ticks since entry of `{mode.name}`, at most {longest}"
        found.append(Variable(timer, "whole", about=about, largest=longest))
    for trigger in _periodic_triggers(automaton).values():
        about = f"ticks in `{trigger.mode.name}`, from 1 to {trigger.period_ticks} in turn"
        found.append(Variable(trigger.timer, "whole", about=about, largest=trigger.period_ticks))
    return found


def _is_active(automaton: Automaton, mode: Mode) -> Expr:
    """Return the condition that a mode is active."""
    if automaton.statechart:
        node = next(node for node in automaton.statechart.nodes if node.mode_key == mode.key)
        return is_active(automaton.statechart, node, "memory.mode")
    return Compare("==", Ref(mode_variable("memory.mode", mode.region)), integer(mode.number))


@cache_on_owner
def _after_timers(automaton: Automaton) -> dict[str, tuple[str, Mode, int]]:
    """Return, by the key path of a mode, its counter, the mode and the longest `after` in ticks.

    Modes without an `after` of at least one tick are left out.
    """
    found: dict[str, tuple[str, Mode, int]] = {}
    for mode in automaton.all_modes:
        afters = _calls_in_guards(mode, ("after",))
        longest = max((evaluate_ticks(automaton, part.arguments[0]) for part in afters), default=0)
        if longest:
            found[mode.key] = (f"timer.after_{len(found) + 1}", mode, longest)
    return found


@cache_on_owner
def _periodic_triggers(automaton: Automaton) -> dict[tuple[str, str], PeriodicTrigger]:
    """Return each different `every` by the key path of its mode and its memory key."""
    found: dict[tuple[str, str], PeriodicTrigger] = {}
    for mode in automaton.all_modes:
        for part in _calls_in_guards(mode, ("every",)):
            ticks = evaluate_ticks(automaton, part.arguments[0])
            trigger = PeriodicTrigger(f"timer.every_{len(found) + 1}", mode, ticks)
            found.setdefault((mode.key, memory_key(part)), trigger)
    return found


def _calls_in_guards(mode: Mode, functions: tuple[str, ...]) -> list[FunctionCall]:
    """Return the calls of some functions in the guards of a mode, in order, with repetitions."""
    parts = [part for transition in mode.transitions for part in walk(transition.when.tree)]
    return [part for part in parts if isinstance(part, FunctionCall) and part.function in functions]
