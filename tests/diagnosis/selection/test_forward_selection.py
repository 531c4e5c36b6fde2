"""Forward selection: what is accepted, with which rivals, and when nothing or a pair is."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction

import numpy as np
import pytest

from diagnosis.criterion.explained_share import (
    FORM_SAMPLES,
    MAX_ORDINARY_ENERGY,
    NEGLIGIBLE_ENERGY,
    USUAL_FORM_ERROR,
)
from diagnosis.criterion.threshold import DEFAULT_THRESHOLD, Thresholds
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet, balance_disturbances
from diagnosis.model.placed_effect import PlacedEffect, effect_names, shipped_effects
from diagnosis.selection import forward_selection
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.comparison import Round, compare_candidates, effective_gain
from diagnosis.selection.forward_selection import (
    MAX_EFFECTS,
    Selection,
    _drop_needless,
    candidate_probabilities,
    select_effects,
    simulated_shares,
    tolerated_energy,
)
from diagnosis.selection.intersample import fit_base
from tests.diagnosis.rotor_project import EFFECTS, RATE, T_C, recordings
from tests.diagnosis.selection.fake_fits import (
    candidate_of,
    fit_of,
    places_of,
    rotor_model_set,
    round_of,
    tried,
)

FRICTION = "coulomb_friction@w"
COST = 5000.0
GAIN = 10.0 * DEFAULT_THRESHOLD


def rotor(T_c: float) -> ModelSet:
    """Two recordings of a rotor with dry friction, and a library of effects."""
    effects = [one for one in shipped_effects() if one.name in EFFECTS]
    blank = rotor_model_set(effects)
    series = [
        SampledRecording(f"{k}", Fraction(1, RATE), Fraction(0), rows[:, :1], rows[:, 1:])
        for k, rows in enumerate(map(np.ascontiguousarray, recordings(T_c)[:2]))
    ]
    drifts = balance_disturbances(blank.document, blank.automaton)
    return dataclasses.replace(blank, series=tuple(series), disturbances=drifts)


@pytest.fixture(scope="module")
def rubbing() -> Selection:
    """What is selected for a rotor with dry friction."""
    return select_effects(*fit_base(rotor(T_C)))


def test_the_effect_that_is_missing_is_accepted_alone(rubbing: Selection) -> None:
    (accepted,) = rubbing.accepted
    assert accepted.placed_effect.id == FRICTION
    assert accepted.gain > DEFAULT_THRESHOLD
    assert rubbing.share > 0.9
    assert accepted.share == pytest.approx(rubbing.share)
    assert rubbing.model is accepted.estimate
    assert rubbing.model.values(0)["T_c_w"] == pytest.approx(T_C, rel=0.05)
    assert not rubbing.first.is_ordinary
    assert rubbing.last.is_ordinary
    assert rubbing.last.base is rubbing.model


def test_its_probability_is_largest_and_all_sum_to_1(rubbing: Selection) -> None:
    probabilities = rubbing.probabilities()
    assert sum(probabilities.values()) == pytest.approx(1.0)
    assert max(probabilities, key=lambda name: probabilities[name]) == FRICTION
    assert probabilities.keys() == {
        "other",
        *(one.placed_effect.id for one in rubbing.first_round if one.is_fitted),
    }
    assert FRICTION not in [one.placed_effect.id for one in rubbing.rivals]


def test_a_comparison_orders_candidates_by_gain_and_bounds_shares(rubbing: Selection) -> None:
    first = rubbing.first
    gains = [one.gain for one in first.candidates]
    assert gains == sorted(gains, reverse=True)
    assert first.free.keys() == {"flow.w", "outputs.w"}
    assert first.correlation >= 1.0
    for one in first.candidates:
        assert one.share <= 1.0
        if one.estimate is not None:
            assert np.all(one.estimate.prediction.variances >= first.floor)
    best = first.candidates[0]
    assert best.estimate is not None
    assert best.gain == effective_gain(best.estimate, first.base, first.correlation, 2)
    assert first.sampled_energy > 0.0


def test_on_recordings_of_the_base_nothing_is_accepted() -> None:
    model_set, base = fit_base(rotor(0.0))
    found = select_effects(model_set, base)
    assert found.accepted == ()
    assert found.rivals == ()
    assert found.model is base
    assert found.first is found.last
    assert found.share == 0.0
    assert found.first.is_ordinary
    assert sum(found.probabilities().values()) == pytest.approx(1.0)


def test_candidates_are_not_fitted_where_little_is_left() -> None:
    model_set, base = fit_base(rotor(0.0))
    found = compare_candidates(
        model_set, base, model_set.applicable_effects(), least_energy=MAX_ORDINARY_ENERGY
    )
    assert found.candidates == ()
    assert found.free.keys() == {"flow.w", "outputs.w"}


# Rounds with given gains and shares

Rounds = Callable[[Estimate], Round]


@pytest.fixture
def places() -> list[PlacedEffect]:
    return places_of(rotor_model_set(), shipped_effects(), MAX_EFFECTS + 2)


def select(
    monkeypatch: pytest.MonkeyPatch,
    rounds: Sequence[Rounds],
    thresholds: Thresholds | None = None,
    simulated: Sequence[float] = (1.0, 1.0, 1.0),
) -> tuple[Selection, list[str]]:
    """The selection from one comparison after the other; asking for more of them is an error.

    `simulated` are the shares of the error of free simulation of candidates that explain enough.
    """
    given: Iterator[Rounds] = iter(rounds)
    lines: list[str] = []

    def compare(_: ModelSet, base: Estimate, __: Iterable[PlacedEffect], *___: object) -> Round:
        return next(given)(base)

    def share(_: ModelSet, __: Estimate, candidates: Sequence[CandidateFit]) -> list[float]:
        return list(simulated[: len(candidates)])

    monkeypatch.setattr(forward_selection, "compare_candidates", compare)
    monkeypatch.setattr(forward_selection, "simulated_shares", share)
    monkeypatch.setattr(forward_selection, "_drop_needless", lambda _, selected, *__: selected)
    found = select_effects(
        rotor_model_set(), fit_of((), COST, [11.0]), thresholds or Thresholds(), lines.append
    )
    assert next(given, None) is None
    return found, lines


def beside(*candidates: tuple[PlacedEffect, float, float], total: float = 0.0) -> Rounds:
    """A comparison with candidates of given gains and shares."""
    return lambda base: round_of(base, [tried(base, *one) for one in candidates], total=total)


def test_an_effect_below_its_threshold_is_not_accepted(
    monkeypatch: pytest.MonkeyPatch, places: list[PlacedEffect]
) -> None:
    negligible = round_of(fit_of((), COST, [11.0]), []).negligible_gain
    gain = DEFAULT_THRESHOLD + negligible
    below = beside((places[0], gain - 0.1, 0.99))
    assert select(monkeypatch, [below])[0].accepted == ()
    above = beside((places[0], gain + 0.1, 0.99))
    found, lines = select(monkeypatch, [above, beside()])
    assert [one.placed_effect for one in found.accepted] == [places[0]]
    assert lines == [f"accepted {places[0].id}: {gain + 0.1:.0f} nats, 99%"]
    group = Thresholds({places[0].effect.name: DEFAULT_THRESHOLD - 1.0})
    found, _ = select(monkeypatch, [below, beside()], group)
    assert [one.placed_effect for one in found.accepted] == [places[0]]


def test_the_negligible_gain_is_that_of_a_small_energy_in_all_independent_samples() -> None:
    round_ = dataclasses.replace(round_of(fit_of((), COST, [11.0, 4.0]), []), correlation=2.0)
    samples = round_.base.prediction.counts / 2.0
    gain = float(np.sum(samples / 2.0 * np.log1p(NEGLIGIBLE_ENERGY)))
    assert round_.negligible_gain == pytest.approx(gain, rel=0.01)


def test_an_effect_that_explains_little_is_not_accepted(
    monkeypatch: pytest.MonkeyPatch, places: list[PlacedEffect]
) -> None:
    """A second effect is tried beside it, in vain."""
    little = 0.4
    rounds = [beside((places[0], GAIN, little)), beside((places[1], GAIN, little))]
    found, lines = select(monkeypatch, rounds)
    assert found.accepted == ()
    assert found.model is found.base
    assert found.last is found.first
    assert lines[-1] == f"not accepted {places[0].id}: it explains 40%"


def test_two_effects_that_explain_most_together_are_both_accepted(
    monkeypatch: pytest.MonkeyPatch, places: list[PlacedEffect]
) -> None:
    rounds = [beside((places[0], GAIN, 0.5)), beside((places[1], GAIN, 0.9)), beside()]
    found, _ = select(monkeypatch, rounds)
    assert [one.placed_effect for one in found.accepted] == places[:2]
    assert found.share == pytest.approx(0.9)
    assert found.rivals == ()


def test_at_most_so_many_effects_are_accepted(
    monkeypatch: pytest.MonkeyPatch, places: list[PlacedEffect]
) -> None:
    rounds = [beside((one, GAIN, 0.9)) for one in places[: MAX_EFFECTS + 1]]
    found, _ = select(monkeypatch, rounds)
    assert [one.placed_effect for one in found.accepted] == places[:MAX_EFFECTS]


@pytest.mark.parametrize(
    ("shares", "simulated", "taken"),
    [
        ((0.95, 0.95), (1.0, 1.0), 0),  # the largest gain
        ((0.8, 0.95), (1.0, 1.0), 1),  # the other one is more probable
        ((0.5, 0.95), (1.0,), 1),  # the first one explains too little
        ((0.95, 0.95), (0.5, 0.9), 1),  # it does not simulate well
        ((0.95, 0.95), (0.5, 0.6), 0),  # none does
    ],
)
def test_the_best_candidate_that_explains_enough_is_taken(
    shares: tuple[float, float],
    simulated: tuple[float, ...],
    taken: int,
    monkeypatch: pytest.MonkeyPatch,
    places: list[PlacedEffect],
) -> None:
    first = beside((places[0], GAIN + 1.0, shares[0]), (places[1], GAIN, shares[1]))
    found, _ = select(monkeypatch, [first, beside()], simulated=simulated)
    assert [one.placed_effect for one in found.accepted] == [places[taken]]


@pytest.mark.parametrize(
    ("errors", "expected"),
    [
        (((3.0, 1.0), (1.0, 1.0), (2.0, 1.0)), [1.0, 0.625]),
        (((1.5, 1.0), (1.0, 1.0), (2.0, 1.0)), [1.0, 1.0]),  # the base leaves an ordinary error
        (((3.0, 1.0), (math.inf, math.inf), (1.0, 1.0)), [-math.inf, 1.0]),
        (((math.inf, math.inf), (math.inf, math.inf), (1.0, 1.0)), [-math.inf, 1.0]),
        (((math.inf, math.inf),) * 3, [1.0, 1.0]),
    ],
)
def test_shares_of_simulation_errors_are_relative_to_the_best_simulation(
    errors: tuple[tuple[float, float], ...],
    expected: list[float],
    monkeypatch: pytest.MonkeyPatch,
    places: list[PlacedEffect],
) -> None:
    base = fit_of((), COST, [1.0, 1.0])
    candidates = [tried(base, one, GAIN, 0.9) for one in places[:2]]
    models = [base, *(one.estimate for one in candidates)]
    sizes = {id(model): np.array(error) for model, error in zip(models, errors, strict=True)}
    monkeypatch.setattr(forward_selection, "complete_nrmse", lambda model, _: sizes[id(model)])
    assert simulated_shares(rotor_model_set(), base, candidates) == pytest.approx(expected)


def test_rivals_are_the_candidates_of_the_smallest_probable_set(
    monkeypatch: pytest.MonkeyPatch, places: list[PlacedEffect]
) -> None:
    """What explains as much is a rival, what explains far less is none."""
    first = beside(
        (places[0], GAIN, 0.97), (places[1], GAIN - 1.0, 0.96), (places[2], 9.0, 0.2), total=1e6
    )
    found, _ = select(monkeypatch, [first, beside()])
    assert [one.placed_effect for one in found.rivals] == [places[1]]
    probabilities = found.probabilities()
    assert probabilities[places[1].id] > 0.2
    assert probabilities[places[2].id] < 1e-3
    alone, _ = select(monkeypatch, [beside((places[0], GAIN, 0.97), total=1e6), beside()])
    assert alone.rivals == ()


def test_an_unfitted_candidate_has_no_probability(places: list[PlacedEffect]) -> None:
    base = fit_of((), COST, [11.0])
    candidates = [tried(base, places[0], GAIN, 0.9), tried(base, places[1], 1.0, 0.0, False)]
    probabilities = candidate_probabilities(round_of(base, candidates))
    assert probabilities.keys() == {places[0].id, "other"}
    assert sum(probabilities.values()) == pytest.approx(1.0)
    assert candidate_probabilities(round_of(base, [])) == {"other": 1.0}


def test_of_two_effects_that_explain_the_same_the_one_with_fewer_parameters_is_more_probable(
    places: list[PlacedEffect],
) -> None:
    base = fit_of((), COST, [11.0])
    one, other = next(pair for pair in [places[:2], places[2:4]] if len(effect_names(pair[1])) > 1)
    simple, long = (tried(base, effect, GAIN, 0.9) for effect in (one, other))
    long = dataclasses.replace(long, estimate=fit_of([other], long.cost, [2.0], own=2))
    probabilities = candidate_probabilities(round_of(base, [long, simple]))
    ratio = probabilities[one.id] / probabilities[other.id]
    assert ratio == pytest.approx(np.sqrt(FORM_SAMPLES))


def test_the_tolerated_energy_is_the_error_of_the_form_or_an_ordinary_one() -> None:
    base = fit_of((), COST)
    assert tolerated_energy(round_of(base, (), energy=1.0)) == pytest.approx(USUAL_FORM_ERROR**2)
    assert tolerated_energy(round_of(base, (), energy=1e4)) == MAX_ORDINARY_ENERGY


def test_a_gain_is_reduced_by_the_autocorrelation_and_the_price_of_parameters(
    places: list[PlacedEffect],
) -> None:
    base, model = fit_of((), COST), fit_of(places[:2], COST - 100.0)
    price = 2 / 2 * np.log(1000.0 / 4.0)
    assert effective_gain(model, base, 4.0, 1) == pytest.approx(100.0 / 4.0 - price)
    assert effective_gain(base, base, 4.0, 1) == 0.0


@pytest.mark.parametrize(("loss", "kept"), [(5.0, 1), (500.0, 2)])
def test_an_effect_that_the_others_make_needless_is_dropped(
    monkeypatch: pytest.MonkeyPatch, places: list[PlacedEffect], loss: float, kept: int
) -> None:
    """A model with two effects, and the fit of the second one alone."""
    base, both = fit_of((), COST, [11.0]), fit_of(places[:2], COST - 500.0, [1.0])
    pair = (tried(base, places[0], 30.0, 0.3), tried(base, places[1], 470.0, 0.9))
    first = round_of(base, pair)
    found = Selection(base, both, pair, first, first, share=0.9)
    rows = np.zeros((1000, 1))
    recording = SampledRecording("a", Fraction(1, RATE), Fraction(0), rows, rows)
    model_set = dataclasses.replace(rotor_model_set(), series=(recording,))
    monkeypatch.setattr(ModelSet, "compile_candidate", lambda _, some: candidate_of(some))
    monkeypatch.setattr(ModelSet, "load_or_fit", lambda *given: given[-1]())
    monkeypatch.setattr(
        forward_selection,
        "estimate_parameters",
        lambda candidate, *_: fit_of(candidate.placed_effects, both.cost + loss, [1.0]),
    )
    monkeypatch.setattr(forward_selection, "with_best_gain_scale", lambda one, _: one)
    lines: list[str] = []
    left = _drop_needless(model_set, found, Thresholds(), lines.append)
    assert [one.placed_effect for one in left.accepted] == places[2 - kept : 2]
    assert len(lines) == 2 - kept
    assert left.model.cost == both.cost + (loss if kept == 1 else 0.0)
    alone = next(one for one in left.first.candidates if one.placed_effect is places[1])
    assert (alone.estimate is left.model) is (kept == 1)
