"""A fit finds the parameters that a simulation was made with, and what a left-out effect is."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np
import pytest

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.data.sampled_recording import SampledRecording, decimate
from diagnosis.estimation.estimate import evaluate, with_best_gain_scale
from diagnosis.estimation.innovations import NoiseLevels, measured_noise_levels
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet, balance_disturbances
from diagnosis.estimation.noise_level import ORDINARY_LEVEL, disturbance_units
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import vector_of
from diagnosis.model.placed_effect import PlacedEffect, find_placements, shipped_effects
from diagnosis.selection.comparison import effective_gain
from language.loading.load import automaton_of
from language.overlays.expand_document import Project, expand_document, read_document
from tests.language.spec_builders import ROOT

PERIOD = Fraction(1, 200)
COUNT = 500
TRUTH = {"J_em": 0.056, "k": 6600.0, "c": 54.0, "alpha": 0.022, "J_v": 120.0}
FRICTION = {"T_c_w_em": 2.0}
OUTPUTS = ("w_em", "w_s")


SCALES = {
    **{"load": Fraction(300), "rate": Fraction(100), "inertia": Fraction(100)},
    **{"level": Fraction(100), "stretch": Fraction(1, 10), "time": Fraction(3, 10)},
    **{"period": Fraction(1, 100), "horizon": Fraction(10)},
}
"""Magnitudes of the places of the driveline, rounded."""


def place_effect(model_set: ModelSet, name: str) -> PlacedEffect:
    """Return the effect `id@place` of the library with the magnitudes of the driveline."""
    effect = next(one for one in shipped_effects() if one.name == name.partition("@")[0])
    fits = find_placements(model_set.document, effect)
    return dataclasses.replace(next(one for one in fits if one.id == name), scales=SCALES)


def torque(kind: int) -> np.ndarray:
    time = np.arange(COUNT) * float(PERIOD)
    if kind == 0:
        return np.where(time < 0.8, 30.0, np.where(time < 1.6, -20.0, 60.0))
    if kind == 1:
        return np.asarray(40.0 + 30.0 * np.sin(2 * np.pi * (0.5 + time) * time))
    return np.asarray(25.0 * np.sign(np.sin(2 * np.pi * 0.6 * time)))


def simulate_recordings(
    candidate: Candidate, values: dict[str, float], brake: float = 0.0
) -> tuple[SampledRecording, ...]:
    """Return simulations without correction, with noise on what is seen; a `brake` [N*m] acts for
    half a second.
    """
    rng = np.random.default_rng(11)
    found = []
    states, seen = len(candidate.predictor.states), len(OUTPUTS)
    no_gain = np.zeros((len(candidate.predictor.modes), states, seen))
    for kind, speed in ((0, 60.0), (1, 120.0), (2, 5.0)):
        inputs = np.zeros((COUNT, len(candidate.predictor.inputs)))
        inputs[:, candidate.predictor.inputs.index("T_em")] = torque(kind)
        inputs[160:260, candidate.predictor.inputs.index("T_br")] = brake
        measured = np.zeros((COUNT, seen))
        measured[0] = speed, speed / 9.0
        blank = SampledRecording(f"{kind}", PERIOD, Fraction(0), inputs, measured)
        page = candidate.calibration_page(values, blank)
        substeps = candidate.compiled.substeps
        run = candidate.predictor.predict(
            page,
            inputs,
            measured,
            no_gain[:0],
            no_gain,
            substeps,
            linear_inputs=blank.linear_inputs,
        )
        assert run.completed == COUNT
        noisy = run.outputs + rng.normal(0.0, [0.05, 0.01], run.outputs.shape)
        found.append(dataclasses.replace(blank, measured=np.ascontiguousarray(noisy)))
    return tuple(found)


def ordinary_noise_levels(
    candidate: Candidate, series: tuple[SampledRecording, ...]
) -> NoiseLevels:
    """The measured noise of the signals, and the ordinary disturbance of each balance."""
    units = disturbance_units(candidate, series, {})
    ordinary = {name: ORDINARY_LEVEL * unit for name, unit in units.items()}
    return measured_noise_levels(series, ordinary)


@pytest.fixture(scope="module")
def bench() -> ModelSet:
    project = Project(ROOT)
    document = expand_document(read_document(project.path_of("blind_driveline")), project)
    automaton = automaton_of(document, project)
    effects = tuple(e for e in shipped_effects() if e.name in ("coulomb_friction", "sensor_lag"))
    blank = SampledRecording("blank", PERIOD, Fraction(0), np.zeros((2, 2)), np.zeros((2, 2)))
    drifts = balance_disturbances(document, automaton)
    return ModelSet(document, project, automaton, effects, (blank,), OUTPUTS, drifts)


def test_a_clean_recording_gives_the_parameters_that_made_it(bench: ModelSet) -> None:
    candidate = bench.compile_candidate(())
    series = simulate_recordings(candidate, TRUTH)
    noise_levels = ordinary_noise_levels(candidate, series)
    found = estimate_parameters(candidate, series, noise_levels, {}).values(0)
    for name, value in TRUTH.items():
        assert found[name] == pytest.approx(value, rel=0.02), name


def test_gains_that_are_too_large_get_a_factor_that_further_fits_keep(bench: ModelSet) -> None:
    """Recordings without disturbances, for which the gains of a large disturbance are wrong."""
    candidate = bench.compile_candidate(())
    series = simulate_recordings(candidate, TRUTH)
    units = disturbance_units(candidate, series, {})
    levels = measured_noise_levels(series, {name: 30.0 * unit for name, unit in units.items()})
    before = evaluate(candidate, series, levels, vector_of(candidate, len(series), TRUTH))
    after = with_best_gain_scale(before, series)
    factor = after.noise_levels.gain_scale
    assert after.cost < before.cost - 100.0
    assert factor < 0.5
    assert np.array_equal(after.gains.steady_state, factor * before.gains.steady_state)
    again = evaluate(candidate, series, after.noise_levels, after.point, after.prediction)
    assert again.cost == pytest.approx(after.cost, abs=20.0)
    assert with_best_gain_scale(after, series).noise_levels.gain_scale == factor
    stopped = dataclasses.replace(
        after,
        gains=after.gains.scaled(0.0),
        noise_levels=dataclasses.replace(levels, gain_scale=0.0),
    )
    assert with_best_gain_scale(stopped, series).noise_levels.gain_scale == factor


def test_a_left_out_friction_gains_where_it_is_and_a_lag_does_not(bench: ModelSet) -> None:
    base = bench.compile_candidate(())
    friction = bench.compile_candidate((place_effect(bench, "coulomb_friction@w_em"),))
    series = simulate_recordings(friction, {**TRUTH, **FRICTION})
    known = estimate_parameters(base, series, ordinary_noise_levels(base, series), {})
    start = {**known.values(0), "T_c_w_em": 0.5}
    better = estimate_parameters(friction, series, known.noise_levels, start)
    correlation = integrated_autocorrelation(better, series)
    assert effective_gain(better, known, correlation, len(series)) > 100.0
    assert better.values(0)["T_c_w_em"] == pytest.approx(2.0, rel=0.1)
    lag = bench.compile_candidate((place_effect(bench, "sensor_lag@w_s"),))
    start = {**known.values(0), "tau_w_s": 0.002}
    worse = estimate_parameters(lag, series, known.noise_levels, start)
    assert known.cost - worse.cost < (known.cost - better.cost) / 4


def test_a_fast_recording_is_thinned_to_means_of_its_inputs() -> None:
    inputs = np.arange(20.0).reshape(20, 1)
    fast = SampledRecording("fast", Fraction(1, 1000), Fraction(0), inputs, inputs * 2.0)
    slow = decimate(fast)
    assert slow.period == Fraction(1, 200)
    assert list(slow.inputs[:, 0]) == [2.0, 7.0, 12.0, 17.0]
    assert list(slow.measured[:, 0]) == [0.0, 10.0, 20.0, 30.0]
    assert np.array_equal(decimate(slow).inputs, slow.inputs)


def test_an_input_that_runs_straight_is_not_shifted_by_thinning() -> None:
    ramp = np.arange(40.0).reshape(40, 1)
    slow = decimate(
        SampledRecording("ramp", Fraction(1, 1000), Fraction(0), ramp, ramp),
        is_first_order_hold=True,
    )
    assert list(slow.inputs[1:-1, 0]) == list(slow.measured[1:-1, 0])
    assert slow.is_first_order_hold
