"""The paper's own mismatch: an amplitude-dependent shaft in a tip-out is told, named, repaired."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np
import pytest

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet, balance_disturbances
from diagnosis.model.placed_effect import find_placements, shipped_effects
from diagnosis.report.figures import draw_oscillation
from diagnosis.selection.comparison import effective_gain
from diagnosis.validation.oscillation import (
    Cycles,
    Oscillation,
    _find_cycles,
    _remove_moving_mean,
    analyse_oscillation,
)
from language.loading.load import automaton_of
from language.overlays.expand_document import Project, expand_document
from language.text.diagnostic import Source
from language.text.project_files import parse_document
from tests.diagnosis.estimation.test_levenberg_marquardt import SCALES
from tests.diagnosis.localisation.test_ranking import fit_first_base
from tests.generators.open_cases.case import simulate_cases, stream
from tests.generators.open_cases.recording import sample_recording
from tests.generators.open_cases.tip_out import VARIANT, tip_out_case
from tests.language.spec_builders import ROOT


def bench_of(hidden: bool) -> ModelSet:
    """Return the paper's driveline with three tip-outs of a simulation of its own."""
    case = tip_out_case(hidden)
    generator = stream(case.seed, case.number, "noise")
    series = []
    for number, course in enumerate(simulate_cases([case])[0][: case.train]):
        table = sample_recording(course, case, generator)
        inputs, measured = (np.ascontiguousarray(table[:, part]) for part in ([1, 2], [3, 4]))
        name, period = f"tip_out_{number}", Fraction(1, case.rate)
        series.append(SampledRecording(name, period, Fraction(0), inputs, measured, True))
    project = Project(ROOT)
    source = Source("paper_driveline.yaml", tuple(VARIANT.splitlines()))
    document = expand_document(parse_document(source, VARIANT), project)
    automaton = automaton_of(document, project)
    drifts = balance_disturbances(document, automaton)
    names = ("stiffness_hysteresis", "stiffness_nonlinear")
    effects = tuple(one for one in shipped_effects() if one.name in names)
    return ModelSet(document, project, automaton, effects, tuple(series), ("w_em", "w_s"), drifts)


def fitted(bench: ModelSet) -> tuple[Estimate, dict[str, Estimate]]:
    """Return the fitted base, and it with each effect."""
    base = fit_first_base(bench)
    found = {}
    for effect in bench.effects:
        for layer in find_placements(bench.document, effect):
            start = {**base.values(0), "k_r_half_shaft": 500.0, "F_r_half_shaft": 30.0}
            one = bench.compile_candidate((dataclasses.replace(layer, scales=SCALES),))
            found[effect.name] = estimate_parameters(one, bench.series, base.noise_levels, start)
    return base, found


@pytest.mark.long
def test_an_amplitude_dependent_shaft_is_told_named_and_repaired() -> None:
    bench = bench_of(hidden=True)
    base, found = fitted(bench)
    correlation = integrated_autocorrelation(found["stiffness_hysteresis"], bench.series)
    count = len(bench.series)
    gains = {k: effective_gain(one, base, correlation, count) for k, one in found.items()}
    assert gains["stiffness_hysteresis"] > 45.0
    assert gains["stiffness_hysteresis"] > gains["stiffness_nonlinear"] + 20.0
    before = analyse_oscillation(base, bench.series)
    after = analyse_oscillation(found["stiffness_hysteresis"], bench.series)
    assert before is not None
    assert after is not None
    assert before.has_other_frequency
    assert 0.3 < before.followed_time < 1.2
    told = before.format_sentence()
    assert told.startswith(f"w_em fits until t = {before.followed_time:.2f} s after the step at ")
    assert "then the shuffle's frequency is 6." in told
    assert "growing as the amplitude falls" in told
    assert before.recorded.frequency_trend() > before.simulated.frequency_trend() + 0.02
    assert after.followed_time > before.followed_time + 0.2
    assert b"recorded" in draw_oscillation([before, after], "rad/s").data("svg")


def test_frequency_and_damping_are_those_of_the_oscillation() -> None:
    time = np.arange(250) * 0.01
    values = 3.0 * time + 20.0 * np.exp(-1.5 * time) * np.sin(2.0 * np.pi * 6.0 * time)
    found = _find_cycles(_remove_moving_mean(values, 17), 0.01, 0.5)
    assert found.frequencies[:-1] == pytest.approx(6.0, rel=0.01)
    assert found.damping_ratio() == pytest.approx(1.5 / (2.0 * np.pi * 6.0), rel=0.1)
    assert abs(found.frequency_trend()) < 0.01


def test_a_model_that_follows_to_the_end_is_told_so() -> None:
    cycles = Cycles(np.array([0.1, 0.3]), np.array([5.0, 5.0]), np.array([9.0, 3.0]))
    fits = Oscillation("a.csv", 1.0, "w_em", 2.5, 2.5, cycles, cycles)
    assert not fits.has_other_frequency
    assert (
        fits.format_sentence() == "w_em fits to the end, 2.50 s after the step at 1.00 s of a.csv"
    )
    left = dataclasses.replace(fits, followed_time=0.2)
    assert not left.has_other_frequency  # by the same frequency
    assert left.format_sentence().endswith("5.00 Hz in the recording and 5.00 Hz in the model")


def test_without_a_step_there_is_none_and_a_clean_one_is_followed() -> None:
    bench = bench_of(hidden=False)
    quiet = tuple(
        dataclasses.replace(one, inputs=np.zeros_like(one.inputs)) for one in bench.series
    )
    base = fit_first_base(bench)
    assert analyse_oscillation(base, quiet) is None
    clean = analyse_oscillation(base, bench.series)
    assert clean is not None
    assert not clean.has_other_frequency
