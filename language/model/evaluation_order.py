"""Evaluation order: equations in the order of their dependences, and modes that are unreachable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

from language.expressions.syntax_tree import SyntaxTree, names
from language.ir.analysis_cache import cache_on_owner
from language.model.automaton import Mode
from language.model.graph_algorithms import (
    find_cycle,
    format_cycle,
    reachable,
    reversed_edges,
    topological_sort,
)
from language.model.region_queries import equation_formulas
from language.text.diagnostic import Problems, Span, SpecError


@cache_on_owner
def equation_order(mode: Mode) -> list[str]:
    """Return the names of the equations of a mode, each after the equations that it reads.

    Equations of its parallel regions are included; one of them depends on what any of its formulas
    reads. Ties are resolved by the order in the file. Raises SpecError of kind "loop" if there is
    an algebraic loop; the message names its members.
    """
    formulas = equation_formulas(mode)
    edges = reversed_edges(
        {
            name: [read for formula in alternatives for read in formula.reads]
            for name, alternatives in formulas.items()
        }
    )
    order = topological_sort(edges)
    if order is not None:
        return order
    cycle = find_cycle(edges)
    problems = Problems()
    label = f"an algebraic loop in mode `{mode.name}`: {format_cycle(cycle)}"
    spans = {name: alternatives[0].span for name, alternatives in formulas.items()}
    hint = "each reads the one before it at the same instant; one of them has to be a state"
    problems.error("loop", spans[cycle[0]], label, hint + _format_places(cycle, spans))
    raise SpecError(problems.reported)


def report_cycle(
    trees: Mapping[str, SyntaxTree], spans: Mapping[str, Span], what: str, problems: Problems
) -> None:
    """Report the first cycle among named expressions that read each other, if there is one.

    `what` is the key of the expressions, such as `initial`. The problem, of kind "loop", is placed
    at the span of the first member; only one cycle is reported.
    """
    cycle = find_cycle(_reader_edges({name: [tree] for name, tree in trees.items()}))
    if cycle:
        label = f"`{what}` values form a cycle: {format_cycle(cycle)}"
        hint = "give one of them a value of its own" + _format_places(cycle, spans)
        problems.error("loop", spans[cycle[0]], label, hint)


def unreachable_modes(
    modes: Mapping[str, Mode], initial: str, ignored_keys: Set[str] = frozenset()
) -> list[str]:
    """Return the modes of one region that no sequence of transitions from `initial` enters.

    They are in the order of `modes`; `initial` counts as entered. Guards and the transitions of
    superstates are not considered. `ignored_keys` are the key paths of transitions that never fire.
    """
    edges = {
        mode.name: [t.target for t in mode.transitions if t.key not in ignored_keys]
        for mode in modes.values()
    }
    reached = reachable(edges, initial)
    return [name for name in modes if name not in reached]


def _format_places(cycle: Sequence[str], spans: Mapping[str, Span]) -> str:
    """Return the places of all members of a cycle but the first, as text for a hint."""
    return "".join(f"; `{name}` is at {spans[name]}" for name in cycle[1:])


def _reader_edges(trees: Mapping[str, Sequence[SyntaxTree]]) -> dict[str, list[str]]:
    """Return the edges from each name to the names whose expressions read it."""
    reads = {
        name: [read.path for tree in alternatives for read in names(tree)]
        for name, alternatives in trees.items()
    }
    return reversed_edges(reads)
