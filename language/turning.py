"""Turning: `rising`, `falling` and `changed` in guards of a continuous automaton (rule 8).

The level of an edge is its argument, negated for `falling`. The edge is true while the level is
true and was not at the last instant of the same activation at which everything had happened:
`memory.level_n`, true on entry. Of `changed` it is any value, the edge is another one than that of
the last instant, of which there is none on entry: `memory.opposite_n`. A level that turns either
way is an event of its own, so that an edge does not depend on where the steps end.
"""

from __future__ import annotations

from collections.abc import Mapping

from language.activation import Edge, edges_by_mode, edges_of, value_of, value_type_of
from language.lower import Names, expression
from language.model import Automaton, Mode
from language.operation import Assign, Binary, Block, Compare, Expr, Op, Ref, Unary, Value
from language.program import Variable
from language.syntax import memory_key


def edge_names(automaton: Automaton) -> Mapping[str, Names]:
    """Return, by the key of a mode, what the edges in its guards are."""
    found: dict[str, dict[str, Expr]] = {mode.key: {} for mode in automaton.all_modes}
    for edge in edges_of(automaton):
        is_new = _is_other(automaton, edge)
        if not edge.is_change:
            is_new = Binary("and", _level(automaton, edge), Unary("not", _last(automaton, edge)))
        found[edge.mode][memory_key(edge.tree)] = is_new
    return found


def levels(automaton: Automaton, mode: Mode, known: Names) -> list[Op]:
    """Return what sets the levels of a mode; those of the other modes of its region stay."""
    region = {other.key for other in automaton.region(mode.region).modes.values()}
    ops: list[Op] = []
    for edge in edges_of(automaton):
        target = _level(automaton, edge).name
        if edge.mode == mode.key:
            level = expression(edge.tree.arguments[0], known)
            is_fall = edge.tree.function == "falling"
            ops.append(Assign(target, Unary("not", level) if is_fall else level))
        elif edge.mode in region:
            ops.append(Assign(target, _last(automaton, edge)))
        if edge.is_change and edge.mode in region:
            ops.append(Assign(_here(edge).name, Value(edge.mode == mode.key)))
    return ops


def turned(automaton: Automaton) -> list[Expr]:
    """Return, for each edge, whether its level is another than at the last instant."""
    return [_is_other(automaton, edge) for edge in edges_of(automaton)]


def settled(automaton: Automaton) -> Block:
    """Return what an instant leaves, when everything has happened."""
    found = []
    for edge in edges_of(automaton):
        found.append(Assign(_last(automaton, edge).name, _level(automaton, edge)))
        if edge.is_change:
            found.append(Assign(edge.opposite, _here(edge)))
    return tuple(found)


def forgotten(automaton: Automaton, mode: Mode | None = None) -> Block:
    """Return what ends with an activation of a mode; of all modes at the start."""
    edges = edges_by_mode(automaton).get(mode.key, ()) if mode else edges_of(automaton)
    return tuple(
        Assign(edge.opposite, Value(False))
        if edge.is_change
        else Assign(_last(automaton, edge).name, Value(True))
        for edge in edges
    )


def level_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of the edges."""
    found = []
    for edge in edges_of(automaton):
        kind = value_type_of(automaton, edge)
        about = f"level of an edge in `{edge.mode}` at the last instant, true on entry"
        if edge.is_change:
            about = f"value looked at in `{edge.mode}` at the last instant"
            seen = f"there was such an instant in `{edge.mode}`"
            found.append(Variable(edge.opposite, "truth", about=seen))
            found.append(Variable(_here(edge).name, "truth"))
        found.append(Variable(_last(automaton, edge).name, kind, about=about))
        found.append(Variable(_level(automaton, edge).name, kind))
    return found


def _is_other(automaton: Automaton, edge: Edge) -> Expr:
    other = Compare("!=", _level(automaton, edge), _last(automaton, edge))
    return Binary("and", Ref(edge.opposite), other) if edge.is_change else other


def _level(automaton: Automaton, edge: Edge) -> Ref:
    return value_of(automaton, edge, f"work.level_{edge.number}")


def _last(automaton: Automaton, edge: Edge) -> Ref:
    return value_of(automaton, edge, f"memory.level_{edge.number}")


def _here(edge: Edge) -> Ref:
    return Ref(f"work.here_{edge.number}")
