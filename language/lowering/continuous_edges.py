"""Turning: `rising`, `falling` and `changed` in guards of a continuous automaton (rule 8).

The level of an edge is its argument, negated for `falling`. The edge is true while the level is
true and was not at the last instant of the same activation at which everything had happened:
`memory.level_n`, true on entry. Of `changed` it is any value, the edge is another one than that of
the last instant, of which there is none on entry: `memory.opposite_n`. A level that turns either
way is an event of its own, so that an edge does not depend on where the steps end.
"""

from __future__ import annotations

from collections.abc import Mapping

from language.expressions.syntax_tree import memory_key
from language.ir.ops import Assign, Binary, Block, Compare, Expr, Op, Ref, Unary, Value
from language.ir.program import Variable
from language.lowering.edge_detection import (
    EdgeDetector,
    edge_detectors_by_mode,
    edge_detectors_of,
    edge_value_ref,
    edge_value_type,
)
from language.lowering.expressions import NameBindings, lower_expression
from language.model.automaton import Automaton, Mode


def edge_bindings(automaton: Automaton) -> Mapping[str, NameBindings]:
    """Return, by the key of a mode, what the edges in its guards are."""
    found: dict[str, dict[str, Expr]] = {mode.key: {} for mode in automaton.all_modes}
    for edge in edge_detectors_of(automaton):
        is_new = _level_differs(automaton, edge)
        if not edge.is_change:
            is_new = Binary(
                "and", _level_ref(automaton, edge), Unary("not", _last_level_ref(automaton, edge))
            )
        found[edge.mode_key][memory_key(edge.call)] = is_new
    return found


def set_levels(automaton: Automaton, mode: Mode, known: NameBindings) -> list[Op]:
    """Return what sets the levels of a mode; those of the other modes of its region stay."""
    region = {other.key for other in automaton.region(mode.region).modes.values()}
    ops: list[Op] = []
    for edge in edge_detectors_of(automaton):
        target = _level_ref(automaton, edge).name
        if edge.mode_key == mode.key:
            level = lower_expression(edge.call.arguments[0], known)
            is_fall = edge.call.function == "falling"
            ops.append(Assign(target, Unary("not", level) if is_fall else level))
        elif edge.mode_key in region:
            ops.append(Assign(target, _last_level_ref(automaton, edge)))
        if edge.is_change and edge.mode_key in region:
            ops.append(Assign(_is_watched_ref(edge).name, Value(edge.mode_key == mode.key)))
    return ops


def level_change_conditions(automaton: Automaton) -> list[Expr]:
    """Return, for each edge, whether its level is another than at the last instant."""
    return [_level_differs(automaton, edge) for edge in edge_detectors_of(automaton)]


def store_levels(automaton: Automaton) -> Block:
    """Return what an instant leaves, when everything has happened."""
    found = []
    for edge in edge_detectors_of(automaton):
        found.append(Assign(_last_level_ref(automaton, edge).name, _level_ref(automaton, edge)))
        if edge.is_change:
            found.append(Assign(edge.armed_variable, _is_watched_ref(edge)))
    return tuple(found)


def reset_levels(automaton: Automaton, mode: Mode | None = None) -> Block:
    """Return what ends with an activation of a mode; of all modes at the start."""
    edges = (
        edge_detectors_by_mode(automaton).get(mode.key, ())
        if mode
        else edge_detectors_of(automaton)
    )
    return tuple(
        Assign(edge.armed_variable, Value(False))
        if edge.is_change
        else Assign(_last_level_ref(automaton, edge).name, Value(True))
        for edge in edges
    )


def level_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of the edges."""
    found = []
    for edge in edge_detectors_of(automaton):
        kind = edge_value_type(automaton, edge)
        about = f"level of an edge in `{edge.mode_key}` at the last instant, true on entry"
        if edge.is_change:
            about = f"value looked at in `{edge.mode_key}` at the last instant"
            seen = f"there was such an instant in `{edge.mode_key}`"
            found.append(Variable(edge.armed_variable, "truth", about=seen))
            found.append(Variable(_is_watched_ref(edge).name, "truth"))
        found.append(Variable(_last_level_ref(automaton, edge).name, kind, about=about))
        found.append(Variable(_level_ref(automaton, edge).name, kind))
    return found


def _level_differs(automaton: Automaton, edge: EdgeDetector) -> Expr:
    other = Compare("!=", _level_ref(automaton, edge), _last_level_ref(automaton, edge))
    return Binary("and", Ref(edge.armed_variable), other) if edge.is_change else other


def _level_ref(automaton: Automaton, edge: EdgeDetector) -> Ref:
    return edge_value_ref(automaton, edge, f"work.level_{edge.number}")


def _last_level_ref(automaton: Automaton, edge: EdgeDetector) -> Ref:
    return edge_value_ref(automaton, edge, f"memory.level_{edge.number}")


def _is_watched_ref(edge: EdgeDetector) -> Ref:
    return Ref(f"work.here_{edge.number}")
