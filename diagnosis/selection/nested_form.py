"""Nested forms: the choice between an effect and a restricted form with fewer parameters.

A complexity penalty does not decide this, because a parameter that recordings hardly determine
costs as much as others. The choice is a likelihood-ratio test.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.criterion.likelihood_gain import likelihood_gain
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.covariance import covariance_of
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import fit_with_noise
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, extend_vector
from diagnosis.model.placed_effect import PlacedEffect, effect_names, place_path
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.screening import start_values
from language.text.document import MappingNode

MIN_RESTRICTION_STATISTIC = 5.0
"""Nats that the recordings must tell an effect from what it is where it is a plainer one."""

MIN_RESTRICTED_FRACTION = 0.7
"""Part of what it gained that the plainer one gains at least."""

RESTRICTED_LEAD = 4.0
"""Nats of score by which the plainer one then leads: odds of seven to one."""


def restricted_candidates(
    best: CandidateFit, candidate_fits: Sequence[CandidateFit]
) -> Iterator[CandidateFit]:
    """Yield fitted candidates at the same place with fewer parameters and nearly the same gain.

    There are none if the best candidate has no restricted form.
    """
    if (
        best.estimate is None
        or best.likelihood_gain is None
        or not has_restricted_form(best.placed_effect)
    ):
        return
    for other in candidate_fits:
        if other.likelihood_gain is None or place_path(other.placed_effect) != place_path(
            best.placed_effect
        ):
            continue
        least = MIN_RESTRICTED_FRACTION * best.likelihood_gain.penalised
        if (
            _parameter_count(other) < _parameter_count(best)
            and other.likelihood_gain.penalised > least
        ):
            yield other


def promote_restricted(
    first: CandidateFit, candidate_fits: Sequence[CandidateFit]
) -> tuple[CandidateFit, list[CandidateFit]]:
    """Return a candidate with a lead over others at its place, and all candidates,
    best score first.
    """
    path = place_path(first.placed_effect)
    others = [t for t in candidate_fits if t.placed_effect.id != first.placed_effect.id]
    beside = [t.score for t in others if place_path(t.placed_effect) == path]
    behind = max(beside, default=-math.inf) + RESTRICTED_LEAD - first.score
    lead = dataclasses.replace(first, lead=max(0.0, behind))
    return lead, sorted([lead, *others], key=lambda one: -one.score)


def accepts_restriction(
    model: Estimate, placed_effect: PlacedEffect, series: Sequence[SampledRecording]
) -> bool:
    """Return whether recordings do not reject a
    restricted value of an effect's parameter (Wald test).
    """
    if model.normal_equations is None:
        return False
    covariance, names = covariance_of(model)
    shrink = 1.0 / integrated_autocorrelation(model, series)
    for k, plain in _restricted_coordinates(model, placed_effect).items():
        apart = float(model.point.shared[k]) - plain
        place = names.index(model.candidate.names[k])
        if shrink * apart**2 / (2.0 * covariance[place, place]) < MIN_RESTRICTION_STATISTIC:
            return True
    return False


def has_restricted_form(placed_effect: PlacedEffect) -> bool:
    """Return whether an effect declares a `plain` value of a parameter,
    at which it is a simpler one.
    """
    known = placed_effect.effect.body.get("parameters")
    entries = known if isinstance(known, MappingNode) else ()
    return any(isinstance(one.node, MappingNode) and "plain" in one.node.entries for one in entries)


def _restricted_coordinates(model: Estimate, placed_effect: PlacedEffect) -> dict[int, float]:
    """Return the coordinates at which an effect is a plainer one, by their places."""
    brought = effect_names(placed_effect)
    return {
        k: one.coordinate(one.restricted_value)
        for k, one in enumerate(model.candidate.free_parameters)
        if one.name in brought and one.restricted_value is not None and not one.per_recording
    }


def _parameter_count(candidate_fit: CandidateFit) -> int:
    return len(effect_names(candidate_fit.placed_effect))


MIN_FORM_GAIN = 4.0
"""Nats by which the fuller form must fit better, no price counted: where the plainer one is right
it does by 2.6 at most, where it is not by 5.2 at least (63 dry frictions of two studies)."""


def choose_form(
    model_set: ModelSet,
    base: Estimate,
    units: Mapping[str, float],
    best: CandidateFit,
    candidate_fits: Sequence[CandidateFit],
) -> CandidateFit:
    """Return the best candidate, or its nested form if the likelihood-ratio test prefers that.

    Both are fitted from the optimum of the other one, so that the comparison is not one of local
    optima.
    """
    for other in candidate_fits:
        if best.estimate is None or not _is_nested_with(other, best):
            continue
        new = _fit_from(model_set, base, units, other, best.estimate)
        if new is not None and new.estimate is not None:
            old = _fit_from(model_set, base, units, best, new.estimate) or best
            plain, full = sorted((old, new), key=_parameter_count)
            return full if _rejects_restriction(model_set, plain, full) else plain
    return best


def _is_nested_with(other: CandidateFit, best: CandidateFit) -> bool:
    """Tell whether a candidate may be another form of the best one: at its place, with more or
    fewer numbers, some of them the same; one that was fitted gained nearly as much.
    """
    plain, full = sorted((other, best), key=_parameter_count)
    is_beside = place_path(other.placed_effect) == place_path(best.placed_effect)
    if (
        not is_beside
        or _parameter_count(plain) == _parameter_count(full)
        or not has_restricted_form(full.placed_effect)
    ):
        return False
    if not effect_names(plain.placed_effect).keys() & effect_names(full.placed_effect).keys():
        return False
    if other.likelihood_gain is None or best.likelihood_gain is None:
        return True
    return (
        other.likelihood_gain.penalised > MIN_RESTRICTED_FRACTION * best.likelihood_gain.penalised
    )


def _fit_from(
    model_set: ModelSet,
    base: Estimate,
    units: Mapping[str, float],
    candidate_fit: CandidateFit,
    neighbour: Estimate,
) -> CandidateFit | None:
    """Return a candidate fitted from where another one is as well, what that does not have from
    where it was and from each of its starts; None where it cannot be laid on the base.
    """
    candidate = _candidate_of(model_set, base, candidate_fit.placed_effect, candidate_fit.estimate)
    if candidate is None:
        return None
    own: list[Mapping[str, float] | ParameterVector] = [
        *start_values(candidate, neighbour.values(0))
    ]
    own += [candidate_fit.estimate.point] if candidate_fit.estimate else []
    found = [candidate_fit.estimate] if candidate_fit.estimate else []
    for start in (
        extend_vector(candidate, neighbour.candidate, neighbour.point, one) for one in own
    ):
        given = (neighbour.noise_levels, start, units)
        make = partial(fit_with_noise, candidate, model_set.series, *given, nearby=neighbour)
        found.append(model_set.load_or_fit("settled", candidate, (*given, neighbour.gains), make))
    model = min(found, key=lambda one: one.cost)
    if model is candidate_fit.estimate:
        return candidate_fit
    return dataclasses.replace(
        candidate_fit,
        estimate=model,
        likelihood_gain=likelihood_gain(model, base, model_set.series),
    )


def _candidate_of(
    model_set: ModelSet, base: Estimate, placed_effect: PlacedEffect, estimate: Estimate | None
) -> Candidate | None:
    return (
        estimate.candidate
        if estimate
        else model_set.try_compile([*base.candidate.placed_effects, placed_effect])
    )


def _rejects_restriction(
    model_set: ModelSet, restricted: CandidateFit, unrestricted: CandidateFit
) -> bool:
    """Tell whether recordings show the fuller form of an effect."""
    assert restricted.estimate is not None
    assert unrestricted.estimate is not None
    apart = restricted.estimate.cost - unrestricted.estimate.cost
    return (
        apart / integrated_autocorrelation(unrestricted.estimate, model_set.series) > MIN_FORM_GAIN
    )
