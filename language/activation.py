"""Activation: what the guards of a sampled automaton remember since their mode was entered.

`rising` and `falling` have a truth value each: whether the opposite was seen at the tick before, in
the same activation. `changed` has the value of the tick before. `after` is a counter of ticks per
mode, `every` one that begins anew when it is full (rule 8).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from language.activity import is_active
from language.lower import Names, expression
from language.memory import ticks_of, type_of
from language.model import Automaton, Mode
from language.once import once
from language.operation import (
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
    whole,
)
from language.program import ValueType, Variable, mode_variable
from language.syntax import EDGES, Application, memory_key, walk


@dataclass(frozen=True)
class Edge:
    """A `rising`, `falling` or `changed` in the guards of a mode (its key path)."""

    number: int
    mode: str
    tree: Application

    @property
    def opposite(self) -> str:
        """The variable: an earlier instant of this activation has what an edge needs."""
        return f"memory.opposite_{self.number}"

    @property
    def is_change(self) -> bool:
        """Tell whether any other value is an edge."""
        return self.tree.function == "changed"


@dataclass(frozen=True)
class Beat:
    """An `every` in the guards of a mode: true at each `ticks`-th tick since its entry."""

    timer: str
    mode: Mode
    ticks: int


@once
def edges_of(automaton: Automaton) -> tuple[Edge, ...]:
    """Return the edges that the guards of each mode read."""
    found: dict[tuple[str, str], Edge] = {}
    for mode in automaton.all_modes:
        for part in _in_guards(mode, EDGES):
            key = mode.key, memory_key(part)
            found.setdefault(key, Edge(len(found) + 1, mode.key, part))
    return tuple(found.values())


@once
def edges_by_mode(automaton: Automaton) -> Mapping[str, list[Edge]]:
    """Return the edges by the key of the mode whose guards read them."""
    found: dict[str, list[Edge]] = {}
    for edge in edges_of(automaton):
        found.setdefault(edge.mode, []).append(edge)
    return found


def value_type_of(automaton: Automaton, edge: Edge) -> ValueType:
    """Return the type of what an edge looks at."""
    return type_of(automaton, edge.tree.arguments[0])


def value_of(automaton: Automaton, edge: Edge, name: str) -> Ref:
    """Return a variable that holds what an edge looks at."""
    return Ref(name, value_type_of(automaton, edge) == "whole")


def guard_names(automaton: Automaton, mode: Mode) -> dict[str, Expr]:
    """Return what the edges and times of a mode's guards are."""
    found: dict[str, Expr] = {}
    for edge in edges_by_mode(automaton).get(mode.key, ()):
        found[memory_key(edge.tree)] = Ref(f"work.edge_{edge.number}")
    timers = _timers(automaton)
    for part in _in_guards(mode, ("after",)):
        ticks = ticks_of(automaton, part.arguments[0])
        over: Expr = Value(True)
        if ticks:
            over = Compare(">=", Ref(timers[mode.key][0]), whole(ticks))
        found[memory_key(part)] = over
    for key, beat in _beats(automaton).items():
        if key[0] == mode.key:
            found[key[1]] = Compare(">=", Ref(beat.timer), whole(beat.ticks))
    return found


def watch_edges(automaton: Automaton, mode: Mode, known: Names) -> list[Op]:
    """Return the edges of now, and what they leave for the next tick."""
    ops: list[Op] = []
    for edge in edges_by_mode(automaton).get(mode.key, ()):
        level, seen = expression(edge.tree.arguments[0], known), Ref(edge.opposite)
        here = value_of(automaton, edge, f"work.level_{edge.number}")
        is_edge: Expr = Binary("and", here, seen)
        left = [Assign(seen.name, Unary("not", here))]
        if edge.is_change:
            last = value_of(automaton, edge, f"memory.last_{edge.number}")
            is_edge = Binary("and", seen, Compare("!=", here, last))
            left = [Assign(seen.name, Value(True)), Assign(last.name, here)]
        is_fall = edge.tree.function == "falling"
        ops.append(Assign(here.name, Unary("not", level) if is_fall else level))
        ops.append(Assign(f"work.edge_{edge.number}", is_edge))
        ops += left
    return ops


def elapse(automaton: Automaton) -> Iterator[Op]:
    """One more tick was spent in the mode."""
    for timer, mode, longest in _timers(automaton).values():
        yield Count(timer, _is_active(automaton, mode), longest, f"{automaton.name} {mode.key}")
    for beat in _beats(automaton).values():
        count = Ref(beat.timer)
        full = Compare(">=", count, whole(beat.ticks))
        on = Assign(beat.timer, Select(full, whole(1), add(count, whole(1))))
        yield Branch(_is_active(automaton, beat.mode), (on,))


def leave(automaton: Automaton, source: Mode, target: Mode) -> list[Op]:
    """Return what a transition forgets: the edges of its source; its target's time starts."""
    ops: list[Op] = [
        Assign(edge.opposite, Value(False)) for edge in edges_by_mode(automaton).get(source.key, ())
    ]
    return [*ops, *begin(automaton, target)]


def begin(automaton: Automaton, target: Mode) -> list[Op]:
    """Return what starts the times in a mode that is entered."""
    timers = _timers(automaton)
    ops: list[Op] = []
    if target.key in timers:
        ops.append(Assign(timers[target.key][0], whole(0)))
    beats = [beat for beat in _beats(automaton).values() if beat.mode.key == target.key]
    return [*ops, *(Assign(beat.timer, whole(0)) for beat in beats)]


def activation_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of edges and times."""
    found: list[Variable] = []
    for edge in edges_of(automaton):
        kind = value_type_of(automaton, edge)
        seen = "value" if edge.is_change else "opposite"
        found.append(Variable(edge.opposite, "truth", about=f"{seen} seen in `{edge.mode}`"))
        about = "what is looked at for an edge"
        found.append(Variable(f"work.level_{edge.number}", kind, about=about))
        found.append(Variable(f"work.edge_{edge.number}", "truth", about="that edge is now"))
        if edge.is_change:
            about = f"value of the tick before in `{edge.mode}`"
            found.append(Variable(f"memory.last_{edge.number}", kind, about=about))
    for timer, mode, longest in _timers(automaton).values():
        about = f"ticks since entry of `{mode.name}`, at most {longest}"
        found.append(Variable(timer, "whole", about=about))
    for beat in _beats(automaton).values():
        about = f"ticks in `{beat.mode.name}`, from 1 to {beat.ticks} in turn"
        found.append(Variable(beat.timer, "whole", about=about))
    return found


def _is_active(automaton: Automaton, mode: Mode) -> Expr:
    if automaton.tree:
        node = next(node for node in automaton.tree.nodes if node.mode == mode.key)
        return is_active(automaton.tree, node, "memory.mode")
    return Compare("==", Ref(mode_variable("memory.mode", mode.region)), whole(mode.number))


@once
def _timers(automaton: Automaton) -> dict[str, tuple[str, Mode, int]]:
    """Return, by mode, the counter of its ticks and how far it counts."""
    found: dict[str, tuple[str, Mode, int]] = {}
    for mode in automaton.all_modes:
        afters = _in_guards(mode, ("after",))
        longest = max((ticks_of(automaton, part.arguments[0]) for part in afters), default=0)
        if longest:
            found[mode.key] = (f"timer.after_{len(found) + 1}", mode, longest)
    return found


@once
def _beats(automaton: Automaton) -> dict[tuple[str, str], Beat]:
    """Return each different `every`, by the key of its mode and its own."""
    found: dict[tuple[str, str], Beat] = {}
    for mode in automaton.all_modes:
        for part in _in_guards(mode, ("every",)):
            ticks = ticks_of(automaton, part.arguments[0])
            beat = Beat(f"timer.every_{len(found) + 1}", mode, ticks)
            found.setdefault((mode.key, memory_key(part)), beat)
    return found


def _in_guards(mode: Mode, functions: tuple[str, ...]) -> list[Application]:
    parts = [part for way in mode.transitions for part in walk(way.when.tree)]
    return [part for part in parts if isinstance(part, Application) and part.function in functions]
