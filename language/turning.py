"""Turning: `rising` and `falling` in guards of a continuous automaton (rule 8).

The level of an edge is its argument, negated for `falling`. The edge is true while the level is
true and was not at the last instant of the same activation at which everything had happened:
`memory.level_n`, true on entry. A level that turns either way is an event of its own, so that an
edge does not depend on where the steps of the integration end.
"""

from __future__ import annotations

from collections.abc import Mapping

from language.lower import Names, expression
from language.memory import Edge, edges_by_mode, edges_of
from language.model import Automaton, Mode
from language.operation import Assign, Binary, Block, Compare, Expr, Op, Ref, Unary, Value
from language.program import Variable
from language.syntax import memory_key


def edge_names(automaton: Automaton) -> Mapping[str, Names]:
    """Return, by the key of a mode, what the edges in its guards are."""
    found: dict[str, dict[str, Expr]] = {mode.key: {} for mode in automaton.all_modes}
    for edge in edges_of(automaton):
        is_new = Binary("and", _level(edge), Unary("not", _last(edge)))
        found[edge.mode][memory_key(edge.tree)] = is_new
    return found


def levels(automaton: Automaton, mode: Mode, known: Names) -> list[Op]:
    """Return what sets the levels of a mode; those of the other modes of its region stay."""
    region = {other.key for other in automaton.region(mode.region).modes.values()}
    ops: list[Op] = []
    for edge in edges_of(automaton):
        if edge.mode == mode.key:
            level = expression(edge.tree.arguments[0], known)
            is_rising = edge.tree.function == "rising"
            ops.append(Assign(_level(edge).name, level if is_rising else Unary("not", level)))
        elif edge.mode in region:
            ops.append(Assign(_level(edge).name, _last(edge)))
    return ops


def turned(automaton: Automaton) -> list[Expr]:
    """Return, for each edge, whether its level is another than at the last instant."""
    return [Compare("!=", _level(edge), _last(edge)) for edge in edges_of(automaton)]


def settled(automaton: Automaton) -> Block:
    """Return what an instant leaves, when everything has happened."""
    return tuple(Assign(_last(edge).name, _level(edge)) for edge in edges_of(automaton))


def forgotten(automaton: Automaton, mode: Mode | None = None) -> Block:
    """Return what ends with an activation of a mode; of all modes at the start."""
    edges = edges_by_mode(automaton).get(mode.key, ()) if mode else edges_of(automaton)
    return tuple(Assign(_last(edge).name, Value(True)) for edge in edges)


def level_variables(automaton: Automaton) -> list[Variable]:
    """Return the variables of the edges."""
    found = []
    for edge in edges_of(automaton):
        about = f"level of an edge in `{edge.mode}` at the last instant, true on entry"
        found.append(Variable(_last(edge).name, "truth", about=about))
        found.append(Variable(_level(edge).name, "truth"))
    return found


def _level(edge: Edge) -> Ref:
    return Ref(f"work.level_{edge.number}")


def _last(edge: Edge) -> Ref:
    return Ref(f"memory.level_{edge.number}")
