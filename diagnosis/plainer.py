"""Plainer: an effect that may as well be a plainer one gives way to that one.

Friction that rises at rest is dry friction where its rise is none. With more numbers it explains a
few nats more of what is left of any form.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Sequence

from diagnosis.estimate import Estimate
from diagnosis.evidence import integrated_autocorrelation
from diagnosis.layers import PlacedEffect
from diagnosis.naming import covariance_of, effect_names, place_path
from diagnosis.search import CandidateFit
from diagnosis.series import SampledRecording
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
    """Yield the candidates that one which may be plainer may be: at its place, with fewer numbers,
    that gained nearly as much.
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
    """Return the candidate that others gave way to, and all with it, best first: it leads those at
    its place.
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
    """Tell whether an effect that a model holds may as well be a plainer one."""
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
    """Tell whether an effect is a plainer one at some value of one of its parameters."""
    known = placed_effect.effect.body.get("parameters")
    entries = known if isinstance(known, MappingNode) else ()
    return any(isinstance(one.node, MappingNode) and "plain" in one.node.entries for one in entries)


def _restricted_coordinates(model: Estimate, placed_effect: PlacedEffect) -> dict[int, float]:
    """Return the coordinates at which an effect is a plainer one, by their places."""
    brought = effect_names(placed_effect)
    return {
        k: one.coordinate(one.plain)
        for k, one in enumerate(model.candidate.free_parameters)
        if one.name in brought and one.plain is not None and not one.per_recording
    }


def _parameter_count(candidate_fit: CandidateFit) -> int:
    return len(effect_names(candidate_fit.placed_effect))
