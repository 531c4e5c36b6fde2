"""Reader: a test from its document, checked with the system and the scenario that it names."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from fractions import Fraction

from expectation.condition import ConditionReader
from expectation.expected import Condition, Expectation, Place, Subject, Test, Trigger, When
from expectation.places import nearest_mode, require_mode_output, said
from expectation.recording import recording
from language.declaration import Formula
from language.document import Document, Entry, Node, Scalar, Table, require_kind
from language.event_name import EventName, read_event
from language.experiment import Scenario, System
from language.model import CHART
from language.overlay import without
from language.problem import Problems, Span, nearest
from language.project import Project, expanded
from language.reader import Reader, about_of
from language.requirement import all_requirements, requirements_of
from language.scenario import SCENARIO_KEYS, read_scenario
from language.syntax import Broken
from language.system import read_system
from language.units import SECOND, fits
from language.wiring import INACTIVE

TEST_KEYS = ("language", "test", "scenario", "of", "values", "every", "expect")
INNER_KEYS = tuple(key for key in SCENARIO_KEYS if key not in ("language", "scenario"))
"""The keys of a scenario that is written in a test."""
MOMENTS = ("at", "within", "before", "after", "from", "until")
KEYS: Mapping[str, tuple[str, ...]] = {
    "that": MOMENTS,
    "always": ("from", "until", "after", "within"),
    "never": ("from", "until", "after", "within"),
    "event": (*MOMENTS, "count"),
    "modes": ("of", "from", "until"),
}
"""What an expectation may be, and what stands beside it."""
MOST_EVENTS = 1_000_000


def read_test(document: Document, project: Project, problems: Problems | None = None) -> Test:
    """Read a test with its system and scenario. Raises SpecError with all problems."""
    document = expanded(document, project)
    problems = problems if problems is not None else Problems()
    require_kind(document, "test", problems)
    problems.stop_if_any()
    test = _TestReader(problems, project).read(document)
    problems.stop_if_any()
    return test


class _TestReader(Reader):
    """The sections of a test, one method each."""

    system: System
    scenario: Scenario
    written: Document
    conditions: ConditionReader

    def __init__(self, problems: Problems, project: Project) -> None:
        super().__init__(problems)
        self.project = project

    def read(self, document: Document) -> Test:
        tree = self.table(document.root, f"test {document.name}", TEST_KEYS)
        at = document.name_span
        self._load(tree, document)
        self.problems.stop_if_any()
        self.conditions = ConditionReader(self.problems, self.system)
        if tree.get("every") is not None:
            every = self._time(tree.get("every"), "every") or Fraction(1, 1000)
            self.scenario = dataclasses.replace(self.scenario, every=every)
        node = tree.get("expect")
        found = [self._expectation(entry) for entry in self.named(node, "expect")]
        if node is None or (isinstance(node, Table) and not node.entries):
            label, hint = "a test has `expect`", "like `{ends: {at: end, that: est.mode == drive}}`"
            self.problems.error("missing", at, label, hint)
        expectations = tuple(each for each in found if each is not None)
        return Test(
            name=document.name,
            system=self.system,
            scenario=recording(self.scenario, self.system, expectations, self.problems),
            expectations=expectations,
            span=at,
            source=document.source,
            about=about_of(tree),
            requirements=all_requirements(
                without(document.root, "expect"), expanded(self.written, self.project).root
            ),
        )

    def _load(self, tree: Table, document: Document) -> None:
        """The system and the scenario: named, or with the scenario written here."""
        node, at = tree.get("scenario"), document.name_span
        if isinstance(node, Table):
            inner = self.table(node, "scenario", INNER_KEYS)
            written = Document("scenario", document.name, node.span, inner, document.source)
        else:
            named = self.scalar(node, "scenario", at)
            self.problems.stop_if_any()
            assert named is not None
            written = self.project.read(self.project.path_of(named.text, named.span))
        of = tree.get("of")
        if of is None:
            of = expanded(written, self.project).root.get("of")
        named = self.scalar(of, "of", written.name_span)
        values = tree.get("values")
        overrides = {
            entry.key: entry.node
            for entry in self.table(values, "values")
            if self.scalar(entry.node, entry.key, entry.span)
        }
        self.problems.stop_if_any()
        assert named is not None
        document = self.project.read(self.project.path_of(named.text, named.span))
        self.system = read_system(document, self.project, overrides)  # type: ignore[arg-type]
        self.scenario = read_scenario(written, self.project, self.system)
        self.written = written

    def _expectation(self, entry: Entry) -> Expectation | None:
        told = len(self.problems.found)
        found = self.kind_of(entry, f"expect.{entry.key}", KEYS, "expects")
        if found is None:
            return None
        kind, own = found
        place = self._place(own, entry.span) if kind == "modes" else None
        subject = self._subject(kind, own.entries[kind], place)
        when = self._when(own, entry, kind)
        if subject is None or len(self.problems.found) > told:
            return None
        self._at_rows(subject, when, own)
        count = own.get("count")
        return Expectation(
            name=entry.key,
            kind=kind,  # type: ignore[arg-type]
            subject=subject,
            when=when,
            text=_text(own.get(kind)),
            span=own.entries[kind].node.span,
            count=self.whole(count, "count", 1, 0, MOST_EVENTS) if count is not None else None,
            place=place,
            requirements=requirements_of(own),
        )

    # What is expected.

    def _subject(self, kind: str, entry: Entry, place: Place | None) -> Subject | None:
        if kind == "modes":
            return self._modes(entry.node, place)
        scalar = self.scalar(entry.node, kind, entry.span)
        if scalar is None:
            return None
        if kind == "event":
            return self._event(scalar)
        return self._condition(scalar, kind)

    def _condition(self, scalar: Scalar, key: str) -> Condition | None:
        formula: Formula | None = self.expression(scalar, key, scalar.span)
        if formula is None or isinstance(formula.tree, Broken):
            return None
        return self.conditions.condition(scalar, formula)

    def _trigger(self, node: Node | None, at: Span) -> Trigger | None:
        """What something is expected after: an event, or a condition that turns true."""
        scalar = self.scalar(node, "after", at)
        if scalar is None:
            return None
        if "->" in scalar.text or scalar.text in self.conditions.modes:
            return self._event(scalar)
        return self._condition(scalar, "after")

    def _event(self, scalar: Scalar) -> EventName | None:
        event = read_event(scalar, self.system, self.problems)
        if event:
            require_mode_output(self.system, event.instance, scalar.span, self.problems)
        return event

    def _place(self, own: Table, at: Span) -> Place | None:
        """The region whose modes are expected: `est`, `est.gap`."""
        places = [
            (name, region.name)
            for name, instance in self.system.instances.items()
            for region in instance.automaton.all_regions
        ]
        alone = self.system.alone
        known = {region: (name, region) for name, region in places if name == alone}
        known |= {said(place): place for place in places}
        if own.get("of") is None and alone:
            require_mode_output(self.system, alone, at, self.problems)
            return alone, CHART
        scalar = self.scalar(own.get("of"), "of", at)
        if scalar is None:
            return None
        if scalar.text not in known:
            label = (
                f"`{scalar.text}` is not an instance of `{self.system.name}`, nor a region of one"
            )
            self.problems.error("name", scalar.span, label, nearest(scalar.text, known))
            return None
        require_mode_output(self.system, known[scalar.text][0], scalar.span, self.problems)
        return known[scalar.text]

    def _modes(self, node: Node, place: Place | None) -> tuple[str, ...] | None:
        items = self.items(node, "modes")
        if place is None or not items:
            return None
        region = self.system.instances[place[0]].automaton.region(place[1])
        modes = [*region.modes, *([INACTIVE] if region.inactive is not None else [])]
        for item in items:
            if item.text not in modes:
                self._unknown_mode(item, place, modes)
        return tuple(item.text for item in items)

    def _unknown_mode(self, item: Scalar, place: Place, modes: Sequence[str]) -> None:
        """Report a mode that a region has not, or that has others inside it."""
        label = f"`{item.text}` is not a mode of `{said(place)}`"
        hint = nearest_mode(item.text, place, self.system)
        inner = [mode for mode in modes if mode.startswith(f"{item.text}.")]
        if inner:
            label = f"`{item.text}` has modes inside it, and what is listed are the innermost"
            hint = f"like `{inner[0]}`"
        self.problems.error("name", item.span, label, hint)

    # When it is expected.

    def _when(self, own: Table, entry: Entry, kind: str) -> When:
        given = {key: own.entries[key] for key in MOMENTS if key in own.entries}
        self._require_one_moment(given, entry, kind)
        times = {key: self._moment(own.get(key), key) for key in MOMENTS if key != "after"}
        after = self._trigger(own.get("after"), entry.span) if "after" in given else None
        since, until = times["from"], times["until"]
        if since is not None and until is not None and since > until:
            label = "the window is empty: `from` is after `until`"
            self.problems.error("range", given["from"].span, label)
        return When(
            times["at"], times["within"], times["before"], since, until, after,
            _text(own.get("after")),
        )  # fmt: skip

    def _require_one_moment(self, given: Mapping[str, Entry], entry: Entry, kind: str) -> None:
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

    def _moment(self, node: Node | None, key: str) -> Fraction | None:
        horizon = self.scenario.horizon
        if node is None:
            return None
        if isinstance(node, Scalar) and node.text == "end" and key in ("at", "until"):
            if horizon is None:
                label = "the run ends with its recording: say a time"
                self.problems.error("form", node.span, label)
            return horizon
        told = len(self.problems.found)
        time = self._time(node, key)
        if len(self.problems.found) > told:
            return None
        if horizon is not None and time > horizon:
            label = f"`{key}` is after the end of the run, {float(horizon):.9g} s"
            self.problems.error("range", node.span, label)
        return time

    def _time(self, node: Node | None, what: str) -> Fraction:
        assert node is not None
        value, unit = self.quantity(node, what, node.span, None)
        if value < 0 or (value and not fits(unit.dimension, SECOND)):
            self.problems.error("range", node.span, f"`{what}` is a time, like `15 ms`")
        return value

    def _at_rows(self, subject: Subject, when: When, own: Table) -> None:
        """Signals are known at rows: `at` is the time of one."""
        every = self.scenario.every
        if not isinstance(subject, Condition) or not subject.all_signals:
            return
        if when.at is not None and when.within is None and when.at % every:
            label = f"`at` lies between two rows, of which there is one every {float(every):.9g} s"
            hint = "`every:` of the test says how often signals are looked at"
            self.problems.error("range", own.entries["at"].node.span, label, hint)


def _text(node: Node | None) -> str:
    return node.text if isinstance(node, Scalar) else ""
