"""Batches: what is kept of a variant is what a run of its own gives."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from engine.batch.batch import Batch, BatchResult, InputTable, SignalStatistic
from engine.batch.interpreted_batch import run_interpreted_batch
from engine.batch.parameter_binding import bind_parameters
from engine.simulation.simulate import simulate
from language.model.system import Scenario, StimulusPiece
from modewright.api.simulation import load

RULES = Path(__file__).parents[2] / "semantics" / "rules"
HORIZON = Fraction(3, 20)
EARLY = Fraction(1, 20)
MEASURES = tuple(
    SignalStatistic(kind, "plant.T_hs", kind)
    for kind in ("first", "final", "max", "min", "peak", "mean", "rms")
)


def drive(values: dict[str, str] | None = None) -> mw.Loaded:
    loaded = load("ev_driveline_ideal", "tip_out", values)
    scenario = dataclasses.replace(loaded.scenario, horizon=HORIZON)
    return dataclasses.replace(loaded, scenario=scenario)


def with_step(scenario: Scenario, first: int, second: int) -> Scenario:
    pieces = (StimulusPiece(Fraction(0), Fraction(first)), StimulusPiece(EARLY, Fraction(second)))
    stimulus = dataclasses.replace(scenario.inputs["T_req"], pieces=pieces)
    return dataclasses.replace(scenario, inputs={"T_req": stimulus})


def batch_of(count: int, **changes: object) -> Batch:
    base = drive()
    scenario = with_step(base.scenario, 30, -20)
    return dataclasses.replace(
        Batch(base.system, scenario, count, statistics=MEASURES, max_events=40),
        **changes,  # type: ignore[arg-type]
    )


def same(result: BatchResult, variant: int, run: mw.Trajectory) -> None:
    """Compare the measures and events of a variant with those of a run, bit for bit."""
    torque = run.signals["plant.T_hs"].astype(np.float64)
    expected = {
        "first": torque[0],
        "final": torque[-1],
        "max": torque.max(),
        "min": torque.min(),
        "peak": np.abs(torque).max(),
        "mean": np.cumsum(torque)[-1] / len(torque),
        "rms": np.sqrt(np.cumsum(torque * torque)[-1] / len(torque)),
    }
    assert {name: values[variant] for name, values in result.statistics.items()} == expected
    count = result.event_counts[variant]
    assert count == len(run.events) > 0
    assert list(result.event_times[variant, :count]) == [event.time for event in run.events]
    kinds = [result.kinds[place] for place in result.event_kinds[variant, :count]]
    assert [(k.instance, k.transition) for k in kinds] == [
        (event.instance, event.transition) for event in run.events
    ]


def test_variants_are_runs_with_their_parameters_initial_values_and_inputs() -> None:
    batch = batch_of(
        2,
        parameters={
            "plant.k_hs": np.array([4800.0, 6000.0]),
            "plant.m": np.array([1250.0, 1500.0]),
        },
        initial={"plant.theta_d": np.array([0.0740754719736, 0.06])},
        inputs={"T_req": InputTable((Fraction(0), EARLY), np.array([[30, -20], [40, -10.0]]))},
    )
    result = run_interpreted_batch(batch)
    for variant, (k_hs, m, theta_d, first, second) in enumerate(
        [(4800, 1250, "0.0740754719736", 30, -20), (6000, 1500, "0.06", 40, -10)]
    ):
        loaded = drive({"plant.k_hs": f"{k_hs} N*m/rad", "plant.m": f"{m} kg"})
        stepped = with_step(loaded.scenario, first, second)
        scenario = dataclasses.replace(
            stepped, initial={**stepped.initial, "plant.theta_d": Fraction(theta_d)}
        )
        same(result, variant, simulate(loaded.system, scenario))


def test_what_solved_numbers_and_waits_follow_from_needs_a_program_per_value() -> None:
    values = np.array([4800.0, 6000.0])
    names = {"plant.k_hs": values, "est.k_hs": values, "est.t_wait": np.array([7e-4, 2e-3])}
    batch = batch_of(2, parameters=names)
    assert set(bind_parameters(batch).rebuild_reasons) == {"est.k_hs", "est.t_wait"}
    result = run_interpreted_batch(batch)
    stiff = drive({"k_hs": "6000 N*m/rad", "est.t_wait": "2 ms"})
    same(result, 1, simulate(stiff.system, with_step(stiff.scenario, 30, -20)))


@pytest.mark.parametrize("waits", [[2e-3, 7.5e-3, 50e-3], [20e-3]])
def test_a_tunable_wait_is_swept_by_whole_ticks(waits: list[float]) -> None:
    """Also where it has one value only: the page holds ticks, no seconds."""
    loaded = load("rig", "run", root=RULES / "a_tunable_wait_is_kept_in_ticks")
    values = {"a.t_on": np.array(waits)}
    batch = Batch(loaded.system, loaded.scenario, len(waits), parameters=values, max_events=40)
    assert set(bind_parameters(batch).rebuild_reasons) == {"a.t_on"}
    result = run_interpreted_batch(batch)
    for variant, wait in enumerate(waits):
        again = load(
            "rig",
            "run",
            {"a.t_on": f"{1e3 * wait:g} ms"},
            RULES / "a_tunable_wait_is_kept_in_ticks",
        )
        run = simulate(again.system, again.scenario)
        times = [float(event.time) for event in run.events]
        kept = result.event_times[variant]
        assert kept[np.isfinite(kept)].tolist() == times


def test_a_measure_takes_the_rows_of_its_span() -> None:
    late = SignalStatistic("late", "plant.T_hs", "max", Fraction(1, 10), Fraction(105, 1000))
    never = SignalStatistic("never", "plant.T_hs", "max", Fraction(3), Fraction(4))
    result = run_interpreted_batch(batch_of(1, statistics=(late, never), outputs=("plant.T_hs",)))
    inside = (result.times >= 0.1) & (result.times <= 0.105)
    assert inside.sum() == 11
    assert result.statistics["late"][0] == result.outputs["plant.T_hs"][0, inside].max()
    assert np.isnan(result.statistics["never"][0])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"parameters": {"plant.k": np.zeros(1)}}, "`plant.k` is no parameter"),
        ({"initial": {"plant.k_hs": np.zeros(1)}}, "`plant.k_hs` is no state"),
        ({"parameters": {"plant.m": np.zeros(2)}}, "`plant.m` needs 1 finite values"),
        ({"outputs": ("plant.T",)}, "`plant.T` is no signal"),
        ({"inputs": {"T_req": InputTable((Fraction(1),), np.zeros((1, 1)))}}, "the first at 0 s"),
    ],
)
def test_a_name_that_is_not_there_is_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        bind_parameters(batch_of(1, **changes))
