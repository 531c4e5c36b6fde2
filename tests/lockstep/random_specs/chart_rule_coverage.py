"""Chart hits: how often a run of a random chart did what the rules of charts are about."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from engine.execution.transition_events import fired_transitions
from engine.interpreter.interpreter import Interpreter
from language.charts.chart_context import (
    NEVER_LEFT,
    history_ref,
    request_variable,
    selected_variable,
)
from language.ir.program import Program
from language.loading.load import automaton_of
from language.model.automaton import Automaton, Transition
from language.model.declaration import MICRO_STEP_LIMIT_FAULT
from language.model.statechart import Chart
from language.overlays.expand_document import Project, read_document
from tests.lockstep.random_specs.charts import OWN
from tests.lockstep.random_specs.spec import Spec

WAYS = (
    "transition of a superstate",
    "transition inside a region of a mode",
    "leaves a mode with regions",
    "several targets",
    "no target",
    "internal",
    "itself",
    "completion",
    "shallow history, left before",
    "deep history, left before",
    "history entered for the first time",
    "event",
    "event and guard",
    "raised event",
    "wait",
    "memory: continue",
    "raise",
    "exit and reset and entry",
    "rising",
    "after",
    "in",
)
STEPS = (
    "two transitions of one region in a tick",
    "two regions in a tick",
    "a wish gives way",
    "past the bound",
    "a region inside a mode is inactive",
    "outer first",
    "inner first",
)
KINDS = (*WAYS, *STEPS)


def reload_automaton(spec: Spec, folder: Path) -> Automaton:
    """Return the automaton of a spec that was written below a folder."""
    project = Project(folder / spec.name)
    return automaton_of(read_document(project.path_of(spec.name)), project)


class ChartHits:
    """Watches one run; `counts` are what it did."""

    def __init__(self, automaton: Automaton, program: Program) -> None:
        assert automaton.statechart is not None
        self.automaton, self.program = automaton, program
        self.chart: Chart = automaton.statechart
        ways = [way for mode in automaton.all_modes for way in mode.transitions]
        self.ways = {f"{automaton.name} {way.key}": way for way in ways}
        self.counts: Counter[str] = Counter()
        self.before: dict[str, int] = {}

    def observe(self, stepper: Interpreter) -> None:
        """Count what a tick did."""
        infos = fired_transitions(self.program, stepper)
        for info in infos:
            way = self.ways.get(info.key)
            self.counts.update(self._count_transition(way) if way else ())
        regions = [info.region for info in infos]
        self.counts[STEPS[0]] += len(set(regions)) < len(regions)
        self.counts[STEPS[1]] += len(set(regions)) > 1
        names = [region.region for region in self.chart.regions]
        self.counts[STEPS[2]] += any(self._yields_priority(stepper, name) for name in names)
        if MICRO_STEP_LIMIT_FAULT in self.program.faults:
            bit = 1 << self.program.faults.index(MICRO_STEP_LIMIT_FAULT)
            self.counts[STEPS[3]] += bool(stepper.get("memory.faults") & bit)
        self.counts[STEPS[4]] += any(
            stepper.get(variable) == self.automaton.region(name).inactive
            for name, variable in self.program.mode_variables().items()
        )
        self.counts[STEPS[5 if self.chart.order == "outer_first" else 6]] += bool(infos)
        names = [v.name for v in self.program.variables if v.name.startswith("memory.left_")]
        self.before = {name: stepper.get(name) for name in names}

    def _yields_priority(self, stepper: Interpreter, region: str) -> bool:
        if not all(stepper.has(make(region)) for make in (request_variable, selected_variable)):
            return False
        return bool(
            stepper.get(request_variable(region)) and not stepper.get(selected_variable(region))
        )

    def _count_transition(self, transition: Transition) -> Iterator[str]:
        place = self.chart.transitions[transition.key]
        nodes = self.chart.nodes
        source = nodes[place.source]
        said = {
            WAYS[0]: source.kind == "compound",
            WAYS[1]: self.chart.parent_region(self.chart.region_node(source.region)) is not None,
            WAYS[2]: any(
                place.domain is not None and r.index > place.domain and r.contains(place.source)
                for r in self.chart.regions
            ),
            WAYS[3]: len(place.targets) > 1,
            WAYS[4]: not place.targets,
            WAYS[5]: transition.internal,
            WAYS[6]: place.source in place.targets,
            WAYS[7]: transition.is_completion,
            WAYS[11]: bool(transition.events),
            WAYS[12]: bool(transition.events)
            and "Truth" not in type(transition.when.tree).__name__,
            WAYS[13]: bool({*transition.events} & {*OWN}),
            WAYS[14]: transition.wait is not None,
            WAYS[15]: transition.memory == "continue",
            WAYS[16]: bool(transition.raises),
            WAYS[17]: self._acts(transition),
            **{name: f"'{name}'" in repr(transition.when.tree) for name in WAYS[18:]},
        }
        yield from (name for name, is_so in said.items() if is_so)
        yield from self._histories(transition)

    def _histories(self, transition: Transition) -> Iterator[str]:
        nodes = self.chart.nodes
        for target in self.chart.transitions[transition.key].targets:
            node, how = nodes[target], transition.history or nodes[target].history
            owner = nodes[node.parent] if node.kind == "history" else node
            if how:
                known = self.before.get(history_ref(owner).name, NEVER_LEFT) != NEVER_LEFT
                yield (WAYS[8] if how == "shallow" else WAYS[9]) if known else WAYS[10]

    def _acts(self, transition: Transition) -> bool:
        place, nodes = self.chart.transitions[transition.key], self.chart.nodes
        source = self.automaton.modes_by_key[nodes[place.source].mode_key]
        targets = [self.automaton.modes_by_key.get(nodes[t].mode_key) for t in place.targets]
        entered = any(mode and mode.entry for mode in targets)
        return bool(source.exit and transition.reset and entered)
