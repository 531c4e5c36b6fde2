"""Order: what reads what, so that each name comes after those that it reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

from language.graph import chain, circle, reachable, topological, turned
from language.model import Mode
from language.once import once
from language.problem import Problems, Span, SpecError
from language.region import sources
from language.syntax import Tree, names


@once
def equation_order(mode: Mode) -> list[str]:
    """Return the names of a mode's equations so that each comes after those that it reads.

    Ties are broken by the order in the file. Raises SpecError naming an algebraic loop.
    """
    formulas = sources(mode)
    edges = turned({name: [r for f in found for r in f.reads] for name, found in formulas.items()})
    found = topological(edges)
    if found is not None:
        return found
    loop = circle(edges)
    problems = Problems()
    label = f"an algebraic loop in mode `{mode.name}`: {chain(loop)}"
    spans = {name: alternatives[0].span for name, alternatives in formulas.items()}
    hint = "each reads the one before it at the same instant; one of them has to be a state"
    problems.error("loop", spans[loop[0]], label, hint + _places(loop, spans))
    raise SpecError(problems.found)


def report_circle(
    trees: Mapping[str, Tree], spans: Mapping[str, Span], what: str, problems: Problems
) -> None:
    """Report names whose values follow from each other in a circle."""
    loop = circle(_reading({name: [tree] for name, tree in trees.items()}))
    if loop:
        label = f"`{what}` values in a circle: {chain(loop)}"
        hint = "one of them is given by a value of its own" + _places(loop, spans)
        problems.error("loop", spans[loop[0]], label, hint)


def unreached(modes: Mapping[str, Mode], initial: str, silent: Set[str] = frozenset()) -> list[str]:
    """Return the modes that no chain of transitions from the initial mode enters.

    The silent ones, by key path, never fire.
    """
    edges = {
        mode.name: [way.target for way in mode.transitions if way.key not in silent]
        for mode in modes.values()
    }
    found = reachable(edges, initial)
    return [name for name in modes if name not in found]


def _places(loop: Sequence[str], spans: Mapping[str, Span]) -> str:
    return "".join(f"; `{name}` is at {spans[name]}" for name in loop[1:])


def _reading(trees: Mapping[str, Sequence[Tree]]) -> dict[str, list[str]]:
    """From each name to those that read it."""
    reads = {
        name: [read.path for tree in alternatives for read in names(tree)]
        for name, alternatives in trees.items()
    }
    return turned(reads)
