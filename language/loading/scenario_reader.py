"""Scenario reader: inputs over time, initial values, horizon and recorded signals."""

from __future__ import annotations

import os
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from language.expressions.constant_literal import evaluate_literal
from language.expressions.syntax_tree import FunctionCall, Name, SyntaxTree
from language.expressions.units import Dimension, Unit, are_compatible
from language.loading.calibration_page_reader import read_pages
from language.loading.recording_map_columns import add_signal_types, type_of_input
from language.loading.recording_map_reader import MAP_KEYS, column_dimension, read_map_table
from language.loading.stimulus_reader import StimulusReader
from language.model.system import (
    RecordingMap,
    RecordingSource,
    Scenario,
    Stimulus,
    StimulusPiece,
    System,
)
from language.overlays.expand_document import Project, expand_document
from language.text.diagnostic import Problems, Span, suggest_name
from language.text.document import Document, MappingNode, ScalarNode, require_kind
from language.text.project_boundary import RECORDINGS_ENV, path_exists, require_inside_project

SCENARIO_KEYS = tuple(
    "language scenario of horizon seed initial inputs pages recording record".split()  # noqa: SIM905
)
RECORDING_KEYS = ("file", "map", *(key for key in MAP_KEYS if key not in ("language", "map")))
MAX_HORIZON = Fraction(86400)
"""Longest horizon [s]: one day; a longer one suggests a wrong unit."""
LARGEST_SEED = 2**31 - 1


def read_scenario(document: Document, project: Project, system: System) -> Scenario:
    """Return the scenario of a document for a system. Raises SpecError with all problems.

    Overlays are expanded first. Each input has a stimulus from the recording, the scenario or its
    default. The horizon is None for `horizon: recording`, at most MAX_HORIZON otherwise. Defaults:
    seed 0, `every: 1 ms`, no recorded signals.

    The recording file is searched beside the scenario, in the working directory and in the folder
    of RECORDINGS_ENV; it need not exist, and it is not read.
    """
    document = expand_document(document, project)
    problems = Problems()
    require_kind(document, "scenario", problems)
    problems.raise_if_errors()
    scenario = _ScenarioReader(problems, project, system).read(document)
    problems.raise_if_errors()
    return scenario


class _ScenarioReader(StimulusReader):
    """Reads the sections of a scenario."""

    def __init__(self, problems: Problems, project: Project, system: System) -> None:
        """Report into `problems`; the recording map is set while the scenario is read."""
        super().__init__(problems)
        self.project = project
        self.system = system
        self.mapping: RecordingMap | None = None

    def read(self, document: Document) -> Scenario:
        """Return the scenario; problems are reported."""
        tree = self.read_mapping(document.root, f"scenario {document.name}", SCENARIO_KEYS)
        at = document.name_span
        recording = self._read_recording(document, tree)
        self.mapping = recording.mapping if recording else None
        record = self.read_mapping(tree.get("record"), "record", ("every", "signals"))
        every_node = record.get("every")
        return Scenario(
            name=document.name,
            of=self.read_string(tree.get("of"), "of", at),
            horizon=self._read_horizon(tree, at),
            initial=self._read_initial_values(tree),
            inputs=self._read_inputs(tree, at),
            every=self.read_time(every_node, "every", at) if every_node else Fraction(1, 1000),
            span=at,
            seed=self.read_integer(tree.get("seed"), "seed", 0, 0, LARGEST_SEED),
            signals=self._read_signals(self.read_list(record.get("signals"), "signals")),
            recording=recording,
            calibrations=read_pages(tree.get("pages"), self.system, self.problems),
        )

    def _read_horizon(self, tree: MappingNode, at: Span) -> Fraction | None:
        """Return the horizon [s]; None for `horizon: recording`."""
        node = tree.get("horizon")
        if isinstance(node, ScalarNode) and node.text == "recording":
            if tree.get("recording") is None:
                label = "`horizon: recording` needs a `recording` in the scenario"
                self.problems.error("missing", node.span, label)
            return None
        horizon = self.read_time(node, "horizon", at)
        if node and horizon > MAX_HORIZON:
            self.problems.error("range", node.span, "the horizon is longer than a day")
        return horizon

    def _read_recording(self, document: Document, tree: MappingNode) -> RecordingSource | None:
        """Return the recording with its map, or None without a recording.

        The map is named, or it is written in the scenario. Beside the name of a map only `file` is
        allowed; other keys are reported.
        """
        node = tree.get("recording")
        if node is None:
            return None
        table = self.read_mapping(node, "recording", RECORDING_KEYS)
        file = self.read_scalar(table.get("file"), "file", table.span)
        if file:
            self.check_file_name(file.text, file.span, "file")
        if "map" in table.entries:
            named = self.read_scalar(table.get("map"), "map", table.span)
            if named is None:
                return None
            for entry in table:
                if entry.key in MAP_KEYS and entry.key != "map":
                    label = f"`{entry.key}` is given by the map `{named.text}`"
                    hint = "write it in the map, or write the whole map here without `map`"
                    self.problems.error("form", entry.span, label, hint)
            with self.problems.collect_errors():
                other = expand_document(
                    self.project.read(self.project.path_of(named.text, named.span)), self.project
                )
                return self._resolve_recording(
                    file, read_map_table(other.root, other.name, named.span, self.problems)
                )
            return None
        entries = MappingNode({k: e for k, e in table.entries.items() if k != "file"}, table.span)
        return self._resolve_recording(
            file, read_map_table(entries, document.name, table.span, self.problems)
        )

    def _resolve_recording(
        self, file: ScalarNode | None, mapping: RecordingMap
    ) -> RecordingSource | None:
        """Return the recording with the path of its file, or None without a file.

        The file is searched beside the scenario, in the working directory and in the directory of
        the environment variable for recordings. A file outside the project is reported. A file that
        does not exist keeps its name.
        """
        if file is None:
            return None
        folders = [
            Path(file.span.source.name).parent,
            Path(),
            Path(os.environ.get(RECORDINGS_ENV, "")),
        ]
        paths = [folder / file.text for folder in folders if path_exists(folder / file.text)]
        with self.problems.collect_errors():
            for path in paths[:1]:
                require_inside_project(path, file.span, self.project.root)
        types = {
            name: type_of_input(item.type, item.values) for name, item in self.system.inputs.items()
        }
        typed = add_signal_types(mapping, types, {})
        return RecordingSource(paths[0] if paths else Path(file.text), typed, file.span)

    def _read_signals(self, items: Sequence[ScalarNode]) -> tuple[str, ...]:
        """Return the names of the signals to record; unknown and repeated names are reported."""
        known = self.system.signals
        signals: dict[str, None] = {}
        for item in items:
            name = item.text if item.text in known else self._qualified_name(item.text)
            if name not in known:
                label = f"`{item.text}` is not a signal of `{self.system.name}`"
                self.problems.error("name", item.span, label, suggest_name(item.text, known))
            elif name in signals:
                self.problems.error("duplicate", item.span, f"`{item.text}` is given twice")
            signals[name] = None
        return tuple(signals)

    def _qualified_name(self, name: str) -> str:
        """Return a name prefixed by its instance.

        In the system of a single automaton a name without a dot gets that instance.
        """
        alone = self.system.sole_instance
        return f"{alone}.{name}" if alone and "." not in name else name

    def _read_initial_values(self, tree: MappingNode) -> dict[str, Fraction | str]:
        """Return the initial values by `instance.state`: a value in SI or the name of a column.

        Unknown states are reported and left out.
        """
        values: dict[str, Fraction | str] = {}
        instances = self.system.instances
        known = [f"{i.name}.{s}" for i in instances.values() for s in i.automaton.states]
        for entry in self.read_mapping(tree.get("initial"), "initial"):
            full = self._qualified_name(entry.key)
            owner, _, name = full.partition(".")
            if full not in known:
                label = f"`{entry.key}` is not a state of an instance of `{self.system.name}`"
                self.problems.error("name", entry.span, label, suggest_name(full, known))
                continue
            unit = instances[owner].automaton.states[name].unit
            formula = self.read_expression(entry.node, entry.key, entry.span)
            if formula:
                with self.problems.collect_errors():
                    values[full] = self._read_initial_value(formula.tree, unit)
        return values

    def _read_initial_value(self, tree: SyntaxTree, unit: Unit) -> Fraction | str:
        """Return a value in SI, or the name of the column for `column(name)`."""
        match tree:
            case FunctionCall("column", (Name(path, span),), _):
                return self._check_column(path, span, unit.dimension, "the state")
        return self._read_constant(tree, unit)

    def _check_column(self, name: str, span: Span, expected: Dimension, what: str) -> str:
        """Return the name of a column; an unknown one or a wrong dimension is reported."""
        columns = self.mapping.columns if self.mapping else {}
        if name not in columns:
            label = f"`{name}` is not a column of the scenario's recording"
            self.problems.error("name", span, label, suggest_name(name, columns))
        elif not are_compatible(column_dimension(columns[name]), expected):
            label = f"column `{name}` is in `{column_dimension(columns[name]).display_name}`"
            self.problems.error(
                "dimension", span, f"{label}, {what} is in `{expected.display_name}`"
            )
        return name

    def _read_constant(self, tree: SyntaxTree, unit: Unit) -> Fraction:
        """Return a constant in SI; a wrong dimension is reported, but 0 fits each unit."""
        value, dimension = evaluate_literal(tree)
        if not are_compatible(dimension, unit.dimension) and not getattr(
            tree, "is_bare_zero", False
        ):
            expected = unit.dimension.display_name
            label = f"this is in `{dimension.display_name}`, the state is in `{expected}`"
            self.problems.error("dimension", tree.span, label)
        return value

    def _reader_periods(self, name: str) -> set[Fraction]:
        """Return the periods [s] of the sampled automata that read an input."""
        readers = (c.target[0] for c in self.system.connections.values() if name in c.reads)
        periods = (self.system.instances[reader].automaton.period for reader in readers)
        return {period for period in periods if period is not None}

    def _read_inputs(self, tree: MappingNode, at: Span) -> dict[str, Stimulus]:
        """Return the stimulus of each input: from the recording, the scenario or its default.

        Unknown inputs, inputs without a value, and inputs that the recording gives too are
        reported.
        """
        known = self.system.inputs
        stimuli = self._recorded_stimuli()
        for entry in self.read_mapping(tree.get("inputs"), "inputs"):
            if entry.key not in known:
                label = f"`{entry.key}` is not an input of `{self.system.name}`"
                self.problems.error("name", entry.span, label, suggest_name(entry.key, known))
                continue
            if entry.key in stimuli:
                label = f"input `{entry.key}` is given by the recording, too"
                self.problems.error("duplicate", entry.span, label)
            declaration = known[entry.key]
            stimuli[entry.key] = self.read_stimulus(
                entry, declaration, self._reader_periods(entry.key)
            )
        for name, declaration in known.items():
            if name not in stimuli and declaration.default is not None:
                stimuli[name] = Stimulus(
                    (StimulusPiece(Fraction(0), declaration.default),), is_bool=declaration.is_bool
                )
            elif name not in stimuli and not self.problems.has_errors:
                label = f"input `{name}` of `{self.system.name}` has no value in the scenario"
                self.problems.error("missing", at, label)
        return stimuli

    def _recorded_stimuli(self) -> dict[str, Stimulus]:
        """Return the stimuli of the inputs that columns or constants of the recording map give."""
        stimuli: dict[str, Stimulus] = {}
        known = self.system.inputs
        if self.mapping is None:
            return stimuli
        for name, (value, dimension) in self.mapping.constants.items():
            if name in known:
                if not are_compatible(dimension, known[name].unit.dimension):
                    label = f"constant `{name}` is in `{dimension.display_name}`"
                    self.problems.error("dimension", self.mapping.span, label)
                stimuli[name] = Stimulus(
                    (StimulusPiece(Fraction(0), value),), is_bool=known[name].is_bool
                )
        for column in self.mapping.columns.values():
            if column.to is not None and column.to in known:
                expected = known[column.to].unit.dimension
                self._check_column(column.name, column.span, expected, f"input `{column.to}`")
                if column.to in stimuli:
                    label = f"input `{column.to}` is fed twice"
                    self.problems.error("duplicate", column.span, label)
                none = (StimulusPiece(Fraction(0), Fraction(0)),)
                stimuli[column.to] = Stimulus(none, column.name, known[column.to].is_bool)
        return stimuli
