"""API: what the command line does, as functions. Specs are named or given by path."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from codegen.build import optimised
from codegen.cmake import cmake_file
from codegen.fmi.archive import fmu as fmu_of
from codegen.fmi.variable import Version
from codegen.machine import HOST, MACHINES
from codegen.proofs.all import CHECKS, proofs
from codegen.proofs.proof import Proof
from codegen.source import c_files
from engine.recording import Recording, read_recording
from engine.replay import Replay, replay as replay_recording, used_columns
from engine.simulate import simulate as simulate_system
from engine.trajectory import Trajectory
from language.document import Document, Scalar, require_kind
from language.experiment import RecordingMap, Scenario, System
from language.limit import require_ranges
from language.load import automaton_of, command_line_value, program_of
from language.map import read_map
from language.model import Automaton
from language.number import NumberType
from language.page import pages_of
from language.problem import Problems, SpecError
from language.program import Program
from language.project import Project, layered, read_document, with_calibrations
from language.scenario import read_scenario
from language.system import in_numbers, read_system
from lockstep.compare import Tape, Verdict, compare
from lockstep.coverage import noted
from modewright.checking import check as check
from modewright.compiled import run as run_compiled

Values = Mapping[str, str]
"""Parameter values as text with units, by `parameter` or `instance.parameter`."""


METHODS = ("RK4", "DOP853", "Radau", "LSODA")
"""How continuous automata can be integrated: our own method, or one of scipy's."""


@dataclass(frozen=True)
class Loaded:
    """A system with a scenario, checked."""

    system: System
    scenario: Scenario


@dataclass(frozen=True)
class Replayed:
    """A replay with its lock-step verdict (None if C was not asked for)."""

    result: Replay
    verdict: Verdict | None
    left_out: tuple[str, ...]
    recording: Recording = field(repr=False)


def load(
    system: str,
    scenario: str,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
) -> Loaded:
    """Return a system with a scenario. Raises SpecError with all problems."""
    project = Project(root or Path())
    read = read_system(_document(system, project, calibrations), project, _scalars(values))
    document = read_document(project.path_of(scenario))
    return Loaded(read, read_scenario(document, project, read))


def simulate(
    system: str,
    scenario: str,
    values: Values | None = None,
    root: Path | None = None,
    *,
    reference: bool = False,
    method: str = "RK4",
    calibrations: Sequence[str] = (),
    compiled: bool | None = None,
) -> Trajectory:
    """Return the trajectory of a system, or of an automaton alone, through a scenario.

    `method` integrates continuous automata: RK4 of the Program, or DOP853, Radau or LSODA of
    scipy; `reference` takes scipy (DOP853) and the numbers of filterpy. `compiled` takes C, which
    has the same bits; None does so for long runs; the log tells what did the work. Raises
    ValueError.
    """
    if method not in METHODS:
        raise ValueError(f"`{method}` is no method of integration: {', '.join(METHODS)}")
    loaded = load(system, scenario, values, root, calibrations)
    if reference or method != "RK4":
        from engine import reference as independent  # scipy only where asked for

        run = independent.reference if reference else independent.by_method
        scipys: Any = "DOP853" if method == "RK4" else method
        return run(loaded.system, loaded.scenario, scipys)
    trajectory, means = run_compiled(loaded.system, loaded.scenario, compiled)
    told = logging.WARNING if compiled and means.startswith("interpreter") else logging.INFO
    logging.getLogger("modewright").log(told, "%s by the %s", scenario, means)
    return trajectory


def program(reference: str, values: Values | None = None, root: Path | None = None) -> Program:
    """Return the Program of an automaton. Raises SpecError."""
    project = Project(root or Path())
    document = read_document(project.path_of(reference))
    return program_of(automaton_of(document, project, _scalars(values)))


def generate(
    reference: str,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
) -> dict[str, str]:
    """Return the C files of an automaton by name. Raises SpecError."""
    return c_files(_generated(reference, values, root, calibrations))


def cmake(
    reference: str,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
) -> dict[str, str]:
    """Return the file by which CMake builds the C of an automaton, by name. Raises SpecError."""
    return cmake_file(_generated(reference, values, root, calibrations))


def fmu(
    reference: str,
    version: Version = 3,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    *,
    is_source_only: bool = False,
) -> bytes:
    """Return an automaton as a co-simulation FMU, version 2 or 3, with a binary of this machine.

    `is_source_only` leaves the binary out. Raises SpecError; ValueError for another version and
    for an automaton that has no C; ToolMissing, BuildError where there is a binary to make.
    """
    return fmu_of(_generated(reference, values, root, calibrations), version, is_source_only)


def prove(
    reference: str,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    checks: Sequence[str] = CHECKS,
) -> Iterator[Proof]:
    """Yield what tools of others say of the C of an automaton: some of the checks, in turn.

    Raises SpecError, ToolMissing.
    """
    yield from proofs(_generated(reference, values, root, calibrations), checks)


def _generated(
    reference: str, values: Values | None, root: Path | None, calibrations: Sequence[str]
) -> Program:
    """Return the Program that C is made of."""
    project = Project(root or Path())
    document = _document(reference, project, calibrations)
    automaton = automaton_of(document, project, _scalars(values))
    if automaton.is_sampled:
        require_ranges(automaton)
    return program_of(automaton)


def lockstep(
    system: str,
    scenario: str,
    values: Values | None = None,
    root: Path | None = None,
    *,
    numbers: NumberType | None = None,
    changes: Sequence[str] = (),
    compiler: str | None = None,
    optimise: str = "O2",
    calibrations: Sequence[str] = (),
    target: str = HOST.name,
) -> tuple[Trajectory, list[Verdict]]:
    """Simulate, then run the C of every instance on the same inputs and compare bits.

    `target` is where the C runs: `host`, or `cortex-m4f` in an emulator.
    `numbers` replaces the number type of every instance; `changes` are pages of the calibration
    like `1.5 s: k_hs = 6000 N*m/rad`, in place of those of the scenario.
    Raises SpecError, ToolMissing.
    """
    loaded = load(system, scenario, values, root, calibrations)
    if numbers:
        loaded = Loaded(in_numbers(loaded.system, numbers), loaded.scenario)
    if changes:
        pages = pages_of(changes, loaded.system)
        loaded = Loaded(loaded.system, dataclasses.replace(loaded.scenario, pages=pages))
    for instance in loaded.system.instances.values():
        if instance.automaton.is_sampled:
            require_ranges(instance.automaton)
    tapes: dict[str, Tape] = {}

    def ticked(name: str, used: Program, stepper: object) -> None:
        if name not in tapes:
            start = float(loaded.system.instances[name].offset)
            tapes[name] = Tape(used, name=name, start=start)
        tapes[name].record(stepper)  # type: ignore[arg-type]

    trajectory = simulate_system(loaded.system, loaded.scenario, ticked=ticked)
    flags = optimised(optimise)
    machine = MACHINES[target]
    verdicts = [compare(tape, flags, compiler, machine) for tape in tapes.values()]
    return trajectory, noted(verdicts, loaded.system, loaded.scenario, trajectory)


def replay(
    estimator: str,
    recording: Path,
    map: str,
    variant: str | None = None,
    values: Values | None = None,
    root: Path | None = None,
    *,
    compiled: bool = True,
    calibrations: Sequence[str] = (),
) -> Replayed:
    """Replay a recording through a sampled automaton, in lock-step with its C.

    Raises SpecError, ToolMissing.
    """
    automaton, used = _estimator(estimator, variant, values, root, calibrations)
    mapping = _map(map, root)
    columns, left_out = used_columns(automaton, mapping)
    read = read_recording(recording, mapping, columns)
    tape = Tape(used, name=automaton.name)
    result = replay_recording(automaton, used, read, mapping, ticked=tape.record)
    tape.start = float(result.trajectory.times[0])
    verdict = compare(tape) if compiled else None
    return Replayed(result, verdict, tuple(left_out), read)


def _document(reference: str, project: Project, calibrations: Sequence[str]) -> Document:
    document = read_document(project.path_of(reference))
    return with_calibrations(document, calibrations, "--calibration")


def _estimator(
    reference: str,
    variant: str | None,
    values: Values | None,
    root: Path | None,
    calibrations: Sequence[str],
) -> tuple[Automaton, Program]:
    project = Project(root or Path())
    document = read_document(project.path_of(reference))
    if variant:
        over = read_document(project.path_of(variant))
        problems = Problems()
        require_kind(over, "variant", problems)
        document = layered(document, over, project, problems)
    document = with_calibrations(document, calibrations, "--calibration")
    automaton = automaton_of(document, project, _scalars(values))
    if not automaton.is_sampled:
        problems = Problems()
        label = f"`{automaton.name}` is continuous: only a sampled automaton reads a recording"
        problems.error("form", automaton.span, label, "give it a `period`")
        raise SpecError(problems.found)
    return automaton, program_of(automaton)


def _map(reference: str, root: Path | None) -> RecordingMap:
    project = Project(root or Path())
    return read_map(read_document(project.path_of(reference)), project)


def _scalars(values: Values | None) -> dict[str, Scalar]:
    return {name: command_line_value(text, name=name) for name, text in (values or {}).items()}
