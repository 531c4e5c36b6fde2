"""Scenario reader: inputs over time, start values, horizon and what is recorded."""

from __future__ import annotations

import os
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from language.document import Document, Scalar, Table, require_kind
from language.experiment import RecordingMap, Scenario, System
from language.inside import RECORDINGS, exists, require_inside
from language.literal import constant
from language.map import MAP_KEYS, column_dimension, map_of
from language.page import read_pages
from language.problem import Problems, Span, nearest
from language.project import Project, expanded
from language.signal import Piece, RecordingUse, Stimulus
from language.stimulus import StimulusReader
from language.syntax import Application, Name, Tree
from language.units import Dimension, Unit, fits

SCENARIO_KEYS = tuple(
    "language scenario of horizon seed initial inputs pages recording record".split()  # noqa: SIM905
)
RECORDING_KEYS = ("file", "map", *(key for key in MAP_KEYS if key not in ("language", "map")))
MAX_HORIZON = Fraction(86400)
"""Longest horizon: a day; longer is a mistake of the unit."""
LARGEST_SEED = 2**31 - 1


def read_scenario(document: Document, project: Project, system: System) -> Scenario:
    """Read a scenario for a system. Raises SpecError with all problems."""
    document = expanded(document, project)
    problems = Problems()
    require_kind(document, "scenario", problems)
    problems.stop_if_any()
    scenario = _ScenarioReader(problems, project, system).read(document)
    problems.stop_if_any()
    return scenario


class _ScenarioReader(StimulusReader):
    """The sections of a scenario, one method each."""

    def __init__(self, problems: Problems, project: Project, system: System) -> None:
        super().__init__(problems)
        self.project = project
        self.system = system
        self.mapping: RecordingMap | None = None

    def read(self, document: Document) -> Scenario:
        tree = self.table(document.root, f"scenario {document.name}", SCENARIO_KEYS)
        at = document.name_span
        recording = self._recording(document, tree)
        self.mapping = recording.mapping if recording else None
        record = self.table(tree.get("record"), "record", ("every", "signals"))
        every_node = record.get("every")
        return Scenario(
            name=document.name,
            of=self.text(tree.get("of"), "of", at),
            horizon=self._horizon(tree, at),
            initial=self._initial(tree),
            inputs=self._inputs(tree, at),
            every=self.time(every_node, "every", at) if every_node else Fraction(1, 1000),
            span=at,
            seed=self.whole(tree.get("seed"), "seed", 0, 0, LARGEST_SEED),
            signals=self._signals(self.items(record.get("signals"), "signals")),
            recording=recording,
            pages=read_pages(tree.get("pages"), self.system, self.problems),
        )

    def _horizon(self, tree: Table, at: Span) -> Fraction | None:
        node = tree.get("horizon")
        if isinstance(node, Scalar) and node.text == "recording":
            if self.mapping is None and not self.problems.has_errors:
                label = "`horizon: recording` needs a `recording` in the scenario"
                self.problems.error("missing", node.span, label)
            return None
        horizon = self.time(node, "horizon", at)
        if node and horizon > MAX_HORIZON:
            self.problems.error("range", node.span, "the horizon is longer than a day")
        return horizon

    def _recording(self, document: Document, tree: Table) -> RecordingUse | None:
        """A file with a map: by name, or written here."""
        node = tree.get("recording")
        if node is None:
            return None
        table = self.table(node, "recording", RECORDING_KEYS)
        file = self.scalar(table.get("file"), "file", table.span)
        named = table.get("map")
        if isinstance(named, Scalar):
            for key in ("time", "columns", "constants"):
                if key in table.entries:
                    label = f"`{key}` stands in the map `{named.text}`"
                    self.problems.error("form", table.entries[key].span, label)
            with self.problems.collecting():
                other = expanded(
                    self.project.read(self.project.path_of(named.text, named.span)), self.project
                )
                return self._use(file, map_of(other.root, other.name, named.span, self.problems))
            return None
        kept = Table({k: e for k, e in table.entries.items() if k != "file"}, table.span)
        return self._use(file, map_of(kept, document.name, table.span, self.problems))

    def _use(self, file: Scalar | None, mapping: RecordingMap) -> RecordingUse | None:
        if file is None:
            return None
        folders = [Path(file.span.source.name).parent, Path(), Path(os.environ.get(RECORDINGS, ""))]
        found = [folder / file.text for folder in folders if exists(folder / file.text)]
        with self.problems.collecting():
            for path in found[:1]:
                require_inside(path, file.span, self.project.root)
        return RecordingUse(found[0] if found else Path(file.text), mapping, file.span)

    def _signals(self, items: Sequence[Scalar]) -> tuple[str, ...]:
        known = self.system.signals
        found: dict[str, None] = {}
        for item in items:
            name = item.text if item.text in known else self._full(item.text)
            if name not in known:
                label = f"`{item.text}` is not a signal of `{self.system.name}`"
                self.problems.error("name", item.span, label, nearest(item.text, known))
            elif name in found:
                self.problems.error("duplicate", item.span, f"`{item.text}` is given twice")
            found[name] = None
        return tuple(found)

    def _full(self, name: str) -> str:
        """In a scenario of an automaton the one instance need not be named."""
        alone = self.system.alone
        return f"{alone}.{name}" if alone and "." not in name else name

    def _initial(self, tree: Table) -> dict[str, Fraction | str]:
        found: dict[str, Fraction | str] = {}
        instances = self.system.instances
        known = [f"{i.name}.{s}" for i in instances.values() for s in i.automaton.states]
        for entry in self.table(tree.get("initial"), "initial"):
            full = self._full(entry.key)
            owner, _, name = full.partition(".")
            if full not in known:
                label = f"`{entry.key}` is not a state of an instance of `{self.system.name}`"
                self.problems.error("name", entry.span, label, nearest(full, known))
                continue
            wanted = instances[owner].automaton.states[name].unit
            formula = self.expression(entry.node, entry.key, entry.span)
            if formula:
                with self.problems.collecting():
                    found[full] = self._start(formula.tree, wanted)
        return found

    def _start(self, tree: Tree, unit: Unit) -> Fraction | str:
        match tree:
            case Application("column", (Name(path, span),), _):
                return self._column(path, span, unit.dimension, "the state")
        return self._constant(tree, unit)

    def _column(self, name: str, span: Span, want: Dimension, what: str) -> str:
        columns = self.mapping.columns if self.mapping else {}
        if name not in columns:
            label = f"`{name}` is not a column of the scenario's recording"
            self.problems.error("name", span, label, nearest(name, columns))
        elif not fits(column_dimension(columns[name]), want):
            label = f"column `{name}` is in `{column_dimension(columns[name]).shown}`"
            self.problems.error("dimension", span, f"{label}, {what} is in `{want.shown}`")
        return name

    def _constant(self, tree: Tree, unit: Unit) -> Fraction:
        value, dimension = constant(tree)
        if not fits(dimension, unit.dimension) and not getattr(tree, "is_bare_zero", False):
            label = f"this is in `{dimension.shown}`, the state is in `{unit.dimension.shown}`"
            self.problems.error("dimension", tree.span, label)
        return value

    def _periods(self, name: str) -> set[Fraction]:
        """Return the periods [s] of the sampled automata that read an input."""
        readers = (c.target[0] for c in self.system.connections.values() if name in c.reads)
        periods = (self.system.instances[reader].automaton.period for reader in readers)
        return {period for period in periods if period is not None}

    def _inputs(self, tree: Table, at: Span) -> dict[str, Stimulus]:
        known = self.system.inputs
        found = self._recorded()
        for entry in self.table(tree.get("inputs"), "inputs"):
            if entry.key not in known:
                label = f"`{entry.key}` is not an input of `{self.system.name}`"
                self.problems.error("name", entry.span, label, nearest(entry.key, known))
                continue
            if entry.key in found:
                label = f"input `{entry.key}` is given by the recording, too"
                self.problems.error("duplicate", entry.span, label)
            thing = known[entry.key]
            found[entry.key] = self.stimulus(entry, thing, self._periods(entry.key))
        for name, thing in known.items():
            if name not in found and thing.default is not None:
                found[name] = Stimulus((Piece(Fraction(0), thing.default),), truth=thing.truth)
            elif name not in found and not self.problems.has_errors:
                label = f"input `{name}` of `{self.system.name}` has no value in the scenario"
                self.problems.error("missing", at, label)
        return found

    def _recorded(self) -> dict[str, Stimulus]:
        """The inputs that the recording gives: columns and constants of its map."""
        found: dict[str, Stimulus] = {}
        known = self.system.inputs
        if self.mapping is None:
            return found
        for name, (value, dimension) in self.mapping.constants.items():
            if name in known:
                if not fits(dimension, known[name].unit.dimension):
                    label = f"constant `{name}` is in `{dimension.shown}`"
                    self.problems.error("dimension", self.mapping.span, label)
                found[name] = Stimulus((Piece(Fraction(0), value),), truth=known[name].truth)
        for column in self.mapping.columns.values():
            if column.to is not None and column.to in known:
                want = known[column.to].unit.dimension
                self._column(column.name, column.span, want, f"input `{column.to}`")
                if column.to in found:
                    label = f"input `{column.to}` is fed twice"
                    self.problems.error("duplicate", column.span, label)
                none = (Piece(Fraction(0), Fraction(0)),)
                found[column.to] = Stimulus(none, column.name, known[column.to].truth)
        return found
