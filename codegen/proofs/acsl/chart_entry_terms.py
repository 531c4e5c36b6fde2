"""Chart entry terms: the modes that a transition enters, as terms of a contract.

A compound node is entered at the target, at its initial mode, or at the mode that a history
remembers. A parallel node is entered in all of its regions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from codegen.proofs.acsl.chart_predicates import Configuration
from codegen.proofs.acsl.symbolic_summary import Fork, Found
from language.charts.chart_context import NEVER_LEFT, history_ref
from language.model.automaton import Transition
from language.model.statechart import ChartNode, ChartTransition

Modes: TypeAlias = Mapping[str, Found]
"""The number of the active mode by region; None if no history remembers it."""


def modes_after(words: Configuration, transition: Transition, way: ChartTransition) -> Modes:
    """Return the modes of all regions that a transition changes, after the transition."""
    if way.domain is None:
        return {}
    chart, automaton = words.charting.chart, words.charting.automaton
    domain = chart.nodes[way.domain]
    inside = [r for r in chart.regions if domain.contains(r.index) and r is not domain]
    none = {r.region: str(automaton.region(r.region).inactive) for r in inside}
    return {**none, **_Entered(words, transition, way, none).inside(domain, way.targets)}


@dataclass(frozen=True)
class _Entered:
    """The modes that one transition enters; `none` are the regions inside what it leaves."""

    words: Configuration
    transition: Transition
    way: ChartTransition
    none: Modes

    def inside(self, node: ChartNode, wanted: Iterable[int]) -> Modes:
        """Return the modes inside a compound node: those of the targets, else of `initial`."""
        nodes = self.words.charting.chart.nodes
        inner = [target for target in wanted if node.contains(target) and target != node.index]
        if not inner and self.transition.history and node.index in self.way.targets:
            return self.recalled(node, self.transition.history, self.inside_at(node, node.initial))
        wanted = inner or list(node.initial)
        child = next(nodes[c] for c in node.children if nodes[c].contains(wanted[0]))
        if child.kind == "history":
            return self.recalled(node, child.history, self.inside_at(node, child.initial))
        return self.into(child, wanted)

    def inside_at(self, node: ChartNode, wanted: Iterable[int]) -> Modes:
        """Return the modes inside a compound node with given innermost targets."""
        wanted = list(wanted)
        nodes = self.words.charting.chart.nodes
        child = next(nodes[c] for c in node.children if nodes[c].contains(wanted[0]))
        return self.into(child, wanted)

    def into(self, node: ChartNode, wanted: Iterable[int]) -> Modes:
        """Return the modes of a node that is entered."""
        own = {} if node.number is None else {node.region: str(node.number)}
        if node.kind == "compound":
            return {**own, **self.inside(node, wanted)}
        if node.kind == "parallel":
            return {**own, **self.side_by_side(node, list(wanted))}
        return own

    def side_by_side(self, node: ChartNode, wanted: list[int]) -> Modes:
        """Return the modes of all regions of a parallel node; a history may determine them."""
        chart = self.words.charting.chart
        asked = self.transition.history if node.index in self.way.targets else ""
        usual: list[int] = []
        for target in wanted:
            if chart.nodes[target].kind == "history" and chart.nodes[target].parent == node.index:
                asked, usual = chart.nodes[target].history, [*usual, *chart.nodes[target].initial]
            elif node.contains(target) and target != node.index:
                usual.append(target)
        regions = chart.child_regions(node)
        first = self.merged(self.into(region, usual) for region in regions)
        if asked != "deep":
            return first
        again = self.merged(self.again(region) for region in regions)
        return self.either(
            f"{self.words.now(history_ref(node).name)} == {NEVER_LEFT}", first, again
        )

    def recalled(self, node: ChartNode, how: str, usual: Modes) -> Modes:
        """Return the modes inside a node as it was left; `usual` if it never was."""
        chart, left = self.words.charting.chart, self.words.now(history_ref(node).name)
        found: Modes = dict.fromkeys(self._regions(node))
        for leaf in chart.leaves_of(node):
            chain = [
                n for n in chart.region_ancestors(leaf) if node.contains(n.index) and n is not node
            ]
            if chain:
                own = self.into(chain[-1], ()) if how == "shallow" else self.as_left(leaf)
                found = self.either(f"{left} == {leaf.number}", own, found)
        return self.either(f"{left} == {NEVER_LEFT}", usual, found)

    def as_left(self, leaf: ChartNode) -> Modes:
        """Return the mode of an innermost mode's region, with all modes that were active in it."""
        inner = self.words.charting.chart.child_regions(leaf)
        return {leaf.region: str(leaf.number), **self.merged(self.again(r) for r in inner)}

    def again(self, region: ChartNode) -> Modes:
        """Return the modes of a region as it was left."""
        if region.kind == "compound":
            return self.recalled(region, "deep", {})
        return self.as_left(region)

    def merged(self, found: Iterable[Modes]) -> Modes:
        """Return the modes of several regions."""
        return {name: number for modes in found for name, number in modes.items()}

    def either(self, test: str, then: Modes, other: Modes) -> Modes:
        """Return the modes by a predicate; a region that is not entered is inactive."""
        found: dict[str, Found] = {}
        for name in {**then, **other}:
            one, two = (modes.get(name, self.none.get(name)) for modes in (then, other))
            found[name] = one if one == two else Fork(test, one, two)
        return found

    def _regions(self, node: ChartNode) -> list[str]:
        """Return the regions that have modes inside a node, and its own."""
        regions = (r.region for r in self.words.charting.chart.regions if node.contains(r.index))
        return [node.region, *regions]


def outcomes(found: Found) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the path conditions and values of a nested choice, one after the other."""
    match found:
        case Fork(test, then, other):
            yield from (((test, *tests), mode) for tests, mode in outcomes(then))
            yield from (((f"!({test})", *tests), mode) for tests, mode in outcomes(other))
        case str():
            yield (), found
