"""Code generation: functions for C code, exchange formats, proofs, coverage and metrics."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import get_args

from codegen.coverage.boundary_values import generate_boundary_sequences
from codegen.coverage.coverage_exploration import corpus_records, generate_corpus
from codegen.coverage.mcdc import McdcCoverage, add_infeasibility_proofs, measure_mcdc
from codegen.emit.c_module import emit_c_files
from codegen.exchange.a2l import writer as asam
from codegen.exchange.cmake import emit_cmake_file
from codegen.exchange.dbc import FIRST_IDENTIFIER, emit_dbc
from codegen.exchange.fmi.archive import build_fmu
from codegen.exchange.fmi.variable import Version
from codegen.harness.instruction_count import InstructionCounts, count_instructions
from codegen.harness.metrics import Metrics, measure_code
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
from language.text.arguments import (
    PathText,
    PathTexts,
    optional,
    to_choice,
    to_count,
    to_path,
    to_project,
    to_some_texts,
    to_text,
)
from lockstep.comparison import MAX_COUNTED_STEPS
from lockstep.fuzzing import RUNS, SEED, TICKS, FuzzReport, fuzz as fuzzed
from lockstep.tick_log import TickLog, record_ticks
from modewright.api.documents import (
    Values,
    load_calibrated_document,
    number_type_of,
    parse_values,
)
from modewright.api.simulation import load
from modewright.api.spec_tests import find_tests, load_tests

RETAINED_PREFIXES = ("latched.", "state.", "discrete.")
"""Prefixes of the variables that a sampled automaton retains between ticks."""
SEEDS = (SEED, SEED + 1)
"""Seeds of libFuzzer; two of them find more than one."""


def generate(
    reference: PathText,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
) -> dict[str, str]:
    """Return the texts of the C files of an automaton by file name.

    These are header, source and memory map, and the files of ha_math if the C calls it. Raises
    SpecError, and ValueError for an automaton without C (an input varies inside a step).
    """
    return emit_c_files(_load_program(reference, values, root, calibrations))


def cmake(
    reference: PathText,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
) -> dict[str, str]:
    """Return the CMake file for the C of an automaton, as a dict of one text by file name.

    It builds the C as a static library. Raises SpecError, and ValueError for an automaton without
    C.
    """
    return emit_cmake_file(_load_program(reference, values, root, calibrations))


def fmu(
    reference: PathText,
    version: Version = 3,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
    *,
    is_source_only: bool = False,
) -> bytes:
    """Return an automaton as a co-simulation FMU of version 2 or 3 with a binary for this machine.

    With `is_source_only` the FMU has no binary. Raises SpecError, ValueError for another version or
    an automaton without C, and MissingToolError and BuildError if the binary cannot be built.
    """
    known = to_choice(version, get_args(Version), "version")
    return build_fmu(_load_program(reference, values, root, calibrations), known, is_source_only)


def a2l(
    reference: PathText,
    elf: PathText | None = None,
    page: str | None = None,
    instance: str | None = None,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
) -> str:
    """Return the text of the A2L file of an automaton's C.

    With a linked program `elf` it contains the addresses; `page` and `instance` are the C names of
    the calibration structure and of the instance, required if the program has several candidates.
    They are ignored without `elf`. Raises SpecError, ImageError and MissingToolError.
    """
    path, page = optional(to_path, elf, "elf"), optional(to_text, page, "page")
    instance = optional(to_text, instance, "instance")
    program = _load_program(reference, values, root, calibrations)
    module = asam.locate_module(program, path, page, instance) if path else None
    return asam.emit_a2l(program, module)


def dbc(
    reference: PathText,
    first: int = FIRST_IDENTIFIER,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
    *,
    is_fd: bool = False,
) -> str:
    """Return a DBC file with messages of the inputs and outputs of an automaton.

    The messages `X_In` and `X_Out` are split where they exceed a frame; their identifiers count up
    from `first`. `is_fd` gives CAN FD frames. Declared ranges of inputs are the limits of their
    signals. Raises SpecError, MissingToolError, and ValueError for an identifier that is negative
    or has more than 29 bits.
    """
    first_identifier = to_count(first, "first")
    automaton, program = _load_automaton_and_program(reference, values, root, calibrations, None)
    return emit_dbc(program, _input_ranges(automaton), first_identifier, is_fd)


def prove(
    reference: PathText,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
    checks: PathTexts = CHECKS,
) -> Iterator[ToolVerdict]:
    """Yield the verdicts of external tools about the C of an automaton, one check after another.

    `checks` are names of CHECKS, by default all. A failed proof is a verdict and not an exception.
    Raises SpecError, BuildError, ValueError for an unknown check and for no check, and
    MissingToolError for a tool that is not installed.
    """
    names = [to_choice(name, CHECKS, "checks") for name in to_some_texts(checks, "checks")]
    automaton, program = _load_automaton_and_program(reference, values, root, calibrations, None)
    yield from run_checks(automaton, program, names)


def fuzz(
    reference: PathText,
    runs: int = RUNS,
    ticks: int = TICKS,
    seed: int = SEED,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
    numbers: NumberType | None = None,
) -> FuzzReport:
    """Compare engine and C of a sampled automaton on sequences that libFuzzer generates.

    It executes `runs` sequences of at most `ticks` ticks each, the same ones for the same `seed`.
    `numbers` replaces the number type of the automaton. Raises SpecError, ValueError for a
    continuous automaton, MissingToolError and BuildError; a difference is in the report and is not
    raised.
    """
    runs, ticks = to_count(runs, "runs", 1), to_count(ticks, "ticks", 1)
    seed, numbers = to_count(seed, "seed", 1), number_type_of(numbers)
    automaton, program = _load_automaton_and_program(reference, values, root, calibrations, numbers)
    if not automaton.is_sampled:
        raise ValueError(f"{automaton.name} is continuous: sequences are those of sampled automata")
    return fuzzed(program, _input_ranges(automaton), runs, ticks, seed)


def mcdc(
    reference: PathText,
    runs: int = 0,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
    numbers: NumberType | None = None,
    *,
    is_proven: bool = True,
) -> McdcCoverage:
    """Return the MC/DC coverage of the C of an automaton.

    The sequences are those of the tests (`find_tests`) that run this automaton as it is,
    those that libFuzzer finds in `runs` (0: none) with each of SEEDS, and, for a sampled automaton,
    boundary values of both. With `is_proven` it is proven for a sampled automaton which uncovered
    conditions are infeasible. `numbers` replaces the number type. Raises SpecError,
    MissingToolError, BuildError, and ValueError without any sequence and for `runs` of a continuous
    automaton.
    """
    runs, numbers = to_count(runs, "runs"), number_type_of(numbers)
    automaton, program = _load_automaton_and_program(reference, values, root, calibrations, numbers)
    files = find_tests(root, [Path(automaton.span.source.name)])
    sequences = [tape.inputs for tape in _record_tests(program, files, root, numbers)]
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
    coverage = measure_mcdc(program, sequences, corpus, ranges)
    if not (is_proven and automaton.is_sampled):
        return coverage
    return add_infeasibility_proofs(coverage, program, _retained_ranges(automaton, program))


def _retained_ranges(automaton: Automaton, program: Program) -> dict[str, tuple[float, float]]:
    """Return the declared ranges [SI] of retained real variables of a sampled automaton."""
    variables: dict[str, Input | State] = {**automaton.inputs, **automaton.state_variables}
    reals = {v.name for v in program.variables if v.type == "real"}
    ranges = {}
    for name, variable in variables.items():
        for group in RETAINED_PREFIXES:
            if variable.range and group + name in reals:
                ranges[group + name] = (float(variable.range[0]), float(variable.range[1]))
    return ranges


def _record_tests(
    program: Program, files: Sequence[str], root: PathText | None, numbers: NumberType | None
) -> Iterator[TickLog]:
    """Yield the tick logs of a Program in the tests of some files."""
    for test in load_tests(files, root):
        run = with_number_type(test.system, numbers) if numbers else test.system
        if any(one.automaton.name == program.name for one in run.instances.values()):
            tapes = record_ticks(run, test.scenario)[1].values()
            yield from (tape for tape in tapes if digest(tape.program) == digest(program))


def metrics(
    reference: PathText,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
    numbers: NumberType | None = None,
) -> Metrics:
    """Return ROM, RAM and stack of the C of an automaton on a Cortex-M4F.

    `numbers` replaces the number type of the automaton. Raises SpecError and MissingToolError.
    """
    return measure_code(_load_program(reference, values, root, calibrations, numbers))


def instructions(
    reference: PathText,
    system: PathText,
    scenario: PathText,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
    numbers: NumberType | None = None,
) -> InstructionCounts:
    """Return the instruction counts of the steps of an automaton's C in a scenario of a system.

    The inputs are those of the first instance of the automaton in the system, for at most
    MAX_COUNTED_STEPS steps. `calibrations` apply to automaton and system, `values` to the automaton
    only. Raises SpecError, MissingToolError, and ValueError if the system has no such instance.
    """
    numbers = number_type_of(numbers)
    program = _load_program(reference, values, root, calibrations, numbers)
    loaded = load(system, scenario, None, root, calibrations)
    run = with_number_type(loaded.system, numbers) if numbers else loaded.system
    name = next((n for n, i in run.instances.items() if i.automaton.name == program.name), None)
    if name is None:
        raise ValueError(f"{system} has no instance of {program.name}")
    tape = record_ticks(run, loaded.scenario)[1][name]
    return count_instructions(program, b"".join(tape.inputs[:MAX_COUNTED_STEPS]))


def _input_ranges(automaton: Automaton) -> dict[str, tuple[float, float]]:
    """Return the declared ranges [SI] of inputs by name."""
    ends = {name: one.range for name, one in automaton.inputs.items() if one.range}
    return {name: (float(low), float(high)) for name, (low, high) in ends.items()}


def _load_program(
    reference: PathText,
    values: Values | None,
    root: PathText | None,
    calibrations: PathTexts,
    numbers: NumberType | None = None,
) -> Program:
    """Return the Program of an automaton."""
    return _load_automaton_and_program(reference, values, root, calibrations, numbers)[1]


def _load_automaton_and_program(
    reference: PathText,
    values: Values | None,
    root: PathText | None,
    calibrations: PathTexts,
    numbers: NumberType | None,
) -> tuple[Automaton, Program]:
    """Return an automaton and its Program, with calibrations, values and number type applied.

    Raises SpecError, also for a sampled automaton with missing ranges, and ValueError for another
    number type.
    """
    project, scalars, number_type = to_project(root), parse_values(values), number_type_of(numbers)
    name = to_text(reference, "reference")
    document = load_calibrated_document(name, project, calibrations)
    automaton = automaton_of(document, project, scalars)
    if number_type:
        automaton = dataclasses.replace(automaton, numbers=number_type)
    if automaton.is_sampled:
        require_ranges(automaton)
    return automaton, program_of(automaton)
