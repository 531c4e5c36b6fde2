"""Discovery criteria: when a formula is searched beside the library effects, and when it is the
verdict.

If the library lacks the true effect, the nearest one still gains a lot. The remaining gain beside
it shows that it is not the right one.
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
"""Multiple of the threshold of the unexplained gain from which a formula is searched."""
REMAINDER_FACTOR = 2.0
"""Multiple of the threshold that a term must gain beside accepted effects."""
REMAINDER_FRACTION = 0.3
"""Fraction of the effects' gain that a term must gain as well: no strong effect fits exactly."""
LARGE_REMAINDER_FRACTION = 0.8
"""Fraction of the effects' gain from which a term beside them shows that they are wrong.

Right effects left a third at most.
"""
MAX_DISTURBANCE_LEVEL = 0.5
"""Level in units below which a model does not need its disturbances."""
EQUATION_GAIN_FACTOR = 1.5
"""Factor by which a formula must gain more than the accepted effects to be the verdict."""


def triggers_discovery(
    outcome: DecisionOutcome,
    selection: Selection,
    unexplained: float,
    remaining_gain: float,
    threshold: float,
) -> bool:
    """Return whether a formula should be searched, by the outcome and the gains that are left.

    Always for the outcomes `unknown` and `ambiguous`. For `nothing_missing` if `unexplained`, the
    gain [nats] that the base leaves, exceeds `UNEXPLAINED_FACTOR` (2.5) thresholds. Otherwise if
    `remaining_gain`, the one that accepted effects leave, exceeds `REMAINDER_FACTOR` (2) thresholds
    and `REMAINDER_FRACTION` (0.3) of the sum of their penalised gains.
    """
    if outcome in ("unknown", "ambiguous"):
        return True
    if outcome == "nothing_missing":
        return unexplained > UNEXPLAINED_FACTOR * threshold
    return remaining_gain > max(
        REMAINDER_FACTOR * threshold, REMAINDER_FRACTION * _gained(selection)
    )


def has_large_remainder(selection: Selection, remaining_gain: float, threshold: float) -> bool:
    """Return whether a term beside accepted effects gains nearly as much as they do.

    `remaining_gain` [nats] must exceed `threshold` and `LARGE_REMAINDER_FRACTION` (0.8) of the sum
    of their penalised gains. The effects are then wrong, whether or not a better formula is found.
    """
    return remaining_gain > max(threshold, LARGE_REMAINDER_FRACTION * _gained(selection))


def _gained(selection: Selection) -> float:
    """Return the sum of the penalised gains of accepted effects [nats]."""
    return sum(
        tried.likelihood_gain.penalised for tried in selection.accepted if tried.likelihood_gain
    )


def needs_no_disturbance(selection: Selection, units: Mapping[str, float]) -> bool:
    """Return whether all disturbances in `units` have small levels in the selected model.

    Small is below `MAX_DISTURBANCE_LEVEL` (0.5) units; a disturbance that the model does not have
    counts as 0. True without `units`.
    """
    drifts = selection.model.noise_levels.process
    return all(drifts.get(name, 0.0) < MAX_DISTURBANCE_LEVEL * unit for name, unit in units.items())


def remaining_term_gain(
    model_set: ModelSet, selection: Selection, units: Mapping[str, float]
) -> float:
    """Return the largest gain [nats] of a term in the balances of accepted effects, beside them.

    It is the penalised gain of one term alone by `rank_terms`, at least 0. Balances at which the
    regression raises SpecError are left out. The result is 0 if the model needs no disturbance
    (`needs_no_disturbance`) or nothing is accepted.
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
    """Return whether a formula gains clearly more than all accepted effects together.

    Its `ranking_gain` must exceed `EQUATION_GAIN_FACTOR` (1.5) times the sum of theirs; effects
    without a likelihood gain count 0.
    """
    gains = [
        ranking_gain(tried.likelihood_gain) for tried in selection.accepted if tried.likelihood_gain
    ]
    return ranking_gain(equation.likelihood_gain) > EQUATION_GAIN_FACTOR * sum(gains)


def select_equation(selection: Selection, equation: DiscoveredEquation) -> Selection:
    """Return the selection with a formula as its only accepted effect and model, without rivals.

    `other` is raised to the total gain of the formula if that is larger; all else is unchanged.
    """
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
