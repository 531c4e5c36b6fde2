"""Activation: what the guards of a sampled automaton remember since their mode was entered.

`rising` and `falling` have a truth value each: whether the opposite was seen at the tick before, in
the same activation. `changed` has the value of the tick before. `after` is a counter of ticks per
mode, `every` one that begins anew when it is full (rule 8).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from language.expressions.syntax_tree import EDGE_FUNCTIONS, FunctionCall, memory_key, walk
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
from language.model.analysis_cache import cache_on_owner
from language.model.automaton import Automaton, Mode


@dataclass(frozen=True)
class EdgeDetector:
    """A `rising`, `falling` or `changed` in the guards of a mode (its key path)."""

    number: int
    mode_key: str
    call: FunctionCall

    @property
    def armed_variable(self) -> str:
        """The variable: an earlier instant of this activation has what an edge needs."""
        return f"memory.opposite_{self.number}"

    @property
    def is_change(self) -> bool:
        """Tell whether any other value is an edge."""
        return self.call.function == "changed"


@dataclass(frozen=True)
class PeriodicTrigger:
    """An `every` in the guards of a mode: true at each `ticks`-th tick since its entry."""

    timer: str
    mode: Mode
    period_ticks: int


@cache_on_owner
def edge_detectors_of(automaton: Automaton) -> tuple[EdgeDetector, ...]:
    """Return the edges that the guards of each mode read."""
    found: dict[tuple[str, str], EdgeDetector] = {}
    for mode in automaton.all_modes:
        for part in _calls_in_guards(mode, EDGE_FUNCTIONS):
            key = mode.key, memory_key(part)
            found.setdefault(key, EdgeDetector(len(found) + 1, mode.key, part))
    return tuple(found.values())


@cache_on_owner
def edge_detectors_by_mode(automaton: Automaton) -> Mapping[str, list[EdgeDetector]]:
    """Return the edges by the key of the mode whose guards read them."""
    found: dict[str, list[EdgeDetector]] = {}
    for edge in edge_detectors_of(automaton):
        found.setdefault(edge.mode_key, []).append(edge)
    return found


def edge_value_type(automaton: Automaton, edge: EdgeDetector) -> ValueType:
    """Return the type of what an edge looks at."""
    return expression_type(automaton, edge.call.arguments[0])


def edge_value_ref(automaton: Automaton, edge: EdgeDetector, name: str) -> Ref:
    """Return a variable that holds what an edge looks at."""
    return Ref(name, edge_value_type(automaton, edge) == "whole")


def guard_memory_bindings(automaton: Automaton, mode: Mode) -> dict[str, Expr]:
    """Return what the edges and times of a mode's guards are."""
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
    for key, beat in _periodic_triggers(automaton).items():
        if key[0] == mode.key:
            found[key[1]] = Compare(">=", Ref(beat.timer), integer(beat.period_ticks))
    return found


def detect_edges(automaton: Automaton, mode: Mode, known: NameBindings) -> list[Op]:
    """Return the edges of now, and what they leave for the next tick."""
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
    """One more tick was spent in the mode."""
    for timer, mode, longest in _after_timers(automaton).values():
        yield Count(timer, _is_active(automaton, mode), longest, f"{automaton.name} {mode.key}")
    for beat in _periodic_triggers(automaton).values():
        count = Ref(beat.timer)
        full = Compare(">=", count, integer(beat.period_ticks))
        on = Assign(beat.timer, Select(full, integer(1), add(count, integer(1))))
        yield Branch(_is_active(automaton, beat.mode), (on,))


def reset_activation(automaton: Automaton, source: Mode, target: Mode) -> list[Op]:
    """Return what a transition forgets: the edges of its source; its target's time starts."""
    ops: list[Op] = [
        Assign(edge.armed_variable, Value(False))
        for edge in edge_detectors_by_mode(automaton).get(source.key, ())
    ]
    return [*ops, *start_timers(automaton, target)]


def start_timers(automaton: Automaton, target: Mode) -> list[Op]:
    """Return what starts the times in a mode that is entered."""
    timers = _after_timers(automaton)
    ops: list[Op] = []
    if target.key in timers:
        ops.append(Assign(timers[target.key][0], integer(0)))
    beats = [beat for beat in _periodic_triggers(automaton).values() if beat.mode.key == target.key]
    return [*ops, *(Assign(beat.timer, integer(0)) for beat in beats)]


def activation_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of edges and times."""
    found: list[Variable] = []
    for edge in edge_detectors_of(automaton):
        kind = edge_value_type(automaton, edge)
        seen = "value" if edge.is_change else "opposite"
        found.append(
            Variable(edge.armed_variable, "truth", about=f"{seen} seen in `{edge.mode_key}`")
        )
        about = "what is looked at for an edge"
        found.append(Variable(f"work.level_{edge.number}", kind, about=about))
        found.append(Variable(f"work.edge_{edge.number}", "truth", about="that edge is now"))
        if edge.is_change:
            about = f"value of the tick before in `{edge.mode_key}`"
            found.append(Variable(f"memory.last_{edge.number}", kind, about=about))
    for timer, mode, longest in _after_timers(automaton).values():
        about = f"ticks since entry of `{mode.name}`, at most {longest}"
        found.append(Variable(timer, "whole", about=about))
    for beat in _periodic_triggers(automaton).values():
        about = f"ticks in `{beat.mode.name}`, from 1 to {beat.period_ticks} in turn"
        found.append(Variable(beat.timer, "whole", about=about))
    return found


def _is_active(automaton: Automaton, mode: Mode) -> Expr:
    if automaton.statechart:
        node = next(node for node in automaton.statechart.nodes if node.mode_key == mode.key)
        return is_active(automaton.statechart, node, "memory.mode")
    return Compare("==", Ref(mode_variable("memory.mode", mode.region)), integer(mode.number))


@cache_on_owner
def _after_timers(automaton: Automaton) -> dict[str, tuple[str, Mode, int]]:
    """Return, by mode, the counter of its ticks and how far it counts."""
    found: dict[str, tuple[str, Mode, int]] = {}
    for mode in automaton.all_modes:
        afters = _calls_in_guards(mode, ("after",))
        longest = max((evaluate_ticks(automaton, part.arguments[0]) for part in afters), default=0)
        if longest:
            found[mode.key] = (f"timer.after_{len(found) + 1}", mode, longest)
    return found


@cache_on_owner
def _periodic_triggers(automaton: Automaton) -> dict[tuple[str, str], PeriodicTrigger]:
    """Return each different `every`, by the key of its mode and its own."""
    found: dict[tuple[str, str], PeriodicTrigger] = {}
    for mode in automaton.all_modes:
        for part in _calls_in_guards(mode, ("every",)):
            ticks = evaluate_ticks(automaton, part.arguments[0])
            beat = PeriodicTrigger(f"timer.every_{len(found) + 1}", mode, ticks)
            found.setdefault((mode.key, memory_key(part)), beat)
    return found


def _calls_in_guards(mode: Mode, functions: tuple[str, ...]) -> list[FunctionCall]:
    parts = [part for way in mode.transitions for part in walk(way.when.tree)]
    return [part for part in parts if isinstance(part, FunctionCall) and part.function in functions]
