"""Variants side by side: what each has are the bits of the interpreter, whatever the others do."""

from __future__ import annotations

import dataclasses
import shutil
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from codegen.simulator.simd_batch import LANES
from codegen.simulator.simulator_source import emit_simulator_files
from engine.batch.batch import Batch, InputTable, SignalStatistic
from engine.batch.compiled_batch import CompiledBatch
from engine.batch.interpreted_batch import run_interpreted_batch
from language.model.system import Scenario, System
from modewright.api.simulation import load
from tests.engine.batch.test_compiled_run import (
    DRIVELINES,
    assert_same_batch,
    compile_unoptimised,
    load_drive,
)
from tests.language.spec_builders import ROOT

COUNT = LANES + 1
"""One vector and a variant that is left over."""
SPREAD = np.array([1.0, 1.2, 0.8, 1.1, 0.9])
LAID = {
    "": True,
    "actuator_delay@T_em": False,
    "backlash@half_shaft": False,
    "coulomb_friction@w_em": True,
    "mount_compliance@half_shaft": True,
    "second_gap@half_shaft": True,
    "stiffness_hysteresis@half_shaft": True,
    "torque_ripple@T_em": True,
    "tyre_slip@vehicle": True,
}
"""Effects on the blind driveline: whether its steps still go side by side."""
VALUES = {
    "mount_compliance@half_shaft": "{J_h: 10 kg*m^2, k_m: 20000 N*m/rad, c_m: 200 N*m*s/rad}",
    "second_gap@half_shaft": "{J_m: 2 kg*m^2, k_2: 6000 N*m/rad, c_2: 60 N*m*s/rad, x_c: 5 mrad}",
    "tyre_slip@vehicle": "{J_w: 2 kg*m^2, C_t: 3000 N*m, w_lo: 1 rad/s}",
}
"""Values that suit the blind driveline, of effects that are too fast for its step without them."""
RUN = """language: 1
scenario: tip
of: laid
horizon: 0.12 s
initial: {w_s: 8 rad/s}
inputs:
  T_em: {start: 60 N*m, steps: {0.02 s: -60 N*m, 0.08 s: 90 N*m}}
  T_br: {start: 0 N*m, steps: {0.06 s: 300 N*m}}
record: {every: 1.5 ms}
"""


def side_by_side(batch: Batch) -> bool:
    """Tell whether any instance of a planned batch goes side by side."""
    (part,) = CompiledBatch(batch, compile_unoptimised)._parts
    return "_Simd(" in emit_simulator_files(part.assembly)["run.h"]


def batch_of(system: System, scenario: Scenario, plant: str = "plant", **changes: object) -> Batch:
    """Return variants of which each parameter of the plant that has a range is another one."""
    automaton = system.instances[plant].automaton
    own = {
        f"{plant}.{name}": float(one.value) * SPREAD
        for name, one in automaton.parameters.items()
        if one.range and one.value is not None and one.kind != "derived"
        if float(one.range[0]) <= 0.8 * float(one.value)
        and 1.2 * float(one.value) <= float(one.range[1])
    }
    signals = tuple(name for name in scenario.signals if name.startswith(f"{plant}."))
    measures = tuple(SignalStatistic(f"peak {name}", name, "peak") for name in signals)
    made = Batch(system, scenario, COUNT, own, statistics=measures, outputs=signals, max_events=9)
    return dataclasses.replace(made, **changes)  # type: ignore[arg-type]


def test_a_plant_with_its_estimator_has_the_bits_of_single_runs() -> None:
    """Through the gap and back, with steps of an input that differ, rows off the steps, noise."""
    system, scenario = load_drive(
        "ev_driveline_noisy", "tip_out", Fraction(12, 100), Fraction(1, 50)
    )
    steps = np.array([[30.0, -20.0], [25.0, -30.0], [30.0, 40.0], [30.0, -60.0], [10.0, -10.0]])
    starts = (Fraction(0), Fraction(21, 1000))
    batch = batch_of(
        system,
        dataclasses.replace(scenario, every=Fraction(7, 10_000)),
        inputs={next(iter(system.inputs)): InputTable(starts, steps)},
        seeds=np.arange(COUNT),
    )
    assert side_by_side(batch)
    theirs = run_interpreted_batch(batch)
    assert theirs.event_counts.max() > 1
    assert_same_batch(CompiledBatch(batch, compile_unoptimised).run(1), theirs)


def test_a_lane_that_leaves_its_range_or_ends_does_not_disturb_the_others() -> None:
    system, scenario = load_drive(
        "ev_driveline_ideal", "tip_out", Fraction(6, 100), Fraction(1, 50)
    )
    start = np.array([310.0, 2500.0, 311.0, 312.0, 2395.0])
    batch = batch_of(system, scenario, initial={"plant.w_em": start})
    mine = CompiledBatch(batch, compile_unoptimised).run(1)
    assert 1 in mine.faults and not {0, 2, 3} & set(mine.faults)
    assert_same_batch(mine, run_interpreted_batch(batch))


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with the blind driveline and the effects, to lay one on the other."""
    folder = tmp_path_factory.mktemp("project")
    for name in ("effects", "recorded"):
        shutil.copytree(ROOT / "spec" / name, folder / "spec" / name)
    (folder / "spec" / "tip.yaml").write_text(RUN)
    return folder


@pytest.mark.long
@pytest.mark.parametrize("effect", LAID)
def test_effects_on_a_plant_have_the_same_bits(effect: str, project: Path) -> None:
    given = f"{{values: {VALUES[effect]}}}" if effect in VALUES else "{}"
    laid = f"effects: {{{effect}: {given}}}" if effect else "about: as it is"
    text = f"language: 1\nvariant: laid\nextends: blind_driveline\n{laid}\n"
    (project / "spec" / "laid.yaml").write_text(text)
    loaded = load("laid", "tip", root=project)
    batch = batch_of(loaded.system, loaded.scenario, "laid")
    assert side_by_side(batch) == LAID[effect]
    theirs = run_interpreted_batch(batch)
    assert theirs.event_counts.max() > 1
    assert_same_batch(CompiledBatch(batch, compile_unoptimised).run(1), theirs)


@pytest.mark.parametrize(
    ("name", "scenario"),
    [("clutch", "launch"), ("three_inertias", "tip_out_in"), ("two_gaps", "tip_out_in")],
)
def test_other_drivelines_have_the_same_bits(name: str, scenario: str) -> None:
    system, short = load_drive(name, scenario, Fraction(1, 5), root=DRIVELINES)
    (plant,) = system.instances
    batch = batch_of(system, short, plant)
    assert_same_batch(
        CompiledBatch(batch, compile_unoptimised).run(1), run_interpreted_batch(batch)
    )


def test_what_is_sampled_or_waits_goes_alone() -> None:
    loaded = load(
        "rig", "run", root=ROOT / "tests/semantics/rules/a_continuous_wait_is_a_time_event"
    )
    batch = Batch(loaded.system, loaded.scenario, COUNT)
    assert not side_by_side(batch)
