"""Code: the C of an automaton, and what an ECU's engineers want beside it, as functions."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path

from codegen.coverage.boundary_values import generate_boundary_sequences
from codegen.coverage.coverage_exploration import corpus_records, generate_corpus
from codegen.coverage.mcdc import McdcCoverage, add_infeasibility_proofs, measure_mcdc as covered
from codegen.emit.c_module import emit_c_files
from codegen.exchange.a2l import writer as asam
from codegen.exchange.cmake import emit_cmake_file
from codegen.exchange.dbc import FIRST_IDENTIFIER, emit_dbc as dbc_of
from codegen.exchange.fmi.archive import build_fmu as fmu_of
from codegen.exchange.fmi.variable import Version
from codegen.harness.instruction_count import InstructionCounts, count_instructions as counted
from codegen.harness.metrics import Metrics, measure_code as measured
from codegen.proofs.all import CHECKS, run_checks
from codegen.toolchain.tool_verdict import ToolVerdict
from language.ir.number_type import NumberType
from language.ir.printer import digest
from language.ir.program import Program
from language.loading.load import automaton_of, program_of
from language.loading.system_reader import with_number_type
from language.lowering.range_saturation import require_ranges
from language.model.automaton import Automaton
from language.model.declaration import Input, State
from language.overlays.expand_document import Project
from lockstep.comparison import MAX_COUNTED_STEPS
from lockstep.fuzzing import RUNS, SEED, TICKS, FuzzReport, fuzz as fuzzed
from lockstep.tick_log import TickLog, record_ticks
from modewright.api.documents import Values, load_calibrated_document, parse_values
from modewright.api.simulation import load
from modewright.api.spec_tests import find_tests, load_tests

RETAINED_PREFIXES = ("latched.", "state.", "discrete.")
SEEDS = (SEED, SEED + 1)
"""Where libFuzzer starts: what one seed misses, another one may find."""


def generate(
    reference: str,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
) -> dict[str, str]:
    """Return the C files of an automaton by name. Raises SpecError."""
    return emit_c_files(_load_program(reference, values, root, calibrations))


def cmake(
    reference: str,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
) -> dict[str, str]:
    """Return the file by which CMake builds the C of an automaton, by name. Raises SpecError."""
    return emit_cmake_file(_load_program(reference, values, root, calibrations))


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
    return fmu_of(_load_program(reference, values, root, calibrations), version, is_source_only)


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
    program = _load_program(reference, values, root, calibrations)
    return asam.emit_a2l(program, asam.locate_module(program, elf, page, instance) if elf else None)


def dbc(
    reference: str,
    first: int = FIRST_IDENTIFIER,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    *,
    is_fd: bool = False,
) -> str:
    """Return a DBC of an automaton's inputs and outputs, from the identifier `first` on.

    Raises SpecError, ToolMissing; ValueError where identifiers run out.
    """
    automaton, program = _load_automaton_and_program(reference, values, root, calibrations, None)
    return dbc_of(program, _input_ranges(automaton), first, is_fd)


def prove(
    reference: str,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    checks: Sequence[str] = CHECKS,
) -> Iterator[ToolVerdict]:
    """Yield what tools of others say of the C of an automaton: some of the checks, in turn.

    Raises SpecError, ToolMissing.
    """
    automaton, program = _load_automaton_and_program(reference, values, root, calibrations, None)
    yield from run_checks(automaton, program, checks)


def fuzz(
    reference: str,
    runs: int = RUNS,
    ticks: int = TICKS,
    seed: int = SEED,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    numbers: NumberType | None = None,
) -> FuzzReport:
    """Try `runs` sequences of at most so many `ticks` on the C of an automaton and on the engine.

    Raises SpecError, ValueError for a continuous automaton, ToolMissing, BuildError.
    """
    automaton, program = _load_automaton_and_program(reference, values, root, calibrations, numbers)
    if not automaton.is_sampled:
        raise ValueError(f"{automaton.name} is continuous: sequences are those of sampled automata")
    return fuzzed(program, _input_ranges(automaton), runs, ticks, seed)


def mcdc(
    reference: str,
    runs: int = 0,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    numbers: NumberType | None = None,
    *,
    is_proven: bool = True,
) -> McdcCoverage:
    """Tell which conditions of the C of an automaton are shown to matter by the tests of the
    project, by what libFuzzer finds in `runs`, and at the borders of both; and, if that
    `is_proven`, which cannot be.

    Raises SpecError; ValueError where there is nothing to run it on; ToolMissing, BuildError.
    """
    automaton, program = _load_automaton_and_program(reference, values, root, calibrations, numbers)
    sequences = [tape.inputs for tape in _record_project_tests(program, root, numbers)]
    ranges = _input_ranges(automaton)
    if runs and not automaton.is_sampled:
        raise ValueError(f"{automaton.name} is continuous: sequences are those of sampled automata")
    corpus = generate_corpus(program, ranges, runs, SEEDS) if runs else ()
    if not sequences and not corpus:
        hint = ": give it `--runs`" if automaton.is_sampled else ""
        raise ValueError(f"no test of the project runs {automaton.name} as it is{hint}")
    if automaton.is_sampled:
        known_sequences = (*sequences, *sorted(corpus_records(program, ranges, corpus), key=len))
        sequences.extend(generate_boundary_sequences(program, known_sequences, ranges))
    found = covered(program, sequences, corpus, ranges)
    if not (is_proven and automaton.is_sampled):
        return found
    return add_infeasibility_proofs(found, program, _retained_ranges(automaton, program))


def _retained_ranges(automaton: Automaton, program: Program) -> dict[str, tuple[float, float]]:
    """Return the ranges [SI] in which a sampled automaton holds its reals, by variable."""
    variables: dict[str, Input | State] = {**automaton.inputs, **automaton.state_variables}
    reals = {v.name for v in program.variables if v.type == "real"}
    ranges = {}
    for name, variable in variables.items():
        for group in RETAINED_PREFIXES:
            if variable.range and group + name in reals:
                ranges[group + name] = (float(variable.range[0]), float(variable.range[1]))
    return ranges


def _record_project_tests(
    program: Program, root: Path | None, numbers: NumberType | None
) -> Iterator[TickLog]:
    """Yield what each test of a project does with a Program."""
    for test in load_tests(find_tests(root), root):
        run = with_number_type(test.system, numbers) if numbers else test.system
        if any(one.automaton.name == program.name for one in run.instances.values()):
            tapes = record_ticks(run, test.scenario)[1].values()
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
    return measured(_load_program(reference, values, root, calibrations, numbers))


def instructions(
    reference: str,
    system: str,
    scenario: str,
    values: Values | None = None,
    root: Path | None = None,
    calibrations: Sequence[str] = (),
    numbers: NumberType | None = None,
) -> InstructionCounts:
    """Return the instructions of the steps of an automaton's C in a scenario of a system.

    Raises SpecError, ValueError where no instance of the system is that automaton, ToolMissing.
    """
    program = _load_program(reference, values, root, calibrations, numbers)
    loaded = load(system, scenario, None, root, calibrations)
    run = with_number_type(loaded.system, numbers) if numbers else loaded.system
    name = next((n for n, i in run.instances.items() if i.automaton.name == program.name), None)
    if name is None:
        raise ValueError(f"{system} has no instance of {program.name}")
    tape = record_ticks(run, loaded.scenario)[1][name]
    return counted(program, b"".join(tape.inputs[:MAX_COUNTED_STEPS]))


def _input_ranges(automaton: Automaton) -> dict[str, tuple[float, float]]:
    """Return the ranges [SI] of inputs by name."""
    ends = {name: one.range for name, one in automaton.inputs.items() if one.range}
    return {name: (float(low), float(high)) for name, (low, high) in ends.items()}


def _load_program(
    reference: str,
    values: Values | None,
    root: Path | None,
    calibrations: Sequence[str],
    numbers: NumberType | None = None,
) -> Program:
    """Return the Program that C is made of."""
    return _load_automaton_and_program(reference, values, root, calibrations, numbers)[1]


def _load_automaton_and_program(
    reference: str,
    values: Values | None,
    root: Path | None,
    calibrations: Sequence[str],
    numbers: NumberType | None,
) -> tuple[Automaton, Program]:
    """Return an automaton and the Program that C is made of."""
    project = Project(root or Path())
    document = load_calibrated_document(reference, project, calibrations)
    automaton = automaton_of(document, project, parse_values(values))
    if numbers:
        automaton = dataclasses.replace(automaton, numbers=numbers)
    if automaton.is_sampled:
        require_ranges(automaton)
    return automaton, program_of(automaton)
