"""Levels of noises and parameters are found together, whatever levels a fit begins with."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate, evaluate
from diagnosis.estimation.innovations import (
    INPUT_NOISE_NAME,
    OUTPUT_NOISE_NAME,
    PROCESS_NOISE_NAME,
    NoiseLevels,
    measured_noise_levels,
    noise_levels_at,
)
from diagnosis.estimation.levenberg_marquardt import iterate_broyden
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_covariance import (
    MAX_LEVEL,
    MAX_NOISE_RATIO,
    MIN_LEVEL,
    fit_noise_covariance,
)
from diagnosis.estimation.noise_level import disturbance_units, fit_with_noise
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter import FreeParameter
from diagnosis.model.parameter_vector import ParameterVector
from tests.diagnosis.estimation.test_levenberg_marquardt import (
    FRICTION,
    TRUTH,
    bench,
    simulate_recordings,
)

__all__ = ["bench"]
NEAR = 3.0
"""Nats by which fits from different levels may differ."""
LEVELS, FACTORS = (0.1, 1.0), (0.6, 1.0, 1.8)
"""Levels of drifts in their units, and factors of the noise of signals, that fits begin with."""


@pytest.fixture(scope="module")
def rubbing(bench: ModelSet) -> tuple[SampledRecording, ...]:
    """Return recordings of a driveline with a friction that the base lacks."""
    layers = [layer for layer in bench.applicable_effects() if layer.id == "coulomb_friction@w_em"]
    return simulate_recordings(bench.compile_candidate(layers), {**TRUTH, **FRICTION})


def begun(
    base: Candidate, series: tuple[SampledRecording, ...], level: float, factor: float
) -> Estimate:
    """Return the base fitted with levels that stay as they are given."""
    units = disturbance_units(base, series, {})
    known = measured_noise_levels(series, {name: level * unit for name, unit in units.items()})
    return iterate_broyden(
        base, series, dataclasses.replace(known, outputs=factor * known.outputs), {}
    )


def test_fits_that_begin_with_other_levels_end_as_good(
    bench: ModelSet, rubbing: tuple[SampledRecording, ...]
) -> None:
    base = bench.compile_candidate(())
    units = disturbance_units(base, rubbing, {})
    starts = [begun(base, rubbing, level, factor) for level in LEVELS for factor in FACTORS]
    ends = [fit_with_noise(base, rubbing, one.noise_levels, {}, units).cost for one in starts]
    assert max(ends) - min(ends) < NEAR
    costs = [one.cost for one in starts]
    assert max(costs) - min(costs) > 10 * NEAR, "they would have been as good without"


def test_levels_stay_near_what_is_known_of_them(
    bench: ModelSet, rubbing: tuple[SampledRecording, ...]
) -> None:
    base = bench.compile_candidate(())
    units, known = disturbance_units(base, rubbing, {}), measured_noise_levels(rubbing, {})
    found = fit_noise_covariance(begun(base, rubbing, 1.0, 1.0), rubbing, units)
    for name, unit in units.items():
        assert MIN_LEVEL * unit <= found.noise_levels.process[name] * (1 + 1e-9)
        assert found.noise_levels.process[name] <= MAX_LEVEL * unit * (1 + 1e-9)
    ratios = found.noise_levels.outputs / known.outputs
    assert np.all(ratios <= MAX_NOISE_RATIO * (1 + 1e-9))
    assert np.all(ratios >= (1 - 1e-9) / MAX_NOISE_RATIO)


def test_a_tuned_fit_is_one_of_the_same_candidate(
    bench: ModelSet, rubbing: tuple[SampledRecording, ...]
) -> None:
    base = bench.compile_candidate(())
    found = fit_noise_covariance(
        begun(base, rubbing, 0.1, 1.0), rubbing, disturbance_units(base, rubbing, {})
    )
    assert found.candidate is base
    assert found.point.shared.shape == (len(base.names),)
    assert found.cost == found.prediction.negative_log_likelihood() + found.point.prior_cost(base)
    assert found.normal_equations is not None
    assert found.normal_equations.a.shape[1:] == (len(base.names), len(base.names))
    assert set(found.jacobian) == set(base.names)
    again = evaluate(base, rubbing, found.noise_levels, found.point, found.prediction)
    assert again.cost == pytest.approx(found.cost, abs=NEAR)


def test_what_feeds_nothing_back_keeps_its_noises(
    bench: ModelSet, rubbing: tuple[SampledRecording, ...]
) -> None:
    base = bench.compile_candidate(())
    given = begun(base, rubbing, 0.1, 1.0).noise_levels
    alone = iterate_broyden(
        base, rubbing, dataclasses.replace(given, process={}, is_output_error=True), {}
    )
    assert fit_noise_covariance(alone, rubbing, {}).noise_levels is alone.noise_levels


def test_noises_follow_the_coordinates_of_their_levels(bench: ModelSet) -> None:
    base = bench.compile_candidate(())
    drift, signal = base.disturbance_states[0], base.predictor.outputs[1]
    names = (PROCESS_NOISE_NAME.format(drift), OUTPUT_NOISE_NAME.format(signal), INPUT_NOISE_NAME)
    levels = tuple(FreeParameter(name, 2.0, 0.1, 50.0, 1.0, True) for name in names)
    wide = dataclasses.replace(base, noise_parameters=levels)
    z = np.zeros(len(wide.names))
    z[-3:] = np.log([1.5, 2.5, 0.5])
    blank = NoiseLevels(np.array([7.0, 8.0]), np.array([1.0, 4.0]), {drift: 9.0}, np.ones(2))
    found = noise_levels_at(wide, ParameterVector(z, z[None]), blank)
    assert found.process == {drift: pytest.approx(3.0)}
    assert list(found.outputs) == [7.0, pytest.approx(5.0)]
    assert list(found.inputs) == [pytest.approx(0.25), pytest.approx(1.0)]
    assert noise_levels_at(base, ParameterVector(z[:-3], z[None, :-3]), blank) is blank
