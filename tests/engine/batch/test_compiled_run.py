"""Planned runs: compiled C gives what the interpreter gives, bit for bit."""

from __future__ import annotations

import dataclasses
import re
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import modewright as mw
from codegen.simulator.simulator_library import SimulatorLibrary, load_library
from codegen.toolchain.compiler import flags_at_level
from engine.batch.batch import Batch, BatchResult, InputTable, SignalStatistic
from engine.batch.compiled_batch import CompiledBatch, CompiledBatchCache
from engine.batch.compiled_run import CompiledRun
from engine.batch.interpreted_batch import run_interpreted_batch
from engine.batch.run_plan import planning_obstacle
from engine.simulation.instance_programs import programs_of
from engine.simulation.simulate import simulate
from language.model.system import Scenario, ScheduledCalibration, StimulusPiece, System
from language.programs.system_program import SimulationAssembly
from modewright.api.simulation import load
from modewright.runtime.back_end_choice import run_batch, run_simulation
from tests.language.spec_builders import ROOT

pytestmark = pytest.mark.long

DRIVELINES = ROOT / "tests/data/specs/drivelines"
compile_unoptimised = partial(load_library, flags=flags_at_level("O0"))
"""Bits do not depend on the level: a compiler that need not optimise is done sooner."""
Loaded = tuple[System, Scenario]


def load_drive(
    name: str, scenario: str, horizon: Fraction, early: Fraction | None = None, root: Path = ROOT
) -> Loaded:
    """Return a system with a short scenario; `early` is when its inputs step."""
    loaded = load(name, scenario, root=root)
    inputs = dict(loaded.scenario.inputs)
    for key, stimulus in inputs.items():
        if early and len(stimulus.pieces) > 1:
            pieces = (stimulus.pieces[0], StimulusPiece(early, stimulus.pieces[1].value))
            inputs[key] = dataclasses.replace(stimulus, pieces=pieces)
    return loaded.system, dataclasses.replace(loaded.scenario, horizon=horizon, inputs=inputs)


def compiled(system: System, scenario: Scenario) -> mw.Trajectory:
    programs = programs_of(system, scenario)
    assert planning_obstacle(system, scenario, programs) is None
    found = CompiledRun(system, scenario, programs, compile_unoptimised).trajectory()
    assert found is not None
    return found


def assert_same(mine: mw.Trajectory, theirs: mw.Trajectory) -> None:
    assert mine.events == theirs.events
    assert mine.times.tobytes() == theirs.times.tobytes()
    assert list(mine.signals) == list(theirs.signals)
    for name, values in theirs.signals.items():
        assert mine.signals[name].dtype == values.dtype
        assert mine.signals[name].tobytes() == values.tobytes(), name
    rest = ("name", "units", "modes", "stopped", "faults")
    assert [getattr(mine, key) for key in rest] == [getattr(theirs, key) for key in rest]


@pytest.mark.parametrize(
    ("name", "scenario"), [("ev_driveline", "tip_out"), ("ev_driveline_sensed", "tip_out_sensed")]
)
def test_a_shipped_scenario_has_the_bits_of_the_interpreter(name: str, scenario: str) -> None:
    system, short = load_drive(name, scenario, Fraction(15, 100), Fraction(20, 1000))
    theirs = simulate(system, short)
    assert len(theirs.events) >= 4
    assert_same(compiled(system, short), theirs)


def with_rows(loaded: Loaded, every: Fraction) -> Loaded:
    return loaded[0], dataclasses.replace(loaded[1], every=every)


@pytest.mark.parametrize(
    ("name", "scenario", "horizon"),
    [
        ("light_damping", "coasting_down", Fraction(5, 10)),
        ("two_gaps", "tip_out_in", Fraction(6, 10)),
        ("clutch", "launch", Fraction(13, 10)),
    ],
)
def test_rows_at_and_inside_steps_and_events_are_those_of_the_interpreter(
    name: str, scenario: str, horizon: Fraction
) -> None:
    """Of the last two an input changes inside the steps: on lines, and by a formula of time."""
    loaded = with_rows(load_drive(name, scenario, horizon, root=DRIVELINES), Fraction(3, 16_000))
    theirs = simulate(*loaded)
    assert len(theirs.events) >= 1
    assert_same(compiled(*loaded), theirs)


def test_a_ramp_that_arrives_late_has_the_bits_of_the_interpreter() -> None:
    system, scenario = load_drive("ev_driveline_sensed", "tip_out_sensed", Fraction(15, 100))
    starts = (Fraction(0), Fraction(20, 1000), Fraction(61, 1000))
    ends = (
        (Fraction(30), Fraction(0)),
        (Fraction(30), Fraction(-5000, 3)),
        (Fraction(-20), Fraction(0)),
    )
    pieces = tuple(StimulusPiece(at, *line) for at, line in zip(starts, ends, strict=True))
    stimulus = dataclasses.replace(scenario.inputs["T_req"], pieces=pieces)
    inputs = {**scenario.inputs, "T_req": stimulus}
    ramped = dataclasses.replace(
        scenario, inputs=inputs, signals=("T_req", "plant.T_hs", "est.T_hs")
    )
    loaded = with_rows((system, ramped), Fraction(3, 16_000))
    theirs = simulate(*loaded)
    assert theirs.events
    assert_same(compiled(*loaded), theirs)


@pytest.mark.parametrize(
    "rule",
    [
        "an_invariant_is_checked_and_never_forces_anything",
        "a_delay_of_a_continuous_automaton_is_read_from_its_major_steps",
        "edges_of_a_continuous_automaton_are_events_of_their_argument",
        "parallel_regions_of_a_continuous_automaton_swap_at_one_instant",
        "a_rewind_makes_its_micro_step_with_the_inputs_of_then",
        "a_chart_may_be_regions_and_no_modes",
    ],
)
def test_rules_hold_in_c_as_well(rule: str) -> None:
    """Of all cases of the rule book those with what is between the blocks of a Program."""
    root = ROOT / "tests/semantics/rules" / rule
    texts = [path.read_text() for path in sorted((root / "spec").glob("*.yaml"))]
    scenarios = [text for text in texts if re.search("^scenario:", text, re.MULTILINE)]
    assert scenarios
    for text in scenarios:
        name, of = (re.search(f"^{key}: *(\\w+)", text, re.MULTILINE) for key in ("scenario", "of"))
        assert name and of
        loaded = load(of[1], name[1], root=root)
        theirs = simulate(loaded.system, loaded.scenario)
        assert_same(compiled(loaded.system, loaded.scenario), theirs)


def batch_of(count: int, **changes: object) -> Batch:
    system, scenario = load_drive(
        "ev_driveline_sensed", "tip_out_sensed", Fraction(1, 10), Fraction(20, 1000)
    )
    kinds = ("first", "final", "max", "min", "peak", "mean", "rms")
    measures = [SignalStatistic(kind, "plant.T_hs", kind) for kind in kinds]  # type: ignore[arg-type]
    late = SignalStatistic("late", "est.T_hs", "mean", Fraction(3, 100), Fraction(5, 100))
    names = {"statistics": (*measures, late), "outputs": ("s_em", "est.mode"), "max_events": 3}
    made = Batch(system, scenario, count, **names)  # type: ignore[arg-type]
    return dataclasses.replace(made, **changes)  # type: ignore[arg-type]


def assert_same_batch(mine: BatchResult, theirs: BatchResult) -> None:
    for key in ("statistics", "outputs"):
        for name, values in getattr(theirs, key).items():
            assert getattr(mine, key)[name].tobytes() == values.tobytes(), name
    for key in ("times", "event_counts", "event_times", "event_kinds"):
        assert getattr(mine, key).tobytes() == getattr(theirs, key).tobytes(), key
    assert (mine.kinds, mine.stopped) == (theirs.kinds, theirs.stopped)
    assert mine.faults == theirs.faults


def test_variants_of_a_batch_have_the_bits_of_the_interpreter_on_any_number_of_threads() -> None:
    table = np.array([[30.0, -20.0], [25.0, -30.0], [30.0, 40.0]])
    batch = batch_of(
        3,
        parameters={
            "plant.k_hs": np.array([4800.0, 7000.0, 5000.0]),
            "plant.J_em": np.array([0.05, 0.04, 0.06]),
        },
        initial={"plant.theta_d": np.array([0.074, 0.06, 0.07])},
        inputs={"T_req": InputTable((Fraction(0), Fraction(21, 1000)), table)},
        seeds=np.array([1, 2, 3]),
    )
    theirs = run_interpreted_batch(batch)
    assert theirs.event_counts.max() > batch.max_events
    for threads in (1, 2):
        mine = CompiledBatch(batch, compile_unoptimised).run(threads)
        assert mine.note == "compiled"
        assert_same_batch(mine, theirs)


def test_a_batch_that_differs_in_numbers_alone_is_planned_once() -> None:
    """In other numbers, in how many, and beyond those of the first: up to the declared range."""
    made: list[object] = []

    def build(assembly: SimulationAssembly) -> SimulatorLibrary:
        made.append(assembly)
        return compile_unoptimised(assembly)

    planner = CompiledBatchCache(build)
    first = {"plant.k_hs": np.array([4800.0, 5000.0]), "plant.J_em": np.array([0.05, 0.05])}
    others: list[dict[str, Any]] = [
        {"count": 2, "parameters": first},
        {"count": 1, "parameters": {name: values[:1] * 1.1 for name, values in first.items()}},
        {"count": 1, "parameters": {"plant.k_hs": first["plant.k_hs"][:1]}},
        {"count": 2, "parameters": first, "max_events": 9},
    ]
    for changes, plans in zip(others, (1, 1, 2, 3), strict=True):
        batch = batch_of(**changes)
        assert_same_batch(planner.get_or_compile(batch).run(1), run_interpreted_batch(batch))
        assert len(made) == plans
    refused = {name: np.array([np.nan]) for name in first}
    with pytest.raises(ValueError, match="needs 1 finite values"):
        planner.get_or_compile(batch_of(1, parameters=refused))


def test_steps_that_the_interpreter_took_count_until_they_are_worth_a_library() -> None:
    """Each block of a study has 500 here: with the third there are 1500."""
    planner, notes = CompiledBatchCache(compile_unoptimised, min_steps=1500), []
    for k_hs in (4800.0, 5000.0, 5200.0, 5400.0):
        batch = batch_of(1, parameters={"plant.k_hs": np.array([k_hs])})
        found = planner.get_or_compile(batch).run(1)
        assert_same_batch(found, run_interpreted_batch(batch))
        notes.append(found.note.partition(":")[0])
    assert notes == ["interpreter", "interpreter", "compiled", "compiled"]


def test_inputs_that_step_at_times_of_their_own_share_programs_and_library() -> None:
    """From batch to batch: each variant has a plan, what is lowered and built is one."""
    made: list[object] = []

    def build(assembly: SimulationAssembly) -> SimulatorLibrary:
        made.append(assembly)
        return compile_unoptimised(assembly)

    def stepping(batch: Batch, *milliseconds: int) -> Batch:
        step, before = batch.scenario.inputs["T_req"], dict(batch.scenario.inputs)
        courses = []
        for number in milliseconds:
            piece = dataclasses.replace(step.pieces[1], start=Fraction(number, 1000))
            courses.append(
                {**before, "T_req": dataclasses.replace(step, pieces=(step.pieces[0], piece))}
            )
        scenario = dataclasses.replace(batch.scenario, inputs=courses[0])
        return dataclasses.replace(batch, scenario=scenario, variant_inputs=tuple(courses))

    planner, programs = CompiledBatchCache(build), []
    names = {"parameters": {"plant.k_hs": np.array([4800.0, 7000.0])}, "seeds": np.array([1, 2])}
    for times, builds in (((20, 31), 1), ((45, 12), 2)):
        batch = stepping(batch_of(2, **names), *times)
        planned = planner.get_or_compile(batch)
        assert_same_batch(planned.run(1), run_interpreted_batch(batch))
        programs.append(planned._parts[0].group.binding.programs)
        assert len(made) == builds
    assert programs[0] is programs[1]


def test_a_variant_that_leaves_a_range_or_stops_is_told_by_the_interpreter() -> None:
    batch = batch_of(
        2,
        initial={"plant.w_em": np.array([310.0, 2500.0])},
        inputs={"T_req": InputTable((Fraction(0),), np.array([[30.0], [30.0]]))},
    )
    mine = CompiledBatch(batch, compile_unoptimised).run()
    assert list(mine.faults) == [1]
    assert_same_batch(mine, run_interpreted_batch(batch))


def test_what_cannot_be_planned_is_run_block_by_block_and_says_why() -> None:
    system, scenario = load_drive("ev_driveline_ideal", "tip_out", Fraction(1, 100))
    page = ScheduledCalibration(Fraction(1, 200), {("plant", "J_em"): Fraction(6, 100)})
    paged = dataclasses.replace(scenario, calibrations=(page,))
    trajectory, means = run_simulation(system, paged, compiled=True)
    why = "a page of the calibration turns during the run"
    assert means == f"compiled, block by block: {why}"
    assert_same(trajectory, simulate(system, paged))
    batch = Batch(system, paged, 1, statistics=(SignalStatistic("m", "plant.w_w", "final"),))
    assert run_batch(batch).note == f"interpreter: {why}"


def test_without_a_compiler_the_interpreter_does_the_work_and_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("CC", "no_such_compiler")
    system, scenario = load_drive("ev_driveline_ideal", "tip_out", Fraction(1, 100))
    trajectory, means = run_simulation(system, scenario, compiled=True)
    assert means == (
        "interpreter: the C compiler `no_such_compiler` is missing: apt-get install gcc libc6-dev"
    )
    assert_same(trajectory, simulate(system, scenario))


def test_a_short_run_is_not_worth_a_compiler() -> None:
    system, scenario = load_drive("ev_driveline_ideal", "tip_out", Fraction(1, 100))
    assert run_simulation(system, scenario)[1] == "interpreter: 50 steps are too few to compile for"
