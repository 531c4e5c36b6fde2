"""What explains too little is refused; what answers to known inputs is no hidden one."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation_by_recording
from diagnosis.criterion.likelihood_gain import likelihood_gain
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import disturbance_units, fit_with_noise
from diagnosis.model.placed_effect import find_placements, read_effects
from diagnosis.selection.bound_score import bound_score, rejects_bounds
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.forward_selection import Selection
from diagnosis.unknown_input.dependence import input_dependence, standstill_dependence
from diagnosis.validation.adequacy import (
    SMALL_GAIN,
    has_autocorrelated_residuals,
    has_autocorrelated_residuals_in_most,
    has_stacked_effects,
    is_inadequate,
    lacks_simulation_improvement,
    reject_effects,
)
from tests.diagnosis.estimation.test_levenberg_marquardt import bench
from tests.diagnosis.localisation.test_ranking import fit_first_base, with_effect
from tests.language.spec_builders import ROOT

__all__ = ["bench"]
NEEDED = 50.0
"""Nats that a freedom has to gain at least."""
FEW, LOUDER = 1, 50.0
"""Recordings in which much is left, how much more than in the others."""
STRONG = {"T_c_w_em": 10.0}


@pytest.fixture(scope="module")
def rubbing(bench: ModelSet) -> ModelSet:
    """Return recordings of a driveline with dry friction at the motor."""
    return with_effect(bench, "coulomb_friction@w_em", STRONG)


def select_effect(
    bench: ModelSet, rubbing: ModelSet, effect: str, base: Estimate | None = None
) -> Selection:
    """Return a selection that has accepted an effect for what is recorded, over a base."""
    layers = {
        layer.id: layer for e in bench.effects for layer in find_placements(bench.document, e)
    }
    base = base or fit_first_base(rubbing)
    units = disturbance_units(base.candidate, rubbing.series, base.values(0))
    candidate = rubbing.compile_candidate((layers[effect],))
    model = fit_with_noise(candidate, rubbing.series, base.noise_levels, base.values(0), units)
    known = likelihood_gain(model, base, rubbing.series)
    tried = CandidateFit(layers[effect], known.penalised, model, known)
    return Selection(base, model, (tried,), (tried,), ())


@pytest.mark.parametrize(
    ("effect", "inadequate"), [("coulomb_friction@w_em", False), ("sensor_lag@w_em", True)]
)
def test_what_explains_less_than_it_leaves_is_inadequate(
    bench: ModelSet, rubbing: ModelSet, effect: str, inadequate: bool
) -> None:
    selection = select_effect(bench, rubbing, effect)
    assert is_inadequate(rubbing, selection, NEEDED) is inadequate


@pytest.mark.parametrize(
    ("effect", "does"), [("coulomb_friction@w_em", False), ("sensor_lag@w_em", True)]
)
def test_innovations_remember_what_is_still_missing(
    bench: ModelSet, rubbing: ModelSet, effect: str, does: bool
) -> None:
    base = fit_first_base(rubbing)
    quiet = dataclasses.replace(
        base, noise_levels=dataclasses.replace(base.noise_levels, process={})
    )
    alone = estimate_parameters(quiet.candidate, rubbing.series, quiet.noise_levels, quiet.point)
    selection = select_effect(bench, rubbing, effect, alone)
    start = selection.model.candidate, rubbing.series, quiet.noise_levels, selection.model.point
    selection = dataclasses.replace(selection, model=estimate_parameters(*start))
    assert has_autocorrelated_residuals(rubbing, selection) is does
    assert has_autocorrelated_residuals_in_most(rubbing, selection) is does


@pytest.mark.parametrize(("further", "piles"), [(0.3, False), (0.4, True)])
def test_two_that_gain_alike_at_one_place_are_neither(
    bench: ModelSet, rubbing: ModelSet, further: float, piles: bool
) -> None:
    selection = select_effect(bench, rubbing, "coulomb_friction@w_em")
    (first,) = selection.accepted
    assert first.likelihood_gain is not None
    less = dataclasses.replace(
        first.likelihood_gain, penalised=further * first.likelihood_gain.penalised
    )
    second = dataclasses.replace(first, likelihood_gain=less)
    assert has_stacked_effects(dataclasses.replace(selection, accepted=(first, second))) is piles
    assert not has_stacked_effects(selection)


def test_what_was_refused_is_not_likely(bench: ModelSet, rubbing: ModelSet) -> None:
    selection = select_effect(bench, rubbing, "coulomb_friction@w_em")
    assert selection.probabilities()["coulomb_friction@w_em"] > 0.9
    left = reject_effects(selection)
    assert left.model is selection.base
    assert left.accepted == ()
    assert left.probabilities()["other"] > 0.9


def test_an_unknown_that_comes_when_inputs_move_answers_to_them() -> None:
    time = np.arange(0.0, 10.0, 0.01)
    torque = np.where((time > 3.0) & (time < 6.0), 100.0, 0.0)
    series = SampledRecording("a", Fraction(1, 100), Fraction(0), torque[:, None], torque[:, None])
    answer = np.exp(-np.abs(time - 3.05) / 0.1) - np.exp(-np.abs(time - 6.05) / 0.1)
    other = np.exp(-np.abs(time - 1.5) / 0.1) + np.exp(-np.abs(time - 8.0) / 0.1)
    start = burn_in_samples(series)
    assert input_dependence([series], [answer[start:]]) > 0.8
    assert input_dependence([series], [other[start:]]) < 0.1
    assert input_dependence([series], [0.0 * answer[start:]]) == 0.0


def test_an_unknown_that_is_heard_near_rest_is_what_a_friction_lacks() -> None:
    time = np.arange(0.0, 10.0, 0.01)
    speed = 50.0 * np.cos(0.3 * np.pi * time)
    series = SampledRecording("a", Fraction(1, 100), Fraction(0), speed[:, None], speed[:, None])
    start = burn_in_samples(series)
    rubs = np.exp(-((speed / 4.0) ** 2)) * np.sign(np.gradient(speed))
    hit = np.exp(-np.abs(time - 3.3) / 0.1)
    assert standstill_dependence([series], [rubs[start:]]) > 0.9
    assert standstill_dependence([series], [hit[start:]]) < 0.3


def test_a_few_recordings_in_which_much_is_left_do_not_speak_for_all(
    bench: ModelSet, rubbing: ModelSet
) -> None:
    base = fit_first_base(rubbing)
    quiet = dataclasses.replace(
        base, noise_levels=dataclasses.replace(base.noise_levels, process={})
    )
    alone = estimate_parameters(quiet.candidate, rubbing.series, quiet.noise_levels, quiet.point)
    right = select_effect(bench, rubbing, "coulomb_friction@w_em", alone)
    before = alone.prediction.innovations
    assert len(before) > FEW
    for bad, mostly in ((FEW, False), (len(before), True)):
        outcome = dataclasses.replace(right.model.prediction)
        after = list(outcome.innovations)
        for k in np.argsort(-integrated_autocorrelation_by_recording(alone, rubbing.series))[:bad]:
            after[k] = LOUDER * before[k]
        vars(outcome)["stacked"] = np.concatenate(after)
        model = dataclasses.replace(right.model, prediction=outcome)
        selection = dataclasses.replace(right, model=model)
        assert has_autocorrelated_residuals(rubbing, selection)
        assert has_autocorrelated_residuals_in_most(rubbing, selection) is mostly


@pytest.mark.parametrize(("most", "strained"), [(100, False), (2, True)])
def test_what_is_pulled_out_of_its_range_is_something_else(
    bench: ModelSet, rubbing: ModelSet, most: int, strained: bool, tmp_path: Path
) -> None:
    """Friction of which no more than a fifth may act would gain much beyond that."""
    text = (ROOT / "spec" / "effects" / "coulomb_friction.yaml").read_text()
    limited = text.replace("range: [0, 100]", f"range: [0, {most}]")
    (tmp_path / "coulomb_friction.yaml").write_text(limited)
    own = dataclasses.replace(rubbing, effects=read_effects(tmp_path), _compiled={})
    selection = select_effect(own, own, "coulomb_friction@w_em")
    given = selection.model, selection.accepted
    assert rejects_bounds(*given) is strained
    assert (bound_score(*given) < 1.0) is not strained


@pytest.mark.parametrize(("part", "loud"), [(0.1, 0.95), (10.0, 0.95), (0.1, 0.5)])
def test_what_gained_little_has_to_show_in_simulations(
    bench: ModelSet, rubbing: ModelSet, part: float, loud: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A faint name falls where simulations stay nearly as they were; a strong one need not show."""
    selection = select_effect(bench, rubbing, "coulomb_friction@w_em")
    (first,) = selection.accepted
    assert first.likelihood_gain is not None
    assert not lacks_simulation_improvement(rubbing, selection)
    known = dataclasses.replace(first.likelihood_gain, penalised=part * SMALL_GAIN)
    faint = dataclasses.replace(
        selection, accepted=(dataclasses.replace(first, likelihood_gain=known),)
    )
    sizes = {
        id(selection.base): np.array([0.1, 0.2]),
        id(selection.model): loud * np.array([0.1, 0.2]),
    }
    monkeypatch.setattr("diagnosis.validation.adequacy.nrmse", lambda one, series: sizes[id(one)])
    assert lacks_simulation_improvement(rubbing, faint) is (part < 1.0 and loud > 0.85)
