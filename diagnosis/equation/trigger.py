"""Doubt: when a formula is tried beside the effects of the library, and when it is the verdict.

The nearest effect of a library that lacks the true one gains a great deal: what it leaves over
tells that it is not the right one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from diagnosis.criterion.recording_support import ranking_gain
from diagnosis.equation.discovery import DiscoveredEquation
from diagnosis.equation.forward_regression import rank_terms
from diagnosis.equation.regression_problem import regression_at
from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.cause import balance_of
from diagnosis.model.placed_effect import place_path
from diagnosis.result.verdict import DecisionOutcome
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.forward_selection import Selection
from language.text.diagnostic import SpecError

UNEXPLAINED_FACTOR = 2.5
"""Times the threshold that the freedom of a place gains where a formula is tried."""
REMAINDER_FACTOR = 2.0
"""Times the threshold that a term gains where an accepted effect leaves something over."""
REMAINDER_FRACTION = 0.3
"""And this part of what the effect gained: a strong one is never described quite well."""
LARGE_REMAINDER_FRACTION = 0.8
"""Part of what accepted effects gained that a term at their place gains beside them, from which on
they are something else: the right ones left a third of it at most."""
MAX_DISTURBANCE_LEVEL = 0.5
"""Units of its drifts below which a model with what was accepted needs none."""
EQUATION_GAIN_FACTOR = 1.5
"""A formula is the verdict where it gains so many times as much as what was accepted."""


def triggers_discovery(
    outcome: DecisionOutcome,
    selection: Selection,
    unexplained: float,
    remaining_gain: float,
    threshold: float,
) -> bool:
    """Tell whether a formula might say more than the verdict does.

    `unexplained` is what the base leaves unexplained [nats], `remaining_gain` what accepted effects leave.
    """
    if outcome in ("unknown", "ambiguous"):
        return True
    if outcome == "nothing_missing":
        return unexplained > UNEXPLAINED_FACTOR * threshold
    return remaining_gain > max(
        REMAINDER_FACTOR * threshold, REMAINDER_FRACTION * _gained(selection)
    )


def has_large_remainder(selection: Selection, remaining_gain: float, threshold: float) -> bool:
    """Tell whether accepted effects leave over much of what they gained: they are not what is
    missing, whether or not a formula is found that says more.
    """
    return remaining_gain > max(threshold, LARGE_REMAINDER_FRACTION * _gained(selection))


def _gained(selection: Selection) -> float:
    return sum(
        tried.likelihood_gain.penalised for tried in selection.accepted if tried.likelihood_gain
    )


def needs_no_disturbance(selection: Selection, units: Mapping[str, float]) -> bool:
    """Tell whether a model with what was accepted needs no drift."""
    drifts = selection.model.noise_levels.process
    return all(drifts.get(name, 0.0) < MAX_DISTURBANCE_LEVEL * unit for name, unit in units.items())


def remaining_term_gain(
    model_set: ModelSet, selection: Selection, units: Mapping[str, float]
) -> float:
    """Return what the best term gains [nats] where effects were accepted, beside them; nothing
    where the model needs no drift.
    """
    most, model = 0.0, selection.model
    if needs_no_disturbance(selection, units):
        return most
    paths = [place_path(tried.placed_effect).partition(".") for tried in selection.accepted]
    for path in {balance_of(model_set, section, place) for section, _, place in paths}:
        section, _, place = path.partition(".")
        try:
            excess = regression_at(model_set, model, section, place)
        except SpecError:
            continue
        most = max(most, rank_terms(excess.problem, excess.columns)[0][0])
    return most


def outperforms_effects(equation: DiscoveredEquation, selection: Selection) -> bool:
    """Tell whether a formula gains clearly more than all that was accepted."""
    gains = [
        ranking_gain(tried.likelihood_gain) for tried in selection.accepted if tried.likelihood_gain
    ]
    return ranking_gain(equation.likelihood_gain) > EQUATION_GAIN_FACTOR * sum(gains)


def select_equation(selection: Selection, equation: DiscoveredEquation) -> Selection:
    """Return a selection in which a formula is what was accepted, and no candidate is likely."""
    tried = CandidateFit(
        equation.formula.placed_effect,
        equation.likelihood_gain.penalised,
        equation.estimate,
        equation.likelihood_gain,
    )
    return dataclasses.replace(
        selection,
        model=equation.estimate,
        accepted=(tried,),
        rivals=(),
        other=max(selection.other, equation.likelihood_gain.total),
    )
