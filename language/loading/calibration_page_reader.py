"""Calibration page reader: values of tunable parameters that change during a simulation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from language.loading.stimulus_reader import StimulusReader
from language.lowering.wait_ticks import tunable_waits
from language.model.declaration import Parameter
from language.model.system import ScheduledCalibration, System
from language.text.diagnostic import Problems, Source, Span, suggest_name
from language.text.document import Entry, MappingNode, ScalarNode, YamlNode


def read_pages(
    node: YamlNode | None, system: System, problems: Problems
) -> tuple[ScheduledCalibration, ...]:
    """Return the pages at a node `{1.5 s: {est.k_hs: 6000 N*m/rad}}`; problems are reported.

    Values are in SI by instance and parameter. A key without an instance sets the parameter in all
    instances that have it. Only tunable reals without a lookup table, which no `wait` uses, can be
    set. Reported are other names, values outside the range and times that do not ascend. An absent
    node has no pages.
    """
    return _PageReader(problems, system).read_pages(node)


def parse_pages(texts: Sequence[str], system: System) -> tuple[ScheduledCalibration, ...]:
    """Return the pages of command-line texts like `1.5 s: k_hs = 6000 N*m/rad`.

    Texts of the same time, compared as text, form one page, and the last of equal names counts.
    Pages must be in the order of time. Raises SpecError with all problems, placed in `--change`.
    """
    problems = Problems()
    times: dict[str, MappingNode] = {}
    for text in texts:
        span = Span(Source("--change", (text,)), 1, 1, max(1, len(text)))
        time, colon, rest = text.partition(":")
        name, equals, value = rest.partition("=")
        if not (colon and equals and time.strip() and name.strip() and value.strip()):
            label = "a change of the calibration is `time: parameter = value`"
            problems.error("form", span, label, "like `1.5 s: k_hs = 6000 N*m/rad`")
            continue
        entry = Entry(name.strip(), span, ScalarNode(value.strip(), span))
        before = times.get(time.strip(), MappingNode({}, span))
        times[time.strip()] = MappingNode({**before.entries, entry.key: entry}, span)
    table = {time: Entry(time, page.span, page) for time, page in times.items()}
    problems.raise_if_errors()
    pages = read_pages(MappingNode(table, Span(Source("--change"), 1, 1)), system, problems)
    problems.raise_if_errors()
    return pages


class _PageReader(StimulusReader):
    """Reads pages; each page is a mapping of tunable parameters at a time."""

    def __init__(self, problems: Problems, system: System) -> None:
        """Collect the tunable parameters and the tunable waits of all instances."""
        super().__init__(problems)
        self.system = system
        self.waits = {name: tunable_waits(i.automaton) for name, i in system.instances.items()}
        self.tunable: dict[str, dict[str, Parameter]] = {
            name: {
                p.name: p
                for p in instance.automaton.parameters.values()
                if _is_changeable(p) and p.name not in self.waits[name]
            }
            for name, instance in system.instances.items()
        }

    def read_pages(self, node: YamlNode | None) -> tuple[ScheduledCalibration, ...]:
        """Return the pages in the order of the file; times that do not ascend are reported."""
        pages: list[ScheduledCalibration] = []
        for entry in self.read_mapping(node, "pages"):
            time = self.read_valid_time(
                ScalarNode(entry.key, entry.span), "the time of a page", entry.span
            )
            if time is not None and pages and time <= pages[-1].time:
                self.problems.error("order", entry.span, "pages are in the order of time")
            values: dict[tuple[str, str], Fraction] = {}
            for item in self.read_mapping(entry.node, f"pages.{entry.key}"):
                values.update(self._read_values(item))
            if time is not None:
                pages.append(ScheduledCalibration(time, values))
        return tuple(pages)

    def _read_values(self, entry: Entry) -> Mapping[tuple[str, str], Fraction]:
        """Return the value of an entry by instance and parameter.

        Without an instance in its key the value applies to all instances that have the tunable
        parameter. Waits and parameters that are not tunable are reported.
        """
        owner, dot, name = entry.key.rpartition(".")
        wait_owners = [
            o for o, waits in self.waits.items() if name in waits and (not dot or o == owner)
        ]
        if wait_owners:
            label = f"`{wait_owners[0]}.{name}` is a wait: it stays as it is while a system runs"
            self.problems.error("name", entry.span, label)
            return {}
        owners = [o for o in self.tunable if name in self.tunable[o] and (not dot or o == owner)]
        if not owners:
            known = [f"{o}.{n}" for o, tunable in self.tunable.items() for n in tunable]
            label = f"`{entry.key}` is not a tunable parameter of `{self.system.name}`"
            hint = suggest_name(entry.key, [*known, *(n for t in self.tunable.values() for n in t)])
            self.problems.error("name", entry.span, label, hint)
        return {(o, name): self._read_tunable(entry, self.tunable[o][name]) for o in owners}

    def _read_tunable(self, entry: Entry, parameter: Parameter) -> Fraction:
        """Return a value in SI; one outside the range of the parameter is reported."""
        value, _ = self.read_quantity(entry.node, entry.key, entry.span, parameter.unit)
        unit, place = parameter.unit, entry.node.span
        self.check_value_in_range(parameter.name, value, parameter.range, unit, place)
        return value


def _is_changeable(parameter: Parameter) -> bool:
    """Tell whether a page may change a parameter: a tunable real without a lookup table."""
    return parameter.kind == "tunable" and parameter.type == "real" and parameter.table is None
