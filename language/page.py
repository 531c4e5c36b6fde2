"""Page reader: calibrations that change while a system runs, by time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from language.declaration import Parameter
from language.document import Entry, Node, Scalar, Table
from language.experiment import Page, System
from language.problem import Problems, Source, Span, nearest
from language.stimulus import StimulusReader
from language.wait import tunable_waits


def read_pages(node: Node | None, system: System, problems: Problems) -> tuple[Page, ...]:
    """Return the pages of `pages: {1.5 s: {est.k_hs: 6000 N*m/rad}}`, problems reported."""
    return _PageReader(problems, system).pages(node)


def pages_of(texts: Sequence[str], system: System) -> tuple[Page, ...]:
    """Return the pages of command-line texts `1.5 s: k_hs = 6000 N*m/rad`. Raises SpecError."""
    problems = Problems()
    times: dict[str, Table] = {}
    for text in texts:
        span = Span(Source("--change", (text,)), 1, 1, max(1, len(text)))
        time, colon, rest = text.partition(":")
        name, equals, value = rest.partition("=")
        if not (colon and equals and time.strip() and name.strip() and value.strip()):
            label = "a change of the calibration is `time: parameter = value`"
            problems.error("form", span, label, "like `1.5 s: k_hs = 6000 N*m/rad`")
            continue
        entry = Entry(name.strip(), span, Scalar(value.strip(), span))
        before = times.get(time.strip(), Table({}, span))
        times[time.strip()] = Table({**before.entries, entry.key: entry}, span)
    table = {time: Entry(time, page.span, page) for time, page in times.items()}
    problems.stop_if_any()
    found = read_pages(Table(table, Span(Source("--change"), 1, 1)), system, problems)
    problems.stop_if_any()
    return found


class _PageReader(StimulusReader):
    """Each page is a table of tunable parameters at a time."""

    def __init__(self, problems: Problems, system: System) -> None:
        super().__init__(problems)
        self.system = system
        self.waits = {name: tunable_waits(i.automaton) for name, i in system.instances.items()}
        self.tunable: dict[str, dict[str, Parameter]] = {
            name: {
                p.name: p
                for p in instance.automaton.parameters.values()
                if _may_change(p) and p.name not in self.waits[name]
            }
            for name, instance in system.instances.items()
        }

    def pages(self, node: Node | None) -> tuple[Page, ...]:
        found: list[Page] = []
        for entry in self.table(node, "pages"):
            told = len(self.problems.found)
            time = self.time(Scalar(entry.key, entry.span), "the time of a page", entry.span)
            is_time = len(self.problems.found) == told
            if is_time and found and time <= found[-1].time:
                self.problems.error("order", entry.span, "pages are in the order of time")
            values: dict[tuple[str, str], Fraction] = {}
            for item in self.table(entry.node, f"pages.{entry.key}"):
                values.update(self._values(item))
            found.append(Page(time, values))
        return tuple(found)

    def _values(self, entry: Entry) -> Mapping[tuple[str, str], Fraction]:
        """A parameter of one instance, or of all that have it as a tunable one."""
        owner, dot, name = entry.key.rpartition(".")
        held = [o for o, waits in self.waits.items() if name in waits and (not dot or o == owner)]
        if held:
            label = f"`{held[0]}.{name}` is a wait: it stays as it is while a system runs"
            self.problems.error("name", entry.span, label)
            return {}
        owners = [o for o in self.tunable if name in self.tunable[o] and (not dot or o == owner)]
        if not owners:
            known = [f"{o}.{n}" for o, tunable in self.tunable.items() for n in tunable]
            label = f"`{entry.key}` is not a tunable parameter of `{self.system.name}`"
            hint = nearest(entry.key, [*known, *(n for t in self.tunable.values() for n in t)])
            self.problems.error("name", entry.span, label, hint)
        return {(o, name): self._tuned(entry, self.tunable[o][name]) for o in owners}

    def _tuned(self, entry: Entry, parameter: Parameter) -> Fraction:
        value, _ = self.quantity(entry.node, entry.key, entry.span, parameter.unit)
        limits = parameter.range
        if limits and not limits[0] <= value <= limits[1]:
            place = entry.node.span
            label = f"the value of `{parameter.name}` is outside its range"
            self.problems.error("range", place, label)
        return value


def _may_change(parameter: Parameter) -> bool:
    """Tables, whole numbers, waits and words stay as they are while a system runs."""
    return parameter.kind == "tunable" and parameter.type == "real" and parameter.table is None
