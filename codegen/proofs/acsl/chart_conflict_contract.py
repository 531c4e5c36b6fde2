"""Chart conflict contract: which requests `resolve_conflicts` takes (rule 15).

The requests of innermost modes are considered, in the `order` of the regions around them. Of two
that leave the same mode, the one from further inside is taken, else the earlier one (W3C, SCXML,
2015, `removeConflictingTransitions`).
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from codegen.proofs.acsl.acsl_expression import Look
from codegen.proofs.acsl.chart_predicates import Configuration, all_of, any_of
from language.charts.chart_context import request_variable, selected_variable
from language.model.statechart import ChartNode


@dataclass(frozen=True)
class ConflictResolution:
    """The contract of `resolve_conflicts`.

    Requests and modes do not change, so all clauses refer to the final state.
    """

    words: Configuration

    def ensured(self) -> Iterator[str]:
        """Yield the postconditions of `resolve_conflicts`."""
        for said in self.consistent(self.words.now):
            yield f"ensures {said};"
        for region in self.words.charting.chart.regions:
            own, considered = (
                self.words.now(selected_variable(region.region)),
                any_of(self._offers(region)),
            )
            if not self.words.charting.transitions_in(region.region):
                yield f"ensures {own} == 0;"
                continue
            requested = self.words.now(request_variable(region.region))
            yield f"ensures {own} == 0 || ({own} == {requested} && {considered});"
            beaten = any_of(self._beats(other, region) for other in self._rivals(region))
            yield f"ensures ({considered} && {requested} != 0 && {own} == 0) ==> {beaten};"

    def consistent(self, at: Look) -> Iterator[str]:
        """Yield that no two of the taken transitions leave the same mode."""
        regions = self.words.charting.chart.regions
        for number, region in enumerate(regions):
            for other in regions[number + 1 :]:
                clash = self._clash(region, other, selected_variable, at)
                if clash != "\\false":
                    yield f"!{clash}"

    def _rivals(self, region: ChartNode) -> list[ChartNode]:
        regions = (r for r in self.words.charting.chart.regions if r is not region)
        return [
            r
            for r in regions
            if self._clash(region, r, request_variable, self.words.now) != "\\false"
        ]

    def _clash(self, one: ChartNode, other: ChartNode, of: Callable[[str], str], at: Look) -> str:
        """Return that transitions of two regions leave the same mode."""
        chart = self.words.charting.chart
        first, second = self._domains(one), self._domains(other)
        return any_of(
            all_of(
                [
                    self.words.is_one(of(one.region), numbers, at),
                    self.words.is_one(of(other.region), others, at),
                ]
            )
            for left, numbers in first.items()
            for right, others in second.items()
            if chart.are_nested(left, right)
        )

    def _domains(self, region: ChartNode) -> dict[int, list[int]]:
        """Return the transitions of a region by the node whose inside they leave."""
        found: dict[int, list[int]] = defaultdict(list)
        for transition, way in self.words.charting.transitions_in(region.region):
            if way.domain is not None:
                found[way.domain].append(self.words.number(transition))
        return found

    def _candidates(self) -> list[tuple[str, list[ChartNode]]]:
        """Return, in the order of resolution, when an innermost mode of a region is active, and the
        regions of which the first one with a request is then considered.
        """
        chart, words = self.words.charting.chart, self.words
        found = []
        for region in chart.regions:
            plain = [n.number for n in chart.leaves(region.region) if n.kind == "atomic"]
            around = [r for r in chart.regions if r is region or chart.is_region_inside(region, r)]
            around = [r for r in around if words.charting.transitions_in(r.region)]
            if chart.order == "inner_first":
                around.reverse()
            active = words.is_in(region.region, (n for n in plain if n is not None), words.now)
            found.append((active, around))
        return found

    def _offered(self, region: ChartNode) -> Iterator[str]:
        """Yield, of each of `_candidates`, that it considers the request of a region."""
        for active, around in self._candidates():
            if region in around:
                before = around[: around.index(region)]
                none = [f"{self.words.now(request_variable(r.region))} == 0" for r in before]
                own = f"{self.words.now(request_variable(region.region))} != 0"
                yield all_of([active, own, *none])
            else:
                yield "\\false"

    def _offers(self, region: ChartNode) -> Iterator[str]:
        return (said for said in self._offered(region) if said != "\\false")

    def _beats(self, one: ChartNode, other: ChartNode) -> str:
        """Return that the request of a region is taken instead of that of another."""
        chart = self.words.charting.chart
        clash = self._clash(one, other, request_variable, self.words.now)
        considered = any_of(self._offers(one))
        if chart.is_region_inside(one, other):
            return all_of([considered, clash])
        if chart.is_region_inside(other, one):
            return "\\false"
        mine, theirs = list(self._offered(one)), list(self._offered(other))
        earlier = any_of(
            all_of([said, *(f"!{past}" for past in theirs[:place] if past != "\\false")])
            for place, said in enumerate(mine)
            if said != "\\false"
        )
        return all_of([considered, clash, earlier])
