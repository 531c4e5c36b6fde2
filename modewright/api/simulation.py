"""Simulation: load, simulate and replay systems; compare engine and C in lock-step.

Specs are given by name or path.
"""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from codegen.toolchain.compiler import OPTIMISATION_LEVELS, flags_at_level
from codegen.toolchain.target_machine import CORTEX_M4F, HOST, MACHINES
from engine.recordings.recording import Recording, read_recording
from engine.results.trajectory import Trajectory
from engine.simulation.replay import Replay, replay as replay_recording, used_columns
from language.ir.number_type import NumberType
from language.ir.program import Program
from language.loading.calibration_page_reader import parse_pages
from language.loading.load import automaton_of, program_of
from language.loading.recording_map_columns import type_columns
from language.loading.recording_map_reader import read_map
from language.loading.scenario_reader import read_scenario
from language.loading.system_reader import read_system, with_number_type
from language.lowering.range_saturation import require_ranges
from language.model.automaton import Automaton
from language.model.system import Scenario, System
from language.overlays.expand_document import (
    Project,
    add_calibrations,
    apply_variant,
    expand_document,
    lineage,
    read_document,
)
from language.text.arguments import (
    PathText,
    PathTexts,
    optional,
    to_choice,
    to_path,
    to_project,
    to_text,
    to_texts,
)
from language.text.diagnostic import Problem, Problems, SpecError, sort_problems
from language.text.document import Document, ScalarNode, require_kind
from lockstep.comparison import Verdict, add_instruction_counts, compare
from lockstep.comparison_scope import add_notes
from lockstep.tick_log import TickLog, record_ticks
from modewright.api.documents import (
    Values,
    load_calibrated_document,
    number_type_of,
    parse_values,
)
from modewright.runtime.back_end_choice import run_simulation as run_compiled

METHODS = ("RK4", "DOP853", "Radau", "LSODA")
"""Integration methods of continuous automata: RK4 of the Program, or methods of scipy."""


@dataclass(frozen=True)
class Loaded:
    """A checked system with a checked scenario."""

    system: System
    scenario: Scenario


@dataclass(frozen=True)
class Replayed:
    """A replay with its lock-step verdict, None without C.

    `left_out` are unused columns of the map.
    """

    result: Replay
    verdict: Verdict | None
    left_out: tuple[str, ...]
    recording: Recording = field(repr=False)


def load(
    system: PathText,
    scenario: PathText,
    values: Values | None = None,
    root: PathText | None = None,
    calibrations: PathTexts = (),
) -> Loaded:
    """Return a checked system with a checked scenario, both by name or path.

    `calibrations` and then `values` (`instance.parameter` or `parameter`) replace parameter values
    of the system. Raises SpecError; if the scenario does not fit the system and is one of another
    system, the only problem says so.
    """
    project, scalars = to_project(root), parse_values(values)
    scenario_name = to_text(scenario, "scenario")
    system_document = load_calibrated_document(to_text(system, "system"), project, calibrations)
    parsed_system = read_system(system_document, project, scalars)
    document = read_document(project.path_of(scenario_name))
    try:
        return Loaded(parsed_system, read_scenario(document, project, parsed_system))
    except SpecError as error:
        _require_own_scenario(document, system_document, project, error)
        raise


def _require_own_scenario(
    scenario: Document, system: Document, project: Project, error: SpecError
) -> None:
    """Raise SpecError if a scenario is valid for the system that it names, but not for `system`.

    `error` has the problems of the scenario with `system`; the first one is the help. Nothing is
    raised if the scenario names `system` or a document that this extends, or is not valid at all.
    """
    try:
        of = expand_document(scenario, project).root.get("of")
        if not isinstance(of, ScalarNode):
            return
        own_document = project.read(project.path_of(of.text, of.span))
        if own_document.name in lineage(system, project):
            return
        read_scenario(scenario, project, read_system(own_document, project))
    except SpecError:
        return
    label = f"`{scenario.name}` is a scenario of `{own_document.name}`, not of `{system.name}`"
    first = sort_problems(error.problems)[0].label
    raise SpecError([Problem("form", of.span, label, f"with `{system.name}`: {first}")]) from None


def simulate(
    system: PathText,
    scenario: PathText,
    values: Values | None = None,
    root: PathText | None = None,
    *,
    reference: bool = False,
    method: str = "RK4",
    calibrations: PathTexts = (),
    compiled: bool | None = None,
) -> Trajectory:
    """Return the trajectory of a system or automaton in a scenario.

    `method` integrates continuous automata: RK4 of the Program, or DOP853, Radau or LSODA of scipy.
    `reference` simulates independently of the engine, with scipy (DOP853 unless another method of
    scipy is named) and the gains of filterpy. `compiled` uses C, which has the same bits; True
    falls back to the interpreter with a warning in the log, None uses C from COMPILE_THRESHOLD
    steps on, False never. It is ignored for methods of scipy. Raises ValueError for an unknown
    method, and SpecError.
    """
    if method not in METHODS:
        raise ValueError(f"`{method}` is no method of integration: {', '.join(METHODS)}")
    loaded = load(system, scenario, values, root, calibrations)
    if reference or method != "RK4":
        from engine.reference import scipy_reference as independent  # deferred: imports scipy

        run = independent.simulate_reference if reference else independent.simulate_with_scipy
        scipy_method: Any = "DOP853" if method == "RK4" else method
        return run(loaded.system, loaded.scenario, scipy_method)
    trajectory, backend = run_compiled(loaded.system, loaded.scenario, compiled)
    level = logging.WARNING if compiled and backend.startswith("interpreter") else logging.INFO
    logging.getLogger("modewright").log(level, "%s by the %s", scenario, backend)
    return trajectory


def program(
    reference: PathText, values: Values | None = None, root: PathText | None = None
) -> Program:
    """Return the Program of an automaton with `values` applied. Raises SpecError."""
    project, scalars = to_project(root), parse_values(values)
    document = read_document(project.path_of(to_text(reference, "reference")))
    return program_of(automaton_of(document, project, scalars))


def lockstep(
    system: PathText,
    scenario: PathText,
    values: Values | None = None,
    root: PathText | None = None,
    *,
    numbers: NumberType | None = None,
    changes: PathTexts = (),
    compiler: PathText | None = None,
    optimise: str = "O2",
    calibrations: PathTexts = (),
    target: str = HOST.name,
) -> tuple[Trajectory, list[Verdict]]:
    """Simulate a system, run the C of each instance on the same inputs and compare all bits.

    Returns the trajectory and one verdict for each instance; one that was not compared has a note,
    and a difference is not raised. `target` is where the C runs: `host`, or `cortex-m4f` in an
    emulator, which also counts instructions. `numbers` replaces the number type of each instance.
    `changes` are calibration pages such as `1.5 s: k_hs = 6000 N*m/rad`; if there are any, they
    replace those of the scenario. `compiler` is a C compiler instead of the default, `optimise` its
    level (OPTIMISATION_LEVELS). Raises SpecError, MissingToolError, BuildError, and ValueError for
    another number type, level or target.
    """
    numbers, page_texts = number_type_of(numbers), to_texts(changes, "changes")
    flags = flags_at_level(to_choice(optimise, OPTIMISATION_LEVELS, "optimise"))
    machine = MACHINES[to_choice(target, MACHINES, "target")]
    compiler = optional(to_text, compiler, "compiler")
    loaded = load(system, scenario, values, root, calibrations)
    if numbers:
        loaded = Loaded(with_number_type(loaded.system, numbers), loaded.scenario)
    if page_texts:
        pages = parse_pages(page_texts, loaded.system)
        loaded = Loaded(loaded.system, dataclasses.replace(loaded.scenario, calibrations=pages))
    for instance in loaded.system.instances.values():
        if instance.automaton.is_sampled:
            require_ranges(instance.automaton)
    trajectory, tapes = record_ticks(loaded.system, loaded.scenario)
    verdicts = [compare(tape, flags, compiler, machine) for tape in tapes.values()]
    if machine is CORTEX_M4F:
        verdicts = [
            add_instruction_counts(verdict, tapes[verdict.name], flags) for verdict in verdicts
        ]
    return trajectory, add_notes(verdicts, loaded.system, loaded.scenario, trajectory)


def replay(
    estimator: PathText,
    recording: PathText,
    map: PathText,
    variant: PathText | None = None,
    values: Values | None = None,
    root: PathText | None = None,
    *,
    compiled: bool = True,
    calibrations: PathTexts = (),
) -> Replayed:
    """Replay a recording through a sampled automaton and compare it with its C in lock-step.

    Without `compiled` the comparison is left out and the verdict is None. `map` relates columns of
    the recording to signals; columns that the automaton does not use are in `left_out`. `variant`
    is an overlay of the automaton. Raises SpecError, also for a continuous automaton and an input
    without column, MissingToolError and BuildError.
    """
    project, scalars = to_project(root), parse_values(values)
    file, map_name = to_path(recording, "recording"), to_text(map, "map")
    names = to_texts(calibrations, "calibrations")
    variant_name = optional(to_text, variant, "variant")
    automaton, used = _load_estimator(
        to_text(estimator, "estimator"), variant_name, scalars, project, names
    )
    mapping = read_map(read_document(project.path_of(map_name)), project)
    mapping = type_columns(automaton, mapping)
    columns, left_out = used_columns(automaton, mapping)
    measured = read_recording(file, mapping, columns)
    tape = TickLog(used, name=automaton.name)
    result = replay_recording(automaton, used, measured, mapping, on_tick=tape.record_tick)
    tape.start = float(result.trajectory.times[0])
    verdict = compare(tape) if compiled else None
    return Replayed(result, verdict, tuple(left_out), measured)


def _load_estimator(
    reference: str,
    variant: str | None,
    values: Mapping[str, ScalarNode],
    project: Project,
    calibrations: Sequence[str],
) -> tuple[Automaton, Program]:
    """Return a sampled automaton and its Program with variant, calibrations and values applied.

    Raises SpecError, also for a continuous automaton.
    """
    document = read_document(project.path_of(reference))
    if variant:
        over = read_document(project.path_of(variant))
        problems = Problems()
        require_kind(over, "variant", problems)
        document = apply_variant(document, over, project, problems)
    document = add_calibrations(document, calibrations, "--calibration")
    automaton = automaton_of(document, project, values)
    if not automaton.is_sampled:
        label = f"`{automaton.name}` is continuous: only a sampled automaton reads a recording"
        raise SpecError([Problem("form", automaton.span, label, "give it a `period`")])
    return automaton, program_of(automaton)
