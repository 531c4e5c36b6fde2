"""Forward selection: effects are accepted one after the other, then each is checked again."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from diagnosis.criterion.likelihood_gain import likelihood_gain
from diagnosis.criterion.recording_support import supported_gain
from diagnosis.criterion.threshold import DEFAULT_THRESHOLD, DEFAULT_THRESHOLDS, Thresholds
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import fit_with_noise
from diagnosis.model.parameter_vector import extend_vector
from diagnosis.model.placed_effect import PlacedEffect, has_parameters
from diagnosis.selection.backward_elimination import (
    AcceptedEffects,
    eliminate_backward,
    update_first_round,
)
from diagnosis.selection.bound_score import prefer_interior, rejects_bounds
from diagnosis.selection.candidate_search import CandidateFit, LogCallback, search_candidates
from diagnosis.selection.confusion_set import confusion_set
from diagnosis.selection.exchange import exchange_effects
from diagnosis.selection.nested_form import choose_form, promote_restricted
from diagnosis.selection.stopping import meets_stopping_rule

MIN_GAIN_RATIO = 0.002
"""A further effect gains at least this part of what the one before it gained: a strong effect is
never described so well that nothing small is left beside it."""
SCREENING_FRACTION, SCREENING_FRACTION_BESIDE = 0.25, 0.5
"""Part of what it needs to gain that a candidate must promise to be fitted, alone and beside what
was accepted, where little is misjudged."""
MAX_THIRD_CANDIDATES = 7
"""Candidates that are looked at again beside two accepted ones, the best of the round before.
Beside one all are: what one hid may show itself."""
MAX_RESCREENED = 15
"""Candidates that are looked at again where the model itself is found to fit better."""
MUCH_FRACTION = 0.1
"""Part of what the best candidate gained: a model that gains more has them looked for anew, and
candidates that gained less are not tried in another way."""
MIN_REFIT_GAIN = 10.0
"""Nats by which a model must fit better for its candidates to be looked at again."""
MAX_EFFECTS = 3
NONE_MARGIN = 5.0
"""Nats by which "none of these" trails the threshold in the probabilities."""


@dataclass(frozen=True)
class Selection:
    """The accepted effects: `model` extends `base`, `first_round` are all candidates, best first.

    `rivals` are confusable with the first accepted effect. `other` is the score [nats] of none of
    the candidates, or of a formula.
    """

    base: Estimate = field(repr=False)
    model: Estimate = field(repr=False)
    accepted: tuple[CandidateFit, ...]
    first_round: tuple[CandidateFit, ...]
    rivals: tuple[CandidateFit, ...]
    other: float = 2.0 * DEFAULT_THRESHOLD - NONE_MARGIN

    @property
    def has_unknown_input(self) -> bool:
        """Whether an unknown input, which has no parameters, was accepted."""
        return any(not has_parameters(tried.placed_effect) for tried in self.accepted)

    def probabilities(self) -> dict[str, float]:
        """Return the probability of each fitted candidate of the first round by id, and of `other`.

        The weights are exp(score / 2).
        """
        totals = {t.placed_effect.id: t.score for t in self.first_round if t.likelihood_gain}
        totals["other"] = self.other
        most = max(totals.values())
        weights = {name: float(np.exp(0.5 * (total - most))) for name, total in totals.items()}
        whole = sum(weights.values())
        return {name: weight / whole for name, weight in weights.items()}


@dataclass(frozen=True)
class _SelectionSettings:
    """What a search for effects is given, the same in each round."""

    model_set: ModelSet
    units: Mapping[str, float]
    thresholds: Thresholds
    cross_validated_fraction: float
    screening_fraction: float
    log: LogCallback


@dataclass(frozen=True)
class _SelectionState:
    """What the rounds so far have found, the `layers` to look at next and what one must gain."""

    base: Estimate
    model: Estimate
    accepted: tuple[CandidateFit, ...] = ()
    first_round: tuple[CandidateFit, ...] = ()
    placed_effects: tuple[PlacedEffect, ...] = ()
    min_gain: float = 0.0


def select_effects(
    model_set: ModelSet,
    base: Estimate,
    units: Mapping[str, float],
    thresholds: Thresholds = DEFAULT_THRESHOLDS,
    log: LogCallback = lambda text: None,
    cross_validated_fraction: float = 1.0,
    earlier: Sequence[CandidateFit] = (),
    screening_fraction: float = SCREENING_FRACTION,
) -> Selection:
    """Return the effects that the training recordings support, at most three.

    `cross_validated_fraction` is the fraction of the threshold that the cross-validated gain needs,
    and `screening_fraction` the one that the screening gain needs. If `earlier` candidates of
    another inter-sample behaviour are given, only the best of them are tried.
    """
    asked = _SelectionSettings(
        model_set, units, thresholds, cross_validated_fraction, screening_fraction, log
    )
    found = _SelectionState(
        base,
        base,
        placed_effects=tuple(_near_best_effects(earlier) or model_set.applicable_effects()),
    )
    goes_on = True
    while goes_on and len(found.accepted) < MAX_EFFECTS:
        found, goes_on = _forward_step(asked, found)
    last = AcceptedEffects(found.base, found.model, found.accepted)
    kept = eliminate_backward(model_set, last, units, thresholds, log)
    first = tuple(update_first_round(found.first_round, found.accepted, kept.effects))
    return Selection(
        found.base, kept.model, kept.effects, first, confusion_set(first, kept.effects)
    )


def _forward_step(
    settings: _SelectionSettings, state: _SelectionState
) -> tuple[_SelectionState, bool]:
    """Return what is found with one effect more, and whether yet another may be looked for."""
    model_set, units, tell = settings.model_set, settings.units, settings.log
    if state.accepted and meets_stopping_rule(
        model_set, state.model, units, settings.thresholds.default
    ):
        tell("free drifts find nothing more to do: no further effect is looked for")
        return state, False
    state, tried = _search_step(settings, state)
    enough = _first_above_threshold(
        tried, state.min_gain, settings.thresholds, settings.cross_validated_fraction
    )
    if enough is None:
        return state, False
    best, led = _choose_best_form(model_set, state.model, units, enough, tried)
    state = state if state.accepted else dataclasses.replace(state, first_round=tuple(led))
    if best.estimate is None or best.likelihood_gain is None:
        return state, False
    gained = supported_gain(best.likelihood_gain, settings.cross_validated_fraction)
    tell(f"accepted {best.placed_effect.id}: {gained:.0f} nats")
    before = [*state.accepted, best]
    together, there = exchange_effects(
        model_set, best.estimate, before, state.first_round, units, tell
    )
    if len(together) == MAX_EFFECTS and _strains_bounds(
        together, there, state.accepted, state.model
    ):
        tell(f"{best.placed_effect.id} pulls effects out of their ranges: it is not taken")
        return state, False
    first = tuple(update_first_round(state.first_round, before, together))
    placed_effects = (
        tuple(model_set.applicable_effects())
        if len(together) == 1
        else _promising_effects(tried, MAX_THIRD_CANDIDATES)
    )
    return _SelectionState(
        state.base, there, tuple(together), first, placed_effects, MIN_GAIN_RATIO * gained
    ), True


def _search_step(
    settings: _SelectionSettings, state: _SelectionState
) -> tuple[_SelectionState, list[CandidateFit]]:
    """Return candidates beside the model that was found, best first, and it or a better fit."""
    worth = (SCREENING_FRACTION_BESIDE if state.accepted else settings.screening_fraction) * max(
        state.min_gain, settings.thresholds.default
    )
    model, model_set, units, tell = state.model, settings.model_set, settings.units, settings.log
    tried = search_candidates(
        model_set, model, units, state.placed_effects, tell, worth, state.first_round
    )
    better, tried = rescreen_after_refit(model_set, model, units, tried, tell, worth)
    model = model if better is None else better
    if state.accepted:
        return dataclasses.replace(state, model=model), tried
    return dataclasses.replace(state, base=model, model=model, first_round=tuple(tried)), tried


def _choose_best_form(
    model_set: ModelSet,
    model: Estimate,
    units: Mapping[str, float],
    best: CandidateFit,
    candidate_fits: list[CandidateFit],
) -> tuple[CandidateFit, list[CandidateFit]]:
    """Return what the best candidate gives way to, or that one, and all with it, best first."""
    first = prefer_interior(
        choose_form(model_set, model, units, best, candidate_fits), candidate_fits
    )
    return (best, candidate_fits) if first is best else promote_restricted(first, candidate_fits)


def _strains_bounds(
    effects: Sequence[CandidateFit],
    model_with_effects: Estimate,
    accepted: Sequence[CandidateFit],
    model: Estimate,
) -> bool:
    """Tell whether effects are pulled out of their ranges by the last of them:
    it imitates, the others did not.
    """
    return rejects_bounds(model_with_effects, effects) and not rejects_bounds(model, accepted)


def _first_above_threshold(
    candidate_fits: Sequence[CandidateFit],
    min_gain: float,
    thresholds: Thresholds,
    cross_validated_fraction: float,
) -> CandidateFit | None:
    """Return the best candidate that gains what is needed."""
    return next(
        (
            t
            for t in candidate_fits
            if t.likelihood_gain
            and supported_gain(t.likelihood_gain, cross_validated_fraction)
            > max(min_gain, thresholds.threshold_of(t.placed_effect))
        ),
        None,
    )


def _promising_effects(
    candidate_fits: Sequence[CandidateFit], max_count: int
) -> tuple[PlacedEffect, ...]:
    """Return the layers that are looked at again beside what was accepted."""
    return tuple(
        {
            t.placed_effect.id: t.placed_effect for t in candidate_fits if t.screening_gain > 0.0
        }.values()
    )[:max_count]


def _near_best_effects(earlier: Sequence[CandidateFit]) -> list[PlacedEffect]:
    """Return the layers of the candidates that gained not much less than the best of them."""
    gains = {
        t.placed_effect.id: (t.likelihood_gain.total, t.placed_effect)
        for t in earlier
        if t.likelihood_gain
    }
    best = max((total for total, _ in gains.values()), default=0.0)
    return [
        placed_effect
        for total, placed_effect in gains.values()
        if total > 0.0 and total > MUCH_FRACTION * best
    ]


def rescreen_after_refit(
    model_set: ModelSet,
    model: Estimate,
    units: Mapping[str, float],
    candidate_fits: list[CandidateFit],
    log: LogCallback = lambda text: None,
    min_gain: float = 0.0,
) -> tuple[Estimate | None, list[CandidateFit]]:
    """Return a better fit of the base if there is one (else None), and the candidates beside it.

    The candidates are screened again unless their gains are clearly larger than the improvement,
    or, beside accepted effects, too small.
    """
    better = _refit_base(model_set, model, units, candidate_fits)
    if better is None:
        return None, candidate_fits
    log(f"the model itself fits better: {better.cost:.0f} nats; candidates again")
    gained = model.cost - better.cost
    if _largest_gain(candidate_fits) * MUCH_FRACTION > gained or (
        model.candidate.placed_effects and _largest_gain(candidate_fits) < gained + min_gain
    ):
        return better, _update_gains(model_set, better, candidate_fits)
    return better, _rescreen(model_set, better, units, candidate_fits, log)


def _refit_base(
    model_set: ModelSet,
    model: Estimate,
    units: Mapping[str, float],
    candidate_fits: list[CandidateFit],
) -> Estimate | None:
    """Return the model from where the best candidate left its parameters, if that is better.

    A model in a local minimum makes every candidate look good.
    """
    best = next(iter(candidate_fits), None)
    if best is None or best.estimate is None:
        return None
    start = extend_vector(model.candidate, best.estimate.candidate, best.estimate.point, {})
    given = (best.estimate.noise_levels, start, units)
    make = partial(fit_with_noise, model.candidate, model_set.series, *given, nearby=best.estimate)
    again = model_set.load_or_fit("settled", model.candidate, (*given, best.estimate.gains), make)
    return again if again.cost < model.cost - MIN_REFIT_GAIN else None


def _rescreen(
    model_set: ModelSet,
    model: Estimate,
    units: Mapping[str, float],
    candidate_fits: list[CandidateFit],
    log: LogCallback,
) -> list[CandidateFit]:
    """Return candidates beside a model that was found to fit better, looked for anew."""
    known = {t.placed_effect.id: t for t in candidate_fits}
    promising = [other.placed_effect for other in candidate_fits if other.screening_gain > 0.0]
    for new in search_candidates(model_set, model, units, promising[:MAX_RESCREENED], log):
        old = known[new.placed_effect.id].estimate
        if new.estimate and (old is None or new.estimate.cost < old.cost):
            known[new.placed_effect.id] = new
    return _update_gains(model_set, model, list(known.values()))


def _update_gains(
    model_set: ModelSet, model: Estimate, candidate_fits: Sequence[CandidateFit]
) -> list[CandidateFit]:
    """Return candidates with what they gain over a model, best first."""
    again = [
        dataclasses.replace(t, likelihood_gain=likelihood_gain(t.estimate, model, model_set.series))
        if t.estimate
        else t
        for t in candidate_fits
    ]
    return sorted(again, key=lambda one: -one.score)


def _largest_gain(candidate_fits: Sequence[CandidateFit]) -> float:
    return max(
        (t.likelihood_gain.penalised for t in candidate_fits if t.likelihood_gain), default=0.0
    )
