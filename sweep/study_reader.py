"""Study reader: a study from its document, checked with everything that it names."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from language.document import Document, Entry, Items, Node, Scalar, Table, require_kind
from language.experiment import Scenario, System
from language.problem import Problems, Span, nearest
from language.project import Project, expanded
from language.reader import TEXT_KEYS, Reader
from language.scenario import read_scenario
from language.system import Overrides, around, read_system
from language.tree import put
from language.units import SECOND, fits
from sweep.description import description_of
from sweep.measure import Measure, SignalMeasure
from sweep.measure_reader import MeasureReader
from sweep.presentation_reader import PresentationReader
from sweep.sampling_reader import MOST_POINTS, SamplingReader
from sweep.study import Course, Kind, Setting, Study, Varied
from sweep.target import Place, places_of
from sweep.vary_reader import VaryReader

STUDY_KEYS = tuple(
    "language study of scenarios variants vary set sampling replicates measures record summary plots".split()  # noqa: SIM905, E501
)
SHOWN_KEYS = ("summary", "plots", "sampling", "study", *TEXT_KEYS)
"""Keys without influence on the results; but sampling, which may come from elsewhere."""
MOST_REPLICATES = 1_000_000
BASE = "base"
"""The name of the variant that is the system as it is."""


def read_study(
    document: Document,
    project: Project,
    overrides: Overrides | None = None,
    problems: Problems | None = None,
) -> Study:
    """Read a study with its systems and scenarios. Raises SpecError with all problems."""
    document = expanded(document, project)
    problems = problems if problems is not None else Problems()
    require_kind(document, "study", problems)
    problems.stop_if_any()
    study = _StudyReader(problems, project, dict(overrides or {})).read(document)
    problems.stop_if_any()
    return study


class _StudyReader(Reader):
    """The sections of a study, one method each."""

    def __init__(self, problems: Problems, project: Project, overrides: dict[str, Scalar]) -> None:
        super().__init__(problems)
        self.project = project
        self.overrides = overrides
        self.identity: dict[str, str] = {}
        self.alone = ""  # an automaton alone is called like the first in all variants

    def read(self, document: Document) -> Study:
        tree = self.table(document.root, f"study {document.name}", STUDY_KEYS)
        at = document.name_span
        systems = self._systems(tree, at)
        self.problems.stop_if_any()
        scenarios = self._scenarios(tree, at)
        courses = {name: self._courses(system, scenarios) for name, system in systems.items()}
        if not scenarios or any(len(each) < len(scenarios) for each in courses.values()):
            self.problems.stop_if_any()
        places = self._places(systems, list(scenarios.values()))
        vary = VaryReader(self.problems, places, next(iter(systems.values())))
        varied = vary.varied(tree.get("vary"))
        settings = vary.settings(tree.get("set"), varied)
        sampling = SamplingReader(self.problems).sampling(tree.get("sampling"), varied)
        measures = MeasureReader(self.problems, list(systems.values()))
        found = measures.measures(tree.get("measures"), at)
        parts = _are_inputs(varied, settings)
        kinds = tuple(
            Kind(name, _measuring(system, measures, found), _kept(courses[name], scenarios, parts))
            for name, system in systems.items()
        )
        shown = PresentationReader(self.problems, kinds, varied, found)
        study = Study(
            name=document.name,
            kinds=kinds,
            scenarios=tuple(scenarios),
            varied=varied,
            settings=settings,
            sampling=sampling,
            replicates=self.whole(tree.get("replicates"), "replicates", 1, 1, MOST_REPLICATES),
            measures=found,
            every=self._every(tree),
            presentation=shown.presentation(tree.get("summary"), tree.get("plots")),
            identity={**self.identity, "study": _digest(_plain(tree, SHOWN_KEYS))},
            span=at,
            description=description_of(tree, self.overrides),
        )
        self._check_count(study)
        return study

    def _check_count(self, study: Study) -> None:
        if study.count > MOST_POINTS:
            label = f"the study has {study.count} variants; at most {MOST_POINTS} are run"
            hint = "fewer values on an axis, or drawn points"
            self.problems.error("range", study.span, label, hint)

    def _systems(self, tree: Table, at: Span) -> dict[str, System]:
        """The systems by the name of the variant; `base` where there are no variants."""
        of = self.scalar(tree.get("of"), "of", at)
        node = tree.get("variants")
        self.problems.stop_if_any()
        assert of is not None
        found: dict[str, System] = {}
        if node is None:
            found[BASE] = self._system(BASE, of, {})
        elif isinstance(node, Items):
            for item in self.items(node, "variants"):
                with self.problems.collecting():
                    found[item.text] = self._system(item.text, item, {})
        else:
            for entry in self.named(node, "variants"):
                with self.problems.collecting():
                    found[entry.key] = self._variant(entry, of)
        if not found and not self.problems.has_errors:
            self.problems.error("missing", at, "`variants` has at least one")
        return found

    def _variant(self, entry: Entry, of: Scalar) -> System:
        """A name of a system, or automata that take the place of others: `{plant: worn}`."""
        if isinstance(entry.node, Scalar):
            return self._system(entry.key, entry.node, {})
        given: dict[str, Scalar] = {}
        for item in self.table(entry.node, f"variants.{entry.key}"):
            scalar = self.scalar(item.node, item.key, item.span)
            if scalar:
                given[item.key] = dataclasses.replace(scalar)
                self._known_instance(of, item)
        self.problems.stop_if_any()
        return self._system(entry.key, of, given)

    def _known_instance(self, of: Scalar, item: Entry) -> None:
        base = expanded(self.project.read(self.project.path_of(of.text, of.span)), self.project)
        node = base.root.get("instances")
        known = list(node.entries) if isinstance(node, Table) else []
        if item.key not in known:
            label = f"`{item.key}` is not an instance of `{of.text}`"
            self.problems.error("name", item.span, label, nearest(item.key, known))

    def _system(self, name: str, of: Scalar, given: Mapping[str, Scalar]) -> System:
        document = self.project.read(self.project.path_of(of.text, of.span))
        if given:
            document = expanded(document, self.project)
            for instance, automaton in given.items():
                root = put(document.root, ("instances", instance, "of"), automaton)
                document = dataclasses.replace(document, root=root)
        plain = _plain(expanded(document, self.project).root, TEXT_KEYS)
        overrides = {key: scalar.text for key, scalar in self.overrides.items()}
        self.identity[f"system of variant `{name}`"] = _digest([plain, overrides])
        system = read_system(document, self.project, self.overrides)
        if not system.alone:
            return system
        self.alone = self.alone or system.alone
        only = system.instances[system.alone].automaton
        return around(dataclasses.replace(only, name=self.alone))

    def _scenarios(self, tree: Table, at: Span) -> dict[str, Document]:
        found: dict[str, Document] = {}
        items = self.items(tree.get("scenarios"), "scenarios")
        for item in items:
            if item.text in found:
                self.problems.error("duplicate", item.span, f"`{item.text}` is given twice")
            with self.problems.collecting():
                document = self.project.read(self.project.path_of(item.text, item.span))
                found[item.text] = expanded(document, self.project)
                plain = _plain(found[item.text].root, TEXT_KEYS)
                self.identity[f"scenario `{item.text}`"] = _digest(plain)
        if not items:
            label = "a study has `scenarios`"
            self.problems.error("missing", at, label, "like `scenarios: [tip_out]`")
        return found

    def _courses(self, system: System, scenarios: Mapping[str, Document]) -> dict[str, Scenario]:
        found = {}
        for name, document in scenarios.items():
            with self.problems.collecting():
                found[name] = read_scenario(document, self.project, system)
        return found

    def _places(self, systems: Mapping[str, System], scenarios: list[Document]) -> dict[str, Place]:
        """The places that all variants and scenarios have in common."""
        found: dict[str, Place] | None = None
        for system in systems.values():
            for scenario in scenarios:
                here = places_of(system, [scenario])
                found = here if found is None else _common(found, here)
        return found or {}

    def _every(self, tree: Table) -> Fraction | None:
        node = self.table(tree.get("record"), "record", ("every",)).get("every")
        if node is None:
            return None
        value, unit = self.quantity(node, "every", node.span, None)
        if value <= 0 or not fits(unit.dimension, SECOND):
            self.problems.error("range", node.span, "`every` is a time above zero, like `1 ms`")
            return None
        return value


def _common(first: Mapping[str, Place], other: Mapping[str, Place]) -> dict[str, Place]:
    """Return the places that both have, each with the targets of both."""
    found = {}
    for name, place in first.items():
        if name in other:
            targets = dict.fromkeys((*place.targets, *other[name].targets))
            found[name] = dataclasses.replace(place, targets=tuple(targets))
    return found


def _are_inputs(varied: tuple[Varied, ...], settings: tuple[Setting, ...]) -> bool:
    """Tell whether parts of inputs vary: then scenarios are read anew in each variant."""
    targets = [target for each in varied for target in each.targets]
    targets += [target for each in settings for target in each.targets]
    return any(target.kind == "input" for target in targets)


def _measuring(system: System, reader: MeasureReader, measures: tuple[Measure, ...]) -> System:
    """Return the system with the expressions of the measures as outputs."""
    outputs, dimensions = dict(system.outputs), dict(system.dimensions)
    for name, (formula, dimension) in reader.expressions.items():
        outputs[name] = dataclasses.replace(formula, key=f"measures.{name}")
        dimensions[name] = dimension
    return dataclasses.replace(system, outputs=outputs, dimensions=dimensions)


def _kept(
    courses: Mapping[str, Scenario], documents: Mapping[str, Document], parts: bool
) -> dict[str, Course]:
    return {
        name: Course(scenario, documents[name] if parts else None)
        for name, scenario in courses.items()
    }


def signals_of(measures: tuple[Measure, ...]) -> tuple[str, ...]:
    """Return the signals that measures read."""
    found = [measure.signal for measure in measures if isinstance(measure, SignalMeasure)]
    return tuple(dict.fromkeys(found))


def _plain(node: Node, left_out: tuple[str, ...] | frozenset[str]) -> Any:
    """Return a tree as plain data, without its places and what has no influence."""
    match node:
        case Scalar():
            return node.text
        case Items():
            return [_plain(item, TEXT_KEYS) for item in node.nodes]
        case Table():
            return {e.key: _plain(e.node, TEXT_KEYS) for e in node if e.key not in left_out}


def _digest(data: Any) -> str:
    return hashlib.sha256(json.dumps(data).encode()).hexdigest()
