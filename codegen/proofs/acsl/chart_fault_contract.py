"""Chart fault contract: transitions to the fault mode of a chart, as predicates (rules 13 and 18).

When a fault occurs, each mode outside of the fault mode requests a transition to it before all
others, whatever the `order` of the chart. Regions inside such a mode request nothing. The contract
follows from the tree of modes and the name of the fault mode, so a missing transition is detected.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from codegen.proofs.acsl.chart_predicates import Configuration
from language.ir.root_region import CHART
from language.lowering.fault_mode import FAULT_PRIORITY
from language.lowering.range_saturation import FAULT_HAPPENED
from language.model.automaton import Transition
from language.model.chart_paths import mode_paths
from language.model.statechart import ChartNode, ChartTransition


@dataclass(frozen=True)
class ChartFault:
    """The predicates for a fault; there are none for a chart without a fault mode."""

    words: Configuration

    @property
    def happened(self) -> str:
        """The predicate that a fault requests the fault mode in this tick."""
        return self.words.now(FAULT_HAPPENED)

    @cached_property
    def outside(self) -> Sequence[ChartNode]:
        """The innermost modes of the chart that are not in the fault mode."""
        chart = self.words.charting.chart
        if self._mode is None:
            return ()
        return [leaf for leaf in chart.leaves(CHART) if not self._mode.contains(leaf.index)]

    def leaves(self, region: ChartNode) -> bool:
        """Tell whether a region is inside a mode that is not in the fault mode."""
        return any(leaf.contains(region.index) for leaf in self.outside)

    def ways(self, leaf: ChartNode) -> Iterator[tuple[Transition, ChartTransition]]:
        """Yield the transitions of a mode that enter the fault mode when a fault occurs."""
        charting = self.words.charting
        for transition in charting.transitions_of(leaf):
            way = charting.chart.transitions[transition.key]
            leads = self._mode is not None and way.targets == (self._mode.index,)
            if leads and is_of_fault(transition):
                yield transition, way

    def numbers(self, leaf: ChartNode) -> list[int]:
        """Return the numbers of these transitions: one, or none if the transition is missing."""
        return [self.words.number(transition) for transition, _ in self.ways(leaf)]

    @cached_property
    def _mode(self) -> ChartNode | None:
        name = self.words.charting.automaton.fault_mode
        return mode_paths(self.words.charting.chart)[name] if name else None


def is_of_fault(transition: Transition) -> bool:
    """Tell whether a transition was added for faults: it has the priority of faults."""
    return transition.priority == FAULT_PRIORITY
