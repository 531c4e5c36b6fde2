"""Code: the C of an automaton, and what an ECU's engineers want beside it, as functions."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path

from codegen.asam import a2l as asam
from codegen.border import at_borders
from codegen.can_database import FIRST, dbc as dbc_of
from codegen.cmake import cmake_file
from codegen.exploring import explored, records
from codegen.fmi.archive import fmu as fmu_of
from codegen.fmi.variable import Version
from codegen.instructions import Instructions, instructions as counted
from codegen.mcdc import Covered, mcdc as covered, with_proofs
from codegen.metrics import Metrics, metrics as measured
from codegen.proofs.all import CHECKS, proofs
from codegen.proofs.proof import Proof
from codegen.source import c_files
from language.declaration import Input, State
from language.limit import require_ranges
from language.load import automaton_of, program_of
from language.model import Automaton
from language.number import NumberType
from language.printing import digest
from language.program import Program
from language.project import Project
from language.system import in_numbers
from lockstep.compare import MOST_COUNTED, Tape
from lockstep.fuzzing import RUNS, SEED, TICKS, Fuzzed, fuzz as fuzzed
from lockstep.taping import taped
from modewright.api import load
from modewright.documents import Values, calibrated_document, scalars
from modewright.tests import load_tests, tests_of

HELD = ("latched.", "state.", "discrete.")
SEEDS = (SEED, SEED + 1)
"""Where libFuzzer starts: what one seed misses, another one may find."""


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


def a2l(
    reference: str,
    elf: Path | None = None,
    page: str | None = None,
    instance: str | None = None,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
) -> str:
    """Return the A2L of the C of an automaton, with addresses of a linked program.

    `page` and `instance` name structures where that has several. Raises SpecError, ImageError,
    ToolMissing.
    """
    program = _generated(reference, values, root, calibrations)
    return asam.a2l(program, asam.located(program, elf, page, instance) if elf else None)


def dbc(
    reference: str,
    first: int = FIRST,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    *,
    is_fd: bool = False,
) -> str:
    """Return a DBC of an automaton's inputs and outputs, from the identifier `first` on.

    Raises SpecError, ToolMissing; ValueError where identifiers run out.
    """
    automaton, program = _made(reference, values, root, calibrations, None)
    return dbc_of(program, _ranges(automaton), first, is_fd)


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
    automaton, program = _made(reference, values, root, calibrations, None)
    yield from proofs(automaton, program, checks)


def fuzz(
    reference: str,
    runs: int = RUNS,
    ticks: int = TICKS,
    seed: int = SEED,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    numbers: NumberType | None = None,
) -> Fuzzed:
    """Try `runs` sequences of at most so many `ticks` on the C of an automaton and on the engine.

    Raises SpecError, ValueError for a continuous automaton, ToolMissing, BuildError.
    """
    automaton, program = _made(reference, values, root, calibrations, numbers)
    if not automaton.is_sampled:
        raise ValueError(f"{automaton.name} is continuous: sequences are those of sampled automata")
    return fuzzed(program, _ranges(automaton), runs, ticks, seed)


def mcdc(
    reference: str,
    runs: int = 0,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    numbers: NumberType | None = None,
    *,
    is_proven: bool = True,
) -> Covered:
    """Tell which conditions of the C of an automaton are shown to matter by the tests of the
    project, by what libFuzzer finds in `runs`, and at the borders of both; and, if that
    `is_proven`, which cannot be.

    Raises SpecError; ValueError where there is nothing to run it on; ToolMissing, BuildError.
    """
    automaton, program = _made(reference, values, root, calibrations, numbers)
    sequences = [tape.inputs for tape in _tested(program, root, numbers)]
    ranges = _ranges(automaton)
    if runs and not automaton.is_sampled:
        raise ValueError(f"{automaton.name} is continuous: sequences are those of sampled automata")
    ways = explored(program, ranges, runs, SEEDS) if runs else ()
    if not sequences and not ways:
        hint = ": give it `--runs`" if automaton.is_sampled else ""
        raise ValueError(f"no test of the project runs {automaton.name} as it is{hint}")
    if automaton.is_sampled:
        gone = (*sequences, *sorted(records(program, ranges, ways), key=len))
        sequences.extend(at_borders(program, gone, ranges))
    found = covered(program, sequences, ways, ranges)
    if not (is_proven and automaton.is_sampled):
        return found
    return with_proofs(found, program, _held(automaton, program))


def _held(automaton: Automaton, program: Program) -> dict[str, tuple[float, float]]:
    """Return the ranges [SI] in which a sampled automaton holds its reals, by variable."""
    things: dict[str, Input | State] = {**automaton.inputs, **automaton.carried}
    reals = {v.name for v in program.variables if v.type == "real"}
    found = {}
    for name, one in things.items():
        for group in HELD:
            if one.range and group + name in reals:
                found[group + name] = (float(one.range[0]), float(one.range[1]))
    return found


def _tested(program: Program, root: Path | None, numbers: NumberType | None) -> Iterator[Tape]:
    """Yield what each test of a project does with a Program."""
    for test in load_tests(tests_of(root), root):
        run = in_numbers(test.system, numbers) if numbers else test.system
        if any(one.automaton.name == program.name for one in run.instances.values()):
            tapes = taped(run, test.scenario)[1].values()
            yield from (tape for tape in tapes if digest(tape.program) == digest(program))


def metrics(
    reference: str,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    numbers: NumberType | None = None,
) -> Metrics:
    """Return what the C of an automaton takes of a Cortex-M4F: ROM, RAM, stack.

    `numbers` replaces its number type. Raises SpecError, ToolMissing.
    """
    return measured(_generated(reference, values, root, calibrations, numbers))


def instructions(
    reference: str,
    system: str,
    scenario: str,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    numbers: NumberType | None = None,
) -> Instructions:
    """Return the instructions of the steps of an automaton's C in a scenario of a system.

    Raises SpecError, ValueError where no instance of the system is that automaton, ToolMissing.
    """
    program = _generated(reference, values, root, calibrations, numbers)
    loaded = load(system, scenario, None, root, calibrations)
    run = in_numbers(loaded.system, numbers) if numbers else loaded.system
    name = next((n for n, i in run.instances.items() if i.automaton.name == program.name), None)
    if name is None:
        raise ValueError(f"{system} has no instance of {program.name}")
    tape = taped(run, loaded.scenario)[1][name]
    return counted(program, b"".join(tape.inputs[:MOST_COUNTED]))


def _ranges(automaton: Automaton) -> dict[str, tuple[float, float]]:
    """Return the ranges [SI] of inputs by name."""
    ends = {name: one.range for name, one in automaton.inputs.items() if one.range}
    return {name: (float(low), float(high)) for name, (low, high) in ends.items()}


def _generated(
    reference: str,
    values: Values | None,
    root: Path | None,
    calibrations: Sequence[str],
    numbers: NumberType | None = None,
) -> Program:
    """Return the Program that C is made of."""
    return _made(reference, values, root, calibrations, numbers)[1]


def _made(
    reference: str,
    values: Values | None,
    root: Path | None,
    calibrations: Sequence[str],
    numbers: NumberType | None,
) -> tuple[Automaton, Program]:
    """Return an automaton and the Program that C is made of."""
    project = Project(root or Path())
    document = calibrated_document(reference, project, calibrations)
    automaton = automaton_of(document, project, scalars(values))
    if numbers:
        automaton = dataclasses.replace(automaton, numbers=numbers)
    if automaton.is_sampled:
        require_ranges(automaton)
    return automaton, program_of(automaton)
