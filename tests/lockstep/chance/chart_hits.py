"""Chart hits: how often a run of a random chart did what the rules of charts are about."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from engine.firing import fired
from engine.interpreter import Interpreter
from language.chart import Chart
from language.charting import NOT_YET, kept, taken, wish
from language.limit import MICRO_STEP_LIMIT
from language.load import automaton_of
from language.model import Automaton, Transition
from language.program import Program
from language.project import Project, read_document
from tests.lockstep.chance.charts import OWN
from tests.lockstep.chance.spec import Spec

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


def automaton_again(spec: Spec, folder: Path) -> Automaton:
    """Return the automaton of a spec that was written below a folder."""
    project = Project(folder / spec.name)
    return automaton_of(read_document(project.path_of(spec.name)), project)


class ChartHits:
    """Watches one run; `counts` are what it did."""

    def __init__(self, automaton: Automaton, program: Program) -> None:
        assert automaton.tree is not None
        self.automaton, self.program = automaton, program
        self.chart: Chart = automaton.tree
        ways = [way for mode in automaton.all_modes for way in mode.transitions]
        self.ways = {f"{automaton.name} {way.key}": way for way in ways}
        self.counts: Counter[str] = Counter()
        self.before: dict[str, int] = {}

    def look(self, stepper: Interpreter) -> None:
        """Count what a tick did."""
        infos = fired(self.program, stepper)
        for info in infos:
            way = self.ways.get(info.key)
            self.counts.update(self._way(way) if way else ())
        regions = [info.region for info in infos]
        self.counts[STEPS[0]] += len(set(regions)) < len(regions)
        self.counts[STEPS[1]] += len(set(regions)) > 1
        names = [region.region for region in self.chart.regions]
        self.counts[STEPS[2]] += any(self._gives_way(stepper, name) for name in names)
        if MICRO_STEP_LIMIT in self.program.faults:
            bit = 1 << self.program.faults.index(MICRO_STEP_LIMIT)
            self.counts[STEPS[3]] += bool(stepper.get("memory.faults") & bit)
        self.counts[STEPS[4]] += any(
            stepper.get(variable) == self.automaton.region(name).inactive
            for name, variable in self.program.mode_variables().items()
        )
        self.counts[STEPS[5 if self.chart.order == "outer_first" else 6]] += bool(infos)
        names = [v.name for v in self.program.variables if v.name.startswith("memory.left_")]
        self.before = {name: stepper.get(name) for name in names}

    def _gives_way(self, stepper: Interpreter, region: str) -> bool:
        if not all(stepper.has(make(region)) for make in (wish, taken)):
            return False
        return bool(stepper.get(wish(region)) and not stepper.get(taken(region)))

    def _way(self, way: Transition) -> Iterator[str]:
        place = self.chart.ways[way.key]
        nodes = self.chart.nodes
        source = nodes[place.source]
        said = {
            WAYS[0]: source.kind == "compound",
            WAYS[1]: self.chart.outer_region(self.chart.region_node(source.region)) is not None,
            WAYS[2]: any(
                place.domain is not None and r.index > place.domain and r.holds(place.source)
                for r in self.chart.regions
            ),
            WAYS[3]: len(place.targets) > 1,
            WAYS[4]: not place.targets,
            WAYS[5]: way.internal,
            WAYS[6]: place.source in place.targets,
            WAYS[7]: way.completes,
            WAYS[11]: bool(way.events),
            WAYS[12]: bool(way.events) and "Truth" not in type(way.when.tree).__name__,
            WAYS[13]: bool({*way.events} & {*OWN}),
            WAYS[14]: way.wait is not None,
            WAYS[15]: way.memory == "continue",
            WAYS[16]: bool(way.raises),
            WAYS[17]: self._acts(way),
            **{name: f"'{name}'" in repr(way.when.tree) for name in WAYS[18:]},
        }
        yield from (name for name, is_so in said.items() if is_so)
        yield from self._histories(way)

    def _histories(self, way: Transition) -> Iterator[str]:
        nodes = self.chart.nodes
        for target in self.chart.ways[way.key].targets:
            node, how = nodes[target], way.history or nodes[target].history
            owner = nodes[node.parent] if node.kind == "history" else node
            if how:
                known = self.before.get(kept(owner).name, NOT_YET) != NOT_YET
                yield (WAYS[8] if how == "shallow" else WAYS[9]) if known else WAYS[10]

    def _acts(self, way: Transition) -> bool:
        place, nodes = self.chart.ways[way.key], self.chart.nodes
        source = self.automaton.by_key[nodes[place.source].mode]
        targets = [self.automaton.by_key.get(nodes[t].mode) for t in place.targets]
        entered = any(mode and mode.entry for mode in targets)
        return bool(source.exit and way.reset and entered)
