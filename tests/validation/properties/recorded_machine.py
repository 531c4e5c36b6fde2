"""Recorded machine: a spec with a map of columns, and recordings that its simulation writes."""

from __future__ import annotations

import dataclasses
import gzip
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from random import Random

import numpy as np
from numpy.typing import NDArray

from diagnosis.data_quality.output_comparison import simulate_free_run
from engine.recordings.recording import Channel, Recording
from language.loading.load import automaton_of
from language.loading.recording_map_reader import read_map
from language.model.automaton import Automaton
from language.model.system import ColumnMapping, RecordingMap
from language.overlays.expand_document import Project, read_document
from language.overlays.name_types import format_si_unit
from language.text.diagnostic import Source, SpecError
from language.text.document import Document
from language.text.project_files import parse_document
from tests.lockstep.random_specs.continuous_automata import random_continuous_spec
from tests.validation.evidence.evidence_store import ROOT

Reals = NDArray[np.float64]
Table = dict[str, list[str]]
"""The cells of a recording by column; all columns have the same length."""
OWN = Path(__file__).parent / "robustness_specs"
SHIPPED = (
    "blind_driveline",
    "bmw_i3",
    "brfd_damper",
    "emps",
    "leaf_motor_side",
    "leaf_vehicle",
    "driveline_load",
    "driveline_rubber",
    "driveline",
    "contactor",
    "supervisor",
    "estimator",
)
"""Specs of the product; those that name no map get one with a column for each signal."""
RANDOM_SPECS = 4
LOW, HIGH = -1.0, 2.5
"""Decimal logarithms between which the amplitude of an input without a range is drawn."""
TIME = "t_s"
RECORDING_MAP = re.compile(r"^recording_map:.*\n", re.MULTILINE)
"""The line of a spec that names its map."""


@dataclass(frozen=True)
class Machine:
    """An automaton with a map; `texts` are the files of both that the product does not ship.

    `files` are real recordings of the machine. `map_name` is None if the spec names its map.
    """

    spec: str
    automaton: Automaton
    mapping: RecordingMap
    texts: Mapping[str, str] = field(default_factory=dict, repr=False)
    files: tuple[Path, ...] = ()
    map_name: str | None = None

    @property
    def inputs(self) -> list[ColumnMapping]:
        """The columns of inputs."""
        return [column for column in self.mapping.columns.values() if column.to]

    @property
    def outputs(self) -> list[ColumnMapping]:
        """The columns of outputs."""
        return [column for column in self.mapping.columns.values() if column.compare]

    @property
    def columns(self) -> list[str]:
        """The names of the columns of a file with values, without those of time."""
        return [name for column in self.mapping.columns.values() for name in column.columns]


@cache
def machines(recordings: Path | None = None) -> tuple[Machine, ...]:
    """Return all machines: shipped, of this study, random ones, and those with real recordings."""
    project = Project(ROOT)
    found = [_machine(read_document(project.path_of(name)), name) for name in SHIPPED]
    for path in sorted(OWN.glob("*.yaml")):
        found.append(_machine_of_text(path.name, path.read_text("utf-8")))
    for k in range(RANDOM_SPECS):
        made = random_continuous_spec(Random(f"robustness {k}"), f"chance_{k}")
        found.append(_machine_of_text(f"{made.name}.yaml", made.text))
    for map_file in sorted(recordings.glob("*/map_*.yaml")) if recordings else ():
        spec = next(one for one in map_file.parent.glob("*.yaml") if one != map_file)
        files = tuple(sorted(map_file.parent.glob("*.csv.gz")))
        text = RECORDING_MAP.sub("", spec.read_text("utf-8"))
        one = _machine_of_text(spec.name, text, map_file.read_text("utf-8"))
        found.append(dataclasses.replace(one, files=files))
    return tuple(found)


def _machine_of_text(file: str, text: str, map_text: str = "") -> Machine:
    """Return the machine of a spec that the product does not ship."""
    document = parse_document(Source(file, tuple(text.splitlines())), text)
    return _machine(document, f"spec/{file}", {file: text}, map_text)


def _machine(
    document: Document, spec: str, texts: Mapping[str, str] | None = None, map_text: str = ""
) -> Machine:
    """Return the machine of a spec with its own map, else with one that has all its signals."""
    project = Project(ROOT)
    automaton = automaton_of(document, project)
    if automaton.recording_map and not map_text:
        mapping = read_map(read_document(project.path_of(automaton.recording_map.text)), project)
        return Machine(spec, automaton, mapping, texts or {})
    name = f"columns_of_{automaton.name}"
    map_text = map_text or _map_with_all_signals(name, automaton)
    map_document = parse_document(Source("map.yaml", tuple(map_text.splitlines())), map_text)
    return Machine(
        spec,
        automaton,
        read_map(map_document, project),
        {**(texts or {}), f"{map_document.name}.yaml": map_text},
        map_name=f"spec/{map_document.name}.yaml",
    )


def _map_with_all_signals(name: str, automaton: Automaton) -> str:
    """Return the text of a map that has a column in SI for each input and each real output."""
    lines = ["language: 1", f"map: {name}", f"time: {{column: {TIME}, unit: s}}", "columns:"]
    for key, one in automaton.inputs.items():
        unit = format_si_unit(one.unit.dimension)
        lines.append(f'  {key}: {{to: {key}, unit: "{unit}", blank: skip}}')
    for key in automaton.outputs:
        source = automaton.output_source(key)
        if source in automaton.dimensions:
            unit = format_si_unit(automaton.dimensions[source])
            lines.append(f'  measured_{key}: {{compare: {key}, unit: "{unit}", blank: skip}}')
    if len(lines) == 4:
        lines[-1] = "columns: {}"
    return "\n".join(lines) + "\n"


def record(machine: Machine, draw: Random, count: int, stride: int, noise: float) -> Table:
    """Return a recording of a machine, `count` samples that are `stride` major steps apart.

    Its inputs are steps between random levels. `noise` is relative to the standard deviation of a
    signal. If the machine cannot be simulated, its outputs are random numbers.
    """
    chance = np.random.default_rng(draw.getrandbits(32))
    step = machine.automaton.period or machine.automaton.step
    times = [k * stride * step for k in range(count)]
    values = {one.name: _draw_input(machine, one, draw, count) for one in machine.inputs}
    starts = {one.name: np.full(count, draw.uniform(-1.0, 1.0)) for one in machine.outputs}
    channels = {
        name: Channel(machine.mapping.columns[name], tuple(times), tuple(column.tolist()))
        for name, column in (values | starts).items()
    }
    recording = Recording("simulated", channels, times[-1])
    with suppress(SpecError, ArithmeticError):
        if starts:
            run = simulate_free_run(machine.automaton, recording, machine.mapping)
            values |= {name: one.simulated for name, one in run.comparisons.items()}
    for one in machine.outputs:
        column = values.get(one.name, np.zeros(0))
        if len(column) != count or not np.all(np.isfinite(column)):
            values[one.name] = chance.normal(size=count)
    table = {machine.mapping.time or TIME: [f"{float(time):.9g}" for time in times]}
    for name, column in values.items():
        mapped = machine.mapping.columns[name]
        declared = machine.automaton.inputs.get(mapped.to or "")
        is_real = declared is None or declared.type == "real"
        noisy = column + is_real * noise * np.std(column) * chance.normal(size=count)
        if mapped.time:
            table[mapped.time] = table[machine.mapping.time]
        scale = float(mapped.scale[0]) * mapped.sign
        raw = (noisy / scale - float(mapped.unit.offset)) / float(mapped.unit.factor)
        for file_column in mapped.columns:
            table[file_column] = [f"{value:.8g}" for value in raw]
    return table


def read_real(machine: Machine, draw: Random, count: int) -> Table:
    """Return a part of a real recording of a machine, `count` rows long."""
    with gzip.open(draw.choice(machine.files), "rt", encoding="utf-8") as file:
        head, *rows = file.read().splitlines()
    first = draw.randrange(max(1, len(rows) - count))
    cells = [row.split(",") for row in rows[first : first + count]]
    return {name: [row[k] for row in cells] for k, name in enumerate(head.split(","))}


def _draw_input(machine: Machine, column: ColumnMapping, draw: Random, count: int) -> Reals:
    """Return random steps of an input in SI (count,)."""
    declared = machine.automaton.inputs.get(column.to or "")
    levels = [draw.uniform(-1.0, 1.0) for _ in range(6)]
    amplitude = 10.0 ** draw.uniform(LOW, HIGH)
    values = [amplitude * level for level in levels]
    if declared is not None and declared.type != "real":
        values = [float(level > 0.0) for level in levels]
    elif declared is not None and declared.range is not None:
        low, high = (float(bound) for bound in declared.range)
        values = [low + 0.5 * (1.0 + level) * (high - low) for level in levels]
    places = np.minimum(len(values) * np.arange(count) // max(count, 1), len(values) - 1)
    return np.array(values)[places]
