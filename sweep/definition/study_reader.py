"""Study reader: read a study from its document and check it against its systems and scenarios."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from language.expressions.units import SECOND, are_compatible
from language.loading.scenario_reader import read_scenario
from language.loading.system_reader import Overrides, read_system, single_instance_system
from language.model.system import Scenario, System
from language.overlays.expand_document import Project, expand_document
from language.readers.base_reader import TEXT_KEYS, Reader
from language.text.diagnostic import Problems, Span, suggest_name
from language.text.document import (
    Document,
    Entry,
    MappingNode,
    ScalarNode,
    SequenceNode,
    YamlNode,
    require_kind,
)
from language.text.node_edit import put_node
from sweep.definition.assignment_target import TargetInfo, find_targets
from sweep.definition.description import description_of
from sweep.definition.measure import Measure, SignalMeasure
from sweep.definition.measure_reader import MeasureReader
from sweep.definition.presentation_reader import PresentationReader
from sweep.definition.sampling_reader import MAX_POINTS, SamplingReader
from sweep.definition.study import ScenarioBinding, Setting, Study, SweepVariable, SystemVariant
from sweep.definition.sweep_variable_reader import VaryReader

STUDY_KEYS = (
    *("language", "study", "of", "scenarios", "variants", "vary", "set", "sampling"),
    *("replicates", "measures", "record", "summary", "plots"),
)
"""The sections of a study."""
PRESENTATION_KEYS = ("summary", "plots", "sampling", "study", *TEXT_KEYS)
"""Sections that the digest of the study leaves out.

They do not influence the results, except `sampling`, which has a digest of its own because options
can change it.
"""
MAX_REPLICATES = 1_000_000
"""Largest number of replicates."""
BASE_VARIANT = "base"
"""The name of the only variant of a study without `variants`."""


def read_study(
    document: Document,
    project: Project,
    overrides: Overrides | None = None,
    problems: Problems | None = None,
) -> Study:
    """Return a checked study with its systems and scenarios.

    `overrides` are parameter values from the command line, applied to all systems. Other files are
    read through the project; recordings are not. Raises SpecError if the document is no study or
    has errors; all that were found are reported to `problems`, if given.
    """
    document = expand_document(document, project)
    problems = problems if problems is not None else Problems()
    require_kind(document, "study", problems)
    problems.raise_if_errors()
    study = _StudyReader(problems, project, dict(overrides or {})).read(document)
    problems.raise_if_errors()
    return study


class _StudyReader(Reader):
    """Reader with one method for each section of a study."""

    def __init__(
        self, problems: Problems, project: Project, overrides: dict[str, ScalarNode]
    ) -> None:
        super().__init__(problems)
        self.project = project
        self.overrides = overrides
        self.identity: dict[str, str] = {}
        self.sole_instance_name = ""  # the name of a lone automaton in the first variant

    def read(self, document: Document) -> Study:
        """Return the study of an expanded document; reports problems section by section."""
        tree = self.read_mapping(document.root, f"study {document.name}", STUDY_KEYS)
        at = document.name_span
        systems = self._systems(tree, at)
        self.problems.raise_if_errors()
        scenarios = self._scenarios(tree, at)
        scenarios_by_system = {
            name: self._read_scenarios(system, scenarios) for name, system in systems.items()
        }
        known = scenarios_by_system.values()
        if not scenarios or any(len(each) < len(scenarios) for each in known):
            self.problems.raise_if_errors()
        places = self._common_targets(systems, list(scenarios.values()))
        vary = VaryReader(self.problems, places, next(iter(systems.values())))
        varied = vary.variables(tree.get("vary"))
        settings = vary.settings(tree.get("set"), varied)
        sampling = SamplingReader(self.problems).sampling(tree.get("sampling"), varied)
        measures = MeasureReader(self.problems, list(systems.values()))
        checked_measures = measures.measures(tree.get("measures"), at)
        parts = _has_input_targets(varied, settings)
        system_variants = tuple(
            SystemVariant(
                name,
                _with_measure_outputs(system, measures),
                _bind_scenarios(scenarios_by_system[name], scenarios, parts),
            )
            for name, system in systems.items()
        )
        shown = PresentationReader(self.problems, varied, checked_measures)
        study = Study(
            name=document.name,
            system_variants=system_variants,
            scenarios=tuple(scenarios),
            variables=varied,
            settings=settings,
            sampling=sampling,
            replicates=self.read_integer(
                tree.get("replicates"), "replicates", 1, 1, MAX_REPLICATES
            ),
            measures=checked_measures,
            every=self._every(tree),
            presentation=shown.presentation(tree.get("summary"), tree.get("plots")),
            identity={**self.identity, "study": _digest(_to_plain_data(tree, PRESENTATION_KEYS))},
            span=at,
            description=description_of(tree, self.overrides),
        )
        self._check_count(study)
        return study

    def _check_count(self, study: Study) -> None:
        """Report a study with more than MAX_POINTS variants."""
        if study.count > MAX_POINTS:
            label = f"the study has {study.count} variants; at most {MAX_POINTS} are run"
            hint = "fewer values on an axis, or drawn points"
            self.problems.error("range", study.span, label, hint)

    def _systems(self, tree: MappingNode, at: Span) -> dict[str, System]:
        """Return the systems by variant; a study without `variants` has the variant `base`."""
        of = self.read_scalar(tree.get("of"), "of", at)
        node = tree.get("variants")
        self.problems.raise_if_errors()
        assert of is not None
        found: dict[str, System] = {}
        if node is None:
            found[BASE_VARIANT] = self._system(BASE_VARIANT, of, {})
        elif isinstance(node, SequenceNode):
            for item in self.read_list(node, "variants"):
                with self.problems.collect_errors():
                    found[item.text] = self._system(item.text, item, {})
        else:
            for entry in self.named_entries(node, "variants"):
                with self.problems.collect_errors():
                    found[entry.key] = self._variant(entry, of)
        if not found and not self.problems.has_errors:
            self.problems.error("missing", at, "`variants` has at least one")
        return found

    def _variant(self, entry: Entry, of: ScalarNode) -> System:
        """Return the system of a variant.

        It is another system, or the base with replaced automata such as `{plant: worn}`.
        """
        if isinstance(entry.node, ScalarNode):
            return self._system(entry.key, entry.node, {})
        replacements: dict[str, ScalarNode] = {}
        for item in self.read_mapping(entry.node, f"variants.{entry.key}"):
            scalar = self.read_scalar(item.node, item.key, item.span)
            if scalar:
                replacements[item.key] = dataclasses.replace(scalar)
                self._require_instance(of, item)
        self.problems.raise_if_errors()
        return self._system(entry.key, of, replacements)

    def _require_instance(self, of: ScalarNode, item: Entry) -> None:
        """Report a replaced instance that the system does not have."""
        base = expand_document(
            self.project.read(self.project.path_of(of.text, of.span)), self.project
        )
        node = base.root.get("instances")
        known = list(node.entries) if isinstance(node, MappingNode) else []
        if item.key not in known:
            label = f"`{item.key}` is not an instance of `{of.text}`"
            self.problems.error("name", item.span, label, suggest_name(item.key, known))

    def _system(self, name: str, of: ScalarNode, replacements: Mapping[str, ScalarNode]) -> System:
        """Return a system with replaced automata and overrides; store the digest of its text.

        A lone automaton gets the same name in each variant, so that targets agree.
        """
        document = self.project.read(self.project.path_of(of.text, of.span))
        if replacements:
            document = expand_document(document, self.project)
            for instance, automaton in replacements.items():
                root = put_node(document.root, ("instances", instance, "of"), automaton)
                document = dataclasses.replace(document, root=root)
        plain = _to_plain_data(expand_document(document, self.project).root, TEXT_KEYS)
        overrides = {key: scalar.text for key, scalar in self.overrides.items()}
        self.identity[f"system of variant `{name}`"] = _digest([plain, overrides])
        system = read_system(document, self.project, self.overrides)
        if not system.sole_instance:
            return system
        self.sole_instance_name = self.sole_instance_name or system.sole_instance
        only = system.instances[system.sole_instance].automaton
        return single_instance_system(dataclasses.replace(only, name=self.sole_instance_name))

    def _scenarios(self, tree: MappingNode, at: Span) -> dict[str, Document]:
        """Return the expanded scenario documents by name.

        Stores their digests and reports duplicates.
        """
        found: dict[str, Document] = {}
        items = self.read_list(tree.get("scenarios"), "scenarios")
        for item in items:
            if item.text in found:
                self.problems.error("duplicate", item.span, f"`{item.text}` is given twice")
            with self.problems.collect_errors():
                document = self.project.read(self.project.path_of(item.text, item.span))
                found[item.text] = expand_document(document, self.project)
                plain = _to_plain_data(found[item.text].root, TEXT_KEYS)
                self.identity[f"scenario `{item.text}`"] = _digest(plain)
        if not items:
            label = "a study has `scenarios`"
            self.problems.error("missing", at, label, "like `scenarios: [tip_out]`")
        return found

    def _read_scenarios(
        self, system: System, scenarios: Mapping[str, Document]
    ) -> dict[str, Scenario]:
        """Return the scenarios bound to a system; those with problems are reported and left out."""
        found = {}
        for name, document in scenarios.items():
            with self.problems.collect_errors():
                found[name] = read_scenario(document, self.project, system)
        return found

    def _common_targets(
        self, systems: Mapping[str, System], scenarios: list[Document]
    ) -> dict[str, TargetInfo]:
        """Return the targets that all variants and scenarios have."""
        found: dict[str, TargetInfo] | None = None
        for system in systems.values():
            for scenario in scenarios:
                here = find_targets(system, [scenario])
                found = here if found is None else _intersect_targets(found, here)
        return found or {}

    def _every(self, tree: MappingNode) -> Fraction | None:
        """Return the distance [s] of recorded rows; None without `record`."""
        node = self.read_mapping(tree.get("record"), "record", ("every",)).get("every")
        if node is None:
            return None
        value, unit = self.read_quantity(node, "every", node.span, None)
        if value <= 0 or not are_compatible(unit.dimension, SECOND):
            self.problems.error("range", node.span, "`every` is a time above zero, like `1 ms`")
            return None
        return value


def _intersect_targets(
    first: Mapping[str, TargetInfo], other: Mapping[str, TargetInfo]
) -> dict[str, TargetInfo]:
    """Return the names that are in both mappings, each with the targets of both."""
    found = {}
    for name, place in first.items():
        if name in other:
            targets = dict.fromkeys((*place.targets, *other[name].targets))
            found[name] = dataclasses.replace(place, targets=tuple(targets))
    return found


def _has_input_targets(variables: tuple[SweepVariable, ...], settings: tuple[Setting, ...]) -> bool:
    """Return whether parts of inputs vary, so that each variant needs its scenario read again."""
    targets = [target for each in variables for target in each.targets]
    targets += [target for each in settings for target in each.targets]
    return any(target.kind == "input" for target in targets)


def _with_measure_outputs(system: System, reader: MeasureReader) -> System:
    """Return the system with the expressions of the measures as additional outputs."""
    outputs, dimensions = dict(system.outputs), dict(system.dimensions)
    for name, (formula, dimension) in reader.expressions.items():
        outputs[name] = dataclasses.replace(formula, key=f"measures.{name}")
        dimensions[name] = dimension
    return dataclasses.replace(system, outputs=outputs, dimensions=dimensions)


def _bind_scenarios(
    scenarios: Mapping[str, Scenario], documents: Mapping[str, Document], keep_documents: bool
) -> dict[str, ScenarioBinding]:
    """Return the scenario bindings by name, with documents if `keep_documents`."""
    return {
        name: ScenarioBinding(scenario, documents[name] if keep_documents else None)
        for name, scenario in scenarios.items()
    }


def signals_of(measures: tuple[Measure, ...]) -> tuple[str, ...]:
    """Return the recorded signals of the signal measures in their order, without duplicates.

    Other measures are ignored.
    """
    found = [measure.signal for measure in measures if isinstance(measure, SignalMeasure)]
    return tuple(dict.fromkeys(found))


def _to_plain_data(node: YamlNode, omitted: tuple[str, ...] | frozenset[str]) -> Any:
    """Return a node as nested dicts, lists and strings, without the omitted keys at the top level.

    Below the top level only the keys of texts are omitted.
    """
    match node:
        case ScalarNode():
            return node.text
        case SequenceNode():
            return [_to_plain_data(item, TEXT_KEYS) for item in node.nodes]
        case MappingNode():
            return {e.key: _to_plain_data(e.node, TEXT_KEYS) for e in node if e.key not in omitted}


def _digest(data: Any) -> str:
    """Return the SHA-256 digest of the JSON form of data."""
    return hashlib.sha256(json.dumps(data).encode()).hexdigest()
