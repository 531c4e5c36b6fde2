"""The paper's own mismatch: an amplitude-dependent shaft in a tip-out is told, named, repaired."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np
import pytest

from diagnosis import level
from diagnosis.bench import Bench, balance_drifts
from diagnosis.estimate import Estimate
from diagnosis.evidence import evidence
from diagnosis.layers import fitting, shipped_effects
from diagnosis.level import first_fit, recalibrated, units_of
from diagnosis.series import Series
from diagnosis.shuffle import Cycles, Shuffle, _cycles, _wave, shuffle_of
from diagnosis.shuffle_picture import shuffle_picture
from language.finding import document_of
from language.load import automaton_of
from language.problem import Source
from language.project import Project, expanded
from tests.language.making import ROOT
from tests.open_generator.case import courses, stream
from tests.open_generator.recording import recorded
from tests.open_generator.tip_out import VARIANT, tip_outs


def bench_of(hidden: bool) -> Bench:
    """Return the paper's driveline with three tip-outs of a simulation of its own."""
    case = tip_outs(hidden)
    generator = stream(case.seed, case.number, "noise")
    series = []
    for number, course in enumerate(courses([case])[0][: case.train]):
        table = recorded(course, case, generator)
        inputs, measured = (np.ascontiguousarray(table[:, part]) for part in ([1, 2], [3, 4]))
        name, period = f"tip_out_{number}", Fraction(1, case.rate)
        series.append(Series(name, period, Fraction(0), inputs, measured, True))
    project = Project(ROOT)
    source = Source("paper_driveline.yaml", tuple(VARIANT.splitlines()))
    document = expanded(document_of(source, VARIANT), project)
    automaton = automaton_of(document, project)
    drifts = balance_drifts(document, automaton)
    names = ("stiffness_hysteresis", "stiffness_nonlinear")
    effects = tuple(one for one in shipped_effects() if one.name in names)
    return Bench(document, project, automaton, effects, tuple(series), ("w_em", "w_s"), drifts)


def fitted(bench: Bench) -> tuple[Estimate, dict[str, Estimate]]:
    """Return the recalibrated base, and it with each effect."""
    candidate = bench.candidate(())
    units = units_of(candidate, bench.series, {})
    base = recalibrated(first_fit(candidate, bench.series, units), bench.series, units)
    found = {}
    for effect in bench.effects:
        for layer in fitting(bench.document, effect):
            start = {**base.values(0), "k_r_half_shaft": 500.0, "F_r_half_shaft": 30.0}
            one = bench.candidate((layer,))
            found[effect.name] = level.fitted(one, bench.series, base.noises, start, units)
    return base, found


@pytest.mark.long
def test_an_amplitude_dependent_shaft_is_told_named_and_repaired() -> None:
    bench = bench_of(hidden=True)
    base, found = fitted(bench)
    gains = {name: evidence(one, base, bench.series) for name, one in found.items()}
    assert gains["stiffness_hysteresis"].least > 45.0
    assert gains["stiffness_hysteresis"].total > gains["stiffness_nonlinear"].total + 20.0
    before = shuffle_of(base, bench.series)
    after = shuffle_of(found["stiffness_hysteresis"], bench.series)
    assert before is not None
    assert after is not None
    assert before.differs
    assert 0.3 < before.until < 1.0
    told = before.sentence()
    assert told.startswith(f"w_em fits until t = {before.until:.2f} s after the step at ")
    assert "then the shuffle's frequency is 6." in told
    assert "growing as the amplitude falls" in told
    assert before.recorded.growth() > before.simulated.growth() + 0.02
    assert after.until > before.until + 0.2
    assert b"recorded" in shuffle_picture([before, after], "rad/s").data("svg")


def test_frequency_and_damping_are_those_of_the_oscillation() -> None:
    time = np.arange(250) * 0.01
    values = 3.0 * time + 20.0 * np.exp(-1.5 * time) * np.sin(2.0 * np.pi * 6.0 * time)
    found = _cycles(_wave(values, 17), 0.01, 0.5)
    assert found.rates[:-1] == pytest.approx(6.0, rel=0.01)
    assert found.damping() == pytest.approx(1.5 / (2.0 * np.pi * 6.0), rel=0.1)
    assert abs(found.growth()) < 0.01


def test_a_model_that_follows_to_the_end_is_told_so() -> None:
    cycles = Cycles(np.array([0.1, 0.3]), np.array([5.0, 5.0]), np.array([9.0, 3.0]))
    fits = Shuffle("a.csv", 1.0, "w_em", 2.5, 2.5, cycles, cycles)
    assert not fits.differs
    assert fits.sentence() == "w_em fits to the end, 2.50 s after the step at 1.00 s of a.csv"
    left = dataclasses.replace(fits, until=0.2)
    assert not left.differs  # by the same frequency
    assert left.sentence().endswith("5.00 Hz in the recording and 5.00 Hz in the model")


def test_without_a_step_there_is_none_and_a_clean_one_is_followed() -> None:
    bench = bench_of(hidden=False)
    quiet = tuple(
        dataclasses.replace(one, inputs=np.zeros_like(one.inputs)) for one in bench.series
    )
    candidate = bench.candidate(())
    units = units_of(candidate, bench.series, {})
    base = recalibrated(first_fit(candidate, bench.series, units), bench.series, units)
    assert shuffle_of(base, quiet) is None
    clean = shuffle_of(base, bench.series)
    assert clean is not None
    assert not clean.differs
