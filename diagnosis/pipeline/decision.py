"""Decision: which models of a case are accepted, from its training recordings alone.

Three kinds of hypotheses are compared (docs/method.md): the base explains the recordings, effects
of the library are missing, or something is missing that no effect describes. In the last case an
input that acts in windows, then a formula are tried as explanations.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from diagnosis.criterion.explained_share import (
    USUAL_FORM_ERROR,
    explained_share,
    is_ordinary,
    remaining_energy,
)
from diagnosis.criterion.threshold import Thresholds
from diagnosis.equation.discovery import DiscoveredEquation, discover_equation
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.levenberg_marquardt import estimate_parameters
from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.location import Location
from diagnosis.localisation.location_text import format_location
from diagnosis.localisation.ranking import localise
from diagnosis.model.parameter_vector import extend_vector
from diagnosis.pipeline.diagnosis_case import Case
from diagnosis.result.verdict import DecisionOutcome, verdict_id
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.comparison import effective_gain
from diagnosis.selection.forward_selection import (
    MIN_RIVAL_RATIO,
    Selection,
    candidate_probabilities,
    select_effects,
)
from diagnosis.selection.intersample import LogCallback, fit_base
from diagnosis.selection.output_error import OutputErrorFit, fit_output_error, has_fading_memory
from diagnosis.unknown_input.detection import detect_unknown_input

MIN_SIMULATED_SHARE = 0.5
"""Part of the error of whole simulations that an effect explains at least."""


@dataclass(frozen=True)
class DiagnosisDecision:
    """The result of the selection; `model_set` has the recordings on which it is based."""

    model_set: ModelSet
    selection: Selection
    locations: tuple[Location, ...]
    outcome: DecisionOutcome
    thresholds: Thresholds
    equation: DiscoveredEquation | None = None


def decide(case: Case, full_rate_set: ModelSet, log: LogCallback) -> DiagnosisDecision:
    """Return the decision on a case.

    Models predict each sample from those before it. A base that forgets its initial state is
    simulated over whole recordings first. If effects explain that but for the error of their form,
    they are the result. If no effect explains it and it is no more than an ordinary disturbance,
    nothing is missing. Else prediction is tried as well; if it names another effect, the one that
    simulates better decides.
    """
    model_set, base = fit_base(full_rate_set, log)
    locations = localise(model_set, base)
    log(format_location(locations, model_set))
    if not has_fading_memory(base, model_set.series):
        return _decide_by_prediction(case, model_set, base, locations, frozenset(), log)
    log("the base forgets its initial state: whole recordings are simulated")
    found = fit_output_error(full_rate_set, base)
    selection = select_effects(found.model_set, found.base, case.thresholds, log)
    share = _simulated_share(selection)
    simulated_set = dataclasses.replace(model_set, series=found.model_set.series)
    simulated = DiagnosisDecision(
        simulated_set, selection, locations, _outcome_of(selection, simulated_set), case.thresholds
    )
    is_found = share >= 1.0 - USUAL_FORM_ERROR**2
    if is_found or (not selection.accepted and _is_ordinary(selection.base)):
        return simulated
    log(f"effects explain {share:.0%} of the simulations: prediction is tried")
    known = frozenset(one.placed_effect.id for one in selection.accepted)
    predicted = _decide_by_prediction(case, model_set, base, locations, known, log)
    is_simulated = share >= MIN_SIMULATED_SHARE
    if is_simulated and not _simulates_better(found, selection, predicted.selection):
        return simulated
    return predicted


def _is_ordinary(base: Estimate) -> bool:
    """Return whether a simulated base leaves no more than an ordinary disturbance."""
    energy = remaining_energy(base, base.noise_levels.outputs**2)
    return is_ordinary(energy, len(base.noise_levels.outputs))


def _simulates_better(found: OutputErrorFit, simulated: Selection, predicted: Selection) -> bool:
    """Return whether the effects of a comparison of predictions, fitted to whole simulations, gain
    over those of the comparison of simulations, which may have missed them.
    """
    effects = [one.placed_effect for one in predicted.accepted]
    known = {one.placed_effect.id for one in simulated.accepted}
    if not effects or effects[0].id in known:
        return False
    series = found.model_set.series
    candidate = found.model_set.try_compile(effects)
    if candidate is None:
        return False
    start = extend_vector(candidate, predicted.model.candidate, predicted.model.point, {})
    model = estimate_parameters(candidate, series, found.base.noise_levels, start)
    return effective_gain(model, simulated.model, simulated.first.correlation, len(series)) > 0.0


def _decide_by_prediction(
    case: Case,
    model_set: ModelSet,
    base: Estimate,
    locations: tuple[Location, ...],
    preferred: frozenset[str],
    log: LogCallback,
) -> DiagnosisDecision:
    """Return the decision by models that predict each sample from those before it.

    An effect in `preferred`, which explains simulations, is taken before others.
    """
    selection = select_effects(model_set, base, case.thresholds, log, preferred)
    selection, locations = detect_unknown_input(
        model_set, selection, locations, case.thresholds, log
    )
    outcome, equation = _outcome_of(selection, model_set), None
    if outcome == "unknown":
        equation = discover_equation(
            model_set, selection.first, locations, case.thresholds.default, log
        )
        if equation is not None:
            selection = _select_equation(selection, equation)
    return DiagnosisDecision(model_set, selection, locations, outcome, case.thresholds, equation)


def _simulated_share(selection: Selection) -> float:
    """Return the share of the error of whole simulations, above the noise of the signals, that the
    accepted effects explain; 0 without any.
    """
    noise = selection.base.noise_levels.outputs**2
    is_any = bool(selection.accepted)
    return explained_share(selection.model, selection.base, noise) if is_any else 0.0


def _outcome_of(selection: Selection, model_set: ModelSet) -> DecisionOutcome:
    """Return the outcome of a selection.

    Without an accepted effect it is `nothing_missing` if what the base leaves may be an ordinary
    disturbance, else `unknown`. It is `ambiguous` if a rival of another name and family is at least
    `MIN_RIVAL_RATIO` (0.5) times as probable as the accepted effect.
    """
    if not selection.accepted:
        return "nothing_missing" if selection.first.is_ordinary else "unknown"
    best, automaton = selection.accepted[0], model_set.automaton
    probabilities = candidate_probabilities(selection.first)
    least = MIN_RIVAL_RATIO * probabilities.get(best.placed_effect.id, 0.0)
    name = verdict_id(best.placed_effect, automaton)
    is_open = any(
        verdict_id(one.placed_effect, automaton) != name
        and one.placed_effect.effect.family != best.placed_effect.effect.family
        and probabilities[one.placed_effect.id] >= least
        for one in selection.rivals
    )
    return "ambiguous" if is_open and len(selection.accepted) == 1 else "effect"


def _select_equation(selection: Selection, equation: DiscoveredEquation) -> Selection:
    """Return the selection with a formula as its only accepted effect and model."""
    placed_effect, estimate = equation.formula.placed_effect, equation.estimate
    tried = CandidateFit(placed_effect, equation.gain, estimate, equation.gain, equation.share)
    return dataclasses.replace(selection, model=estimate, accepted=(tried,), share=equation.share)
