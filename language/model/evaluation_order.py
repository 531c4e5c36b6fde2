"""Order: what reads what, so that each name comes after those that it reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

from language.expressions.syntax_tree import SyntaxTree, names
from language.model.analysis_cache import cache_on_owner
from language.model.automaton import Mode
from language.model.graphs import (
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
    """Return the names of a mode's equations so that each comes after those that it reads.

    Ties are broken by the order in the file. Raises SpecError naming an algebraic loop.
    """
    formulas = equation_formulas(mode)
    edges = reversed_edges(
        {name: [r for f in found for r in f.reads] for name, found in formulas.items()}
    )
    found = topological_sort(edges)
    if found is not None:
        return found
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
    """Report names whose values follow from each other in a circle."""
    cycle = find_cycle(_reader_edges({name: [tree] for name, tree in trees.items()}))
    if cycle:
        label = f"`{what}` values in a circle: {format_cycle(cycle)}"
        hint = "one of them is given by a value of its own" + _format_places(cycle, spans)
        problems.error("loop", spans[cycle[0]], label, hint)


def unreachable_modes(
    modes: Mapping[str, Mode], initial: str, ignored_keys: Set[str] = frozenset()
) -> list[str]:
    """Return the modes that no chain of transitions from the initial mode enters.

    The silent ones, by key path, never fire.
    """
    edges = {
        mode.name: [way.target for way in mode.transitions if way.key not in ignored_keys]
        for mode in modes.values()
    }
    found = reachable(edges, initial)
    return [name for name in modes if name not in found]


def _format_places(cycle: Sequence[str], spans: Mapping[str, Span]) -> str:
    return "".join(f"; `{name}` is at {spans[name]}" for name in cycle[1:])


def _reader_edges(trees: Mapping[str, Sequence[SyntaxTree]]) -> dict[str, list[str]]:
    """From each name to those that read it."""
    reads = {
        name: [read.path for tree in alternatives for read in names(tree)]
        for name, alternatives in trees.items()
    }
    return reversed_edges(reads)
