"""Test reader: read a test from its document and check it against its system and scenario."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

from expectation.condition import ConditionReader
from expectation.expectations import (
    Condition,
    Expectation,
    RegionRef,
    Subject,
    Test,
    TimeConstraint,
    Trigger,
)
from expectation.name_resolution import (
    format_region,
    is_chart,
    mode_signals,
    require_mode_output,
    suggest_mode,
)
from language.expressions.syntax_tree import ErrorNode
from language.ir.root_region import CHART
from language.loading.mode_entry_event import ModeEntryEvent, read_event
from language.loading.scenario_reader import SCENARIO_KEYS, read_scenario
from language.loading.system_reader import read_system
from language.lowering.program_builder import INACTIVE
from language.model.declaration import Formula
from language.model.system import Scenario, System
from language.overlays.expand_document import Project, expand_document
from language.readers.base_reader import Reader
from language.text.diagnostic import Problems, Span, suggest_name
from language.text.document import Document, Entry, MappingNode, ScalarNode, YamlNode, require_kind
from language.text.overlay import without_keys
from language.text.requirement import all_requirements, requirements_of

MAX_ROWS = 1_000_000
"""Largest number of rows; more indicate a wrong horizon or period."""


def select_recorded_signals(
    scenario: Scenario, system: System, expectations: Sequence[Expectation], problems: Problems
) -> Scenario:
    """Return the scenario with the signals that the expectations need as its only recorded ones.

    Without any, it is the first signal of the system. For each chart with the output `mode`, the
    modes of all its regions are added and `every` is refined to its ticks, because transitions do
    not determine them. More than MAX_ROWS rows after that are reported as an error.
    """
    read = [n for e in expectations for c in e.conditions for n in c.all_signals]
    every = scenario.every
    for name, instance in system.instances.items():
        automaton = instance.automaton
        if is_chart(system, name) and "mode" in automaton.outputs:
            read += mode_signals(system, name)
            if automaton.period:
                every = _common_period(every, automaton.period, instance.offset)
    horizon = scenario.horizon
    if every != scenario.every and horizon and horizon / every > MAX_ROWS:
        label = f"rows at all ticks of its charts are more than {MAX_ROWS}"
        problems.error("range", scenario.span, label, "a shorter `horizon`")
    signals = tuple(dict.fromkeys(read)) or system.signals[:1]
    return dataclasses.replace(scenario, signals=signals, every=every)


def _common_period(every: Fraction, period: Fraction, offset: Fraction) -> Fraction:
    """Return the greatest common divisor of three times [s]."""
    times = (every, period, offset)
    whole = math.lcm(*(time.denominator for time in times))
    return Fraction(math.gcd(*(int(time * whole) for time in times)), whole)


TEST_KEYS = ("language", "test", "scenario", "of", "values", "every", "expect")
"""The sections of a test."""

INLINE_SCENARIO_KEYS = tuple(key for key in SCENARIO_KEYS if key not in ("language", "scenario"))
"""The keys of a scenario that is part of a test."""

TIME_KEYS = ("at", "within", "before", "after", "from", "until")
"""The keys of a time constraint."""

EXPECTATION_KEYS: Mapping[str, tuple[str, ...]] = {
    "that": TIME_KEYS,
    "always": ("from", "until", "after", "within"),
    "never": ("from", "until", "after", "within"),
    "event": (*TIME_KEYS, "count"),
    "modes": ("of", "from", "until"),
}
"""The kinds of expectations with the keys beside them."""

MAX_EVENTS = 1_000_000
"""Largest expected number of events."""


def read_test(document: Document, project: Project, problems: Problems | None = None) -> Test:
    """Return a checked test with its system and scenario.

    Raises SpecError if the document is no test or has errors; all that were found are reported to
    `problems`, if given. Other files are read through the project.
    """
    document = expand_document(document, project)
    problems = problems if problems is not None else Problems()
    require_kind(document, "test", problems)
    problems.raise_if_errors()
    test = _TestReader(problems, project).read(document)
    problems.raise_if_errors()
    return test


class _TestReader(Reader):
    """Reader with one method for each section of a test."""

    system: System
    scenario: Scenario
    scenario_document: Document
    conditions: ConditionReader

    def __init__(self, problems: Problems, project: Project) -> None:
        super().__init__(problems)
        self.project = project

    def read(self, document: Document) -> Test:
        """Return the test of an expanded document; reports problems section by section."""
        tree = self.read_mapping(document.root, f"test {document.name}", TEST_KEYS)
        at = document.name_span
        self._load(tree, document)
        self.problems.raise_if_errors()
        self.conditions = ConditionReader(self.problems, self.system)
        if tree.get("every") is not None:
            every = self.read_duration(tree.get("every"), "every") or Fraction(1, 1000)
            self.scenario = dataclasses.replace(self.scenario, every=every)
        node = tree.get("expect")
        found = [self._expectation(entry) for entry in self.named_entries(node, "expect")]
        if node is None or (isinstance(node, MappingNode) and not node.entries):
            label, hint = "a test has `expect`", "like `{ends: {at: end, that: est.mode == drive}}`"
            self.problems.error("missing", at, label, hint)
        expectations = tuple(each for each in found if each is not None)
        return Test(
            name=document.name,
            system=self.system,
            scenario=select_recorded_signals(
                self.scenario, self.system, expectations, self.problems
            ),
            expectations=expectations,
            span=at,
            source=document.source,
            about=tree.text_of("about"),
            requirements=all_requirements(
                without_keys(document.root, "expect"),
                expand_document(self.scenario_document, self.project).root,
            ),
        )

    def _load(self, tree: MappingNode, document: Document) -> None:
        """Read the system, and the scenario by name or from the section `scenario`."""
        node, at = tree.get("scenario"), document.name_span
        if isinstance(node, MappingNode):
            inner = self.read_mapping(node, "scenario", INLINE_SCENARIO_KEYS)
            written = Document("scenario", document.name, node.span, inner, document.source)
        else:
            named = self.read_scalar(node, "scenario", at)
            self.problems.raise_if_errors()
            assert named is not None
            written = self.project.read(self.project.path_of(named.text, named.span))
        of = tree.get("of")
        if of is None:
            of = expand_document(written, self.project).root.get("of")
        named = self.read_scalar(of, "of", written.name_span)
        values = tree.get("values")
        overrides = {
            entry.key: entry.node
            for entry in self.read_mapping(values, "values")
            if self.read_scalar(entry.node, entry.key, entry.span)
        }
        self.problems.raise_if_errors()
        assert named is not None
        document = self.project.read(self.project.path_of(named.text, named.span))
        self.system = read_system(document, self.project, overrides)  # type: ignore[arg-type]
        self.scenario = read_scenario(written, self.project, self.system)
        self.scenario_document = written

    def _expectation(self, entry: Entry) -> Expectation | None:
        """Return the expectation of an entry; None if a problem was reported."""
        problem_count = len(self.problems.reported)
        found = self.read_alternative(entry, f"expect.{entry.key}", EXPECTATION_KEYS, "expects")
        if found is None:
            return None
        kind, own = found
        place = self._region_ref(own, entry.span) if kind == "modes" else None
        subject = self._subject(kind, own.entries[kind], place)
        when = self._when(own, entry, kind)
        if subject is None or len(self.problems.reported) > problem_count:
            return None
        self._require_row_time(subject, when, own)
        count = own.get("count")
        return Expectation(
            name=entry.key,
            kind=kind,  # type: ignore[arg-type]
            subject=subject,
            when=when,
            text=_text(own.get(kind)),
            span=own.entries[kind].node.span,
            count=self.read_integer(count, "count", 1, 0, MAX_EVENTS)
            if count is not None
            else None,
            region_ref=place,
            requirements=requirements_of(own),
        )

    # Subjects.

    def _subject(self, kind: str, entry: Entry, region_ref: RegionRef | None) -> Subject | None:
        """Return the subject of an expectation; None if a problem was reported."""
        if kind == "modes":
            return self._modes(entry.node, region_ref)
        scalar = self.read_scalar(entry.node, kind, entry.span)
        if scalar is None:
            return None
        if kind == "event":
            return self._event(scalar)
        return self._condition(scalar, kind)

    def _condition(self, scalar: ScalarNode, key: str) -> Condition | None:
        """Return the condition of an expression; None if a problem was reported."""
        formula: Formula | None = self.read_expression(scalar, key, scalar.span)
        if formula is None or isinstance(formula.tree, ErrorNode):
            return None
        return self.conditions.read_condition(scalar, formula)

    def _trigger(self, node: YamlNode | None, at: Span) -> Trigger | None:
        """Return the trigger `after`: an event (`->` or a mode name) or a condition."""
        scalar = self.read_scalar(node, "after", at)
        if scalar is None:
            return None
        if "->" in scalar.text or scalar.text in self.conditions.modes:
            return self._event(scalar)
        return self._condition(scalar, "after")

    def _event(self, scalar: ScalarNode) -> ModeEntryEvent | None:
        """Return an event of the system; None if a problem was reported."""
        event = read_event(scalar, self.system, self.problems)
        if event:
            require_mode_output(self.system, event.instance, scalar.span, self.problems)
        return event

    def _region_ref(self, own: MappingNode, at: Span) -> RegionRef | None:
        """Return the region `of` of expected modes, e.g. `est` or `est.gap`.

        Without `of` it is the main region of a single instance. None if a problem was reported.
        """
        places = [
            (name, region.name)
            for name, instance in self.system.instances.items()
            for region in instance.automaton.all_regions
        ]
        alone = self.system.sole_instance
        known = {region: (name, region) for name, region in places if name == alone}
        known |= {format_region(place): place for place in places}
        if own.get("of") is None and alone:
            require_mode_output(self.system, alone, at, self.problems)
            return alone, CHART
        scalar = self.read_scalar(own.get("of"), "of", at)
        if scalar is None:
            return None
        if scalar.text not in known:
            label = (
                f"`{scalar.text}` is not an instance of `{self.system.name}`, nor a region of one"
            )
            self.problems.error("name", scalar.span, label, suggest_name(scalar.text, known))
            return None
        require_mode_output(self.system, known[scalar.text][0], scalar.span, self.problems)
        return known[scalar.text]

    def _modes(self, node: YamlNode, region_ref: RegionRef | None) -> tuple[str, ...] | None:
        """Return the expected modes of a region; reports unknown ones."""
        items = self.read_list(node, "modes")
        if region_ref is None or not items:
            return None
        region = self.system.instances[region_ref[0]].automaton.region(region_ref[1])
        modes = [*region.modes, *([INACTIVE] if region.inactive is not None else [])]
        for item in items:
            if item.text not in modes:
                self._report_unknown_mode(item, region_ref, modes)
        return tuple(item.text for item in items)

    def _report_unknown_mode(
        self, item: ScalarNode, region_ref: RegionRef, modes: Sequence[str]
    ) -> None:
        """Report a name that is no leaf mode of a region."""
        label = f"`{item.text}` is not a mode of `{format_region(region_ref)}`"
        hint = suggest_mode(item.text, region_ref, self.system)
        inner = [mode for mode in modes if mode.startswith(f"{item.text}.")]
        if inner:
            label = f"`{item.text}` has modes inside it; list the innermost modes"
            hint = f"like `{inner[0]}`"
        self.problems.error("name", item.span, label, hint)

    # Time constraints.

    def _when(self, own: MappingNode, entry: Entry, kind: str) -> TimeConstraint:
        """Return the time constraint of an expectation; reports contradictions."""
        given = {key: own.entries[key] for key in TIME_KEYS if key in own.entries}
        self._require_one_time(given, entry, kind)
        times = {key: self._time_point(own.get(key), key) for key in TIME_KEYS if key != "after"}
        after = self._trigger(own.get("after"), entry.span) if "after" in given else None
        since, until = times["from"], times["until"]
        if since is not None and until is not None and since > until:
            label = "the window is empty: `from` is after `until`"
            self.problems.error("range", given["from"].span, label)
        return TimeConstraint(
            times["at"], times["within"], times["before"], since, until, after,
            _text(own.get("after")),
        )  # fmt: skip

    def _require_one_time(self, given: Mapping[str, Entry], entry: Entry, kind: str) -> None:
        """Report missing, duplicate and incompatible keys of a time constraint."""
        moments = [key for key in ("at", "before", "after") if key in given]
        if len(moments) > 1:
            label = f"`{moments[0]}` and `{moments[1]}` say two moments"
            self.problems.error("form", given[moments[1]].span, label, "two expectations")
        elif not moments and kind == "that":
            label = f"`{entry.key}` does not say when"
            hint = "with `at`, `before` or `after`; `always` and `never` are for all of a run"
            self.problems.error("missing", entry.span, label, hint)
        elif moments == ["after"] and "within" not in given:
            label = "`after` goes with `within`, a time"
            self.problems.error("missing", given["after"].span, label, "like `within: 20 ms`")
        elif "within" in given and not {"at", "after"} & {*moments}:
            label = "`within` goes with `at` or `after`"
            self.problems.error("form", given["within"].span, label)
        for key in ("from", "until"):
            if key in given and (moments == ["at"] or (moments == ["before"] and key == "until")):
                label = f"`{key}` does not go with `{moments[0]}`"
                self.problems.error("form", given[key].span, label)

    def _time_point(self, node: YamlNode | None, key: str) -> Fraction | None:
        """Return a time [s]; `end` is the horizon. Reports times after the end of the run."""
        horizon = self.scenario.horizon
        if node is None:
            return None
        if isinstance(node, ScalarNode) and node.text == "end" and key in ("at", "until"):
            if horizon is None:
                label = "the run ends with its recording: say a time"
                self.problems.error("form", node.span, label)
            return horizon
        problem_count = len(self.problems.reported)
        time = self.read_duration(node, key)
        if len(self.problems.reported) > problem_count:
            return None
        if horizon is not None and time > horizon:
            label = f"`{key}` is after the end of the run, {float(horizon):.9g} s"
            self.problems.error("range", node.span, label)
        return time

    def _require_row_time(self, subject: Subject, when: TimeConstraint, own: MappingNode) -> None:
        """Report a condition of signals whose time `at` is not the time of a row."""
        every = self.scenario.every
        if not isinstance(subject, Condition) or not subject.all_signals:
            return
        if when.at is not None and when.within is None and when.at % every:
            label = f"`at` lies between two rows, of which there is one every {float(every):.9g} s"
            hint = "`every:` of the test says how often signals are looked at"
            self.problems.error("range", own.entries["at"].node.span, label, hint)


def _text(node: YamlNode | None) -> str:
    """Return the text of a scalar node; empty for other nodes."""
    return node.text if isinstance(node, ScalarNode) else ""
