"""Continuous edge detection: `rising`, `falling` and `changed` (rule 8).

The level of an edge is its argument, negated for `falling`. An edge is true while the level is true
and was false at the last settled instant of the same activation. `memory.level_<n>` holds the level
of that instant and is true on entry. The level of `changed` is a value of any type; the edge is
true while it differs from the value of the last instant. On entry there is no such value, which
`memory.opposite_<n>` tells. Every change of a level is an event, so an edge does not depend on the
ends of the steps.
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
    """Return the conditions of edge calls in guards, by key path of the mode, then memory key.

    Each mode has an entry. An edge of `rising` and `falling` is `level and not last level`, one of
    `changed` is `level != last level` if there was a last instant.
    """
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
    """Return the operations that set `work.level_<n>` for the edges of a mode's region.

    Edges of the mode are evaluated with `known`; those of other modes of the region keep the value
    of the last instant. Edges of other regions have no operations.
    """
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
    """Return, for each edge of the automaton, the condition that its level has changed.

    It is compared with the level of the last settled instant.
    """
    return [_level_differs(automaton, edge) for edge in edge_detectors_of(automaton)]


def store_levels(automaton: Automaton) -> Block:
    """Return the assignments that store the levels of all edges at the end of a settled instant."""
    found = []
    for edge in edge_detectors_of(automaton):
        found.append(Assign(_last_level_ref(automaton, edge).name, _level_ref(automaton, edge)))
        if edge.is_change:
            found.append(Assign(edge.armed_variable, _is_watched_ref(edge)))
    return tuple(found)


def reset_levels(automaton: Automaton, mode: Mode | None = None) -> Block:
    """Return the assignments that clear the edge memory of a mode; None stands for all modes.

    The last level of `rising` and `falling` becomes true; `changed` has no last value.
    """
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
    """Return the variables of the edges: present and last level and, for `changed`, two flags."""
    found = []
    for edge in edge_detectors_of(automaton):
        kind = edge_value_type(automaton, edge)
        about = f"level of an edge in `{edge.mode_key}` at the last instant, true on entry"
        if edge.is_change:
            about = f"value of an edge in `{edge.mode_key}` at the last instant"
            seen = f"there was such an instant in `{edge.mode_key}`"
            found.append(Variable(edge.armed_variable, "truth", about=seen))
            found.append(Variable(_is_watched_ref(edge).name, "truth"))
        found.append(Variable(_last_level_ref(automaton, edge).name, kind, about=about))
        found.append(Variable(_level_ref(automaton, edge).name, kind))
    return found


def _level_differs(automaton: Automaton, edge: EdgeDetector) -> Expr:
    """Return the condition that the level of an edge differs from that of the last instant."""
    other = Compare("!=", _level_ref(automaton, edge), _last_level_ref(automaton, edge))
    return Binary("and", Ref(edge.armed_variable), other) if edge.is_change else other


def _level_ref(automaton: Automaton, edge: EdgeDetector) -> Ref:
    """Return the variable of the level at the instant that is evaluated."""
    return edge_value_ref(automaton, edge, f"work.level_{edge.number}")


def _last_level_ref(automaton: Automaton, edge: EdgeDetector) -> Ref:
    """Return the variable of the level at the last settled instant."""
    return edge_value_ref(automaton, edge, f"memory.level_{edge.number}")


def _is_watched_ref(edge: EdgeDetector) -> Ref:
    """Return the variable of whether the mode of an edge is the one that is evaluated."""
    return Ref(f"work.here_{edge.number}")
