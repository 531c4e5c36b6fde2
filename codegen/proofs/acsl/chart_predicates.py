"""Chart predicates: statements about the active modes of a chart, as predicates of a contract.

They follow from the tree of modes and the ends of transitions (W3C, SCXML, 2015, appendix D), not
from the operations to which the chart was lowered.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

from codegen.emit.c_names import SOLVED_PREFIX_ON_PAGE, CNames
from codegen.proofs.acsl.acsl_expression import Look, Speech, Unsaid
from language.charts.chart_context import (
    NEVER_LEFT,
    ChartContext,
    history_ref,
    request_variable,
    selected_variable,
)
from language.ir.program import Program, mode_variable
from language.model.automaton import Transition
from language.model.statechart import ChartNode


@dataclass(frozen=True)
class Configuration:
    """The predicates of a chart's contracts.

    `made` is the Program after the passes of the C generator.
    """

    charting: ChartContext
    made: Program

    @cached_property
    def place(self) -> CNames:
        """The C names of variables."""
        return CNames(self.made, frozenset(), SOLVED_PREFIX_ON_PAGE)

    @cached_property
    def speech(self) -> Speech:
        """The printer of expressions."""
        return Speech(self.made.number_type, self.made.types())

    @cached_property
    def _known(self) -> frozenset[str]:
        names = [variable.name for variable in self.made.variables]
        return frozenset((*names, *(constant.name for constant in self.made.constants)))

    def knows(self, name: str) -> bool:
        """Tell whether a variable exists in C; one that nothing reads does not."""
        return name in self._known

    def now(self, name: str) -> str:
        """Return the value of a variable at the end of a function.

        Raises Unsaid if it is not in C.
        """
        array, _, index = name.partition(" ")
        if array not in self._known:
            raise Unsaid(name)
        if index:
            return f"{self.place(array)}[{self.before(index)}]"
        text = self.place(name)
        return f"({text} != 0)" if self.speech.is_truth_name(name) else text

    def before(self, name: str) -> str:
        """Return the value of a variable at the start of a function.

        Raises Unsaid if it is not in C.
        """
        array, _, index = name.partition(" ")
        said = f"{self.place(array)}[{self.place(index)}]" if index else self.now(name)
        return f"\\old({said})"

    def mode(self, region: str) -> str:
        """Return the mode variable of a region."""
        return mode_variable("memory.mode", region)

    def number(self, transition: Transition) -> int:
        """Return the number of a transition."""
        return self.charting.info_of(transition).number

    def chosen(self, region: str) -> str:
        """Return the variable with the number of the transition that a region takes."""
        return (
            selected_variable(region)
            if len(self.charting.chart.regions) > 1
            else request_variable(region)
        )

    def is_in(self, region: str, numbers: Iterable[int], at: Look) -> str:
        """Return the predicate that a region is in one of some modes."""
        return self.is_one(self.mode(region), numbers, at)

    def is_one(self, name: str, numbers: Iterable[int], at: Look) -> str:
        """Return the predicate that a variable has one of some numbers."""
        named = [self.place.integer_constant(name, number) for number in sorted(numbers)]
        return any_of(f"{at(name)} == {number}" for number in named)

    def is_active(self, node: ChartNode, at: Look) -> str:
        """Return the predicate that a node is active."""
        leaves = self.charting.chart.leaves_of(node)
        return self.is_in(node.region, (n.number for n in leaves if n.number is not None), at)

    def valid(self, at: Look) -> Iterator[str]:
        """Yield the predicates of a valid configuration: each active region has one active mode."""
        for region in self.charting.chart.regions:
            yield from self.valid_in(region, at)

    def valid_in(self, region: ChartNode, at: Look) -> Iterator[str]:
        """Yield the predicates of a valid region: its mode, histories and counter limits."""
        chart, automaton = self.charting.chart, self.charting.automaton
        inside = self.is_in(region.region, self._numbers(region), at)
        inactive = automaton.region(region.region).inactive
        if inactive is None:
            yield inside
        else:
            around = self.is_active(chart.nodes[region.parent], at)
            outside = self.is_in(region.region, [inactive], at)
            yield f"({around} ? {inside} : {outside})"
        yield from self._histories(region, at)
        for transition, _ in self.charting.transitions_in(region.region):
            info = self.charting.info_of(transition)
            if info.timer:
                yield f"{at(info.timer)} <= {info.timer_limit}"

    def _histories(self, region: ChartNode, at: Look) -> Iterator[str]:
        """Yield what is kept: a mode that was active, with what was active in it."""
        chart, remembered = self.charting.chart, self.charting.history_nodes
        nodes = [chart.nodes[index] for index in sorted(remembered)]
        for node in nodes:
            if node.region == region.region:
                numbers = self._numbers(node) if node.kind == "compound" else [1]
                yield self.is_one(history_ref(node).name, [NEVER_LEFT, *numbers], at)
        outer = chart.nodes[region.parent]
        for node in nodes if region.index in remembered else ():
            number = 1 if node is outer else outer.number
            if node is outer or (node.kind == "compound" and outer in chart.leaves_of(node)):
                was = f"{at(history_ref(region).name)} != {NEVER_LEFT}"
                yield f"({at(history_ref(node).name)} == {number} ==> {was})"

    def _numbers(self, node: ChartNode) -> list[int]:
        """Return the numbers of the modes that a node's region is in while that is active."""
        leaves = self.charting.chart.leaves_of(node)
        return [leaf.number for leaf in leaves if leaf.number is not None]


def any_of(parts: Iterable[str]) -> str:
    """Return the disjunction of predicates; `\\false` if there are none."""
    found = list(dict.fromkeys(parts))
    return "(" + " || ".join(found) + ")" if found else "\\false"


def all_of(parts: Iterable[str]) -> str:
    """Return the conjunction of predicates; `\\true` if there are none."""
    found = list(dict.fromkeys(parts))
    return "(" + " && ".join(found) + ")" if found else "\\true"
