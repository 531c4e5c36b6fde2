"""Decision: which models of a case are accepted, from its training recordings alone."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from diagnosis.criterion.threshold import DEFAULT_THRESHOLD, DEFAULT_THRESHOLDS, Thresholds
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.equation.discovery import DiscoveredEquation, discover_equation
from diagnosis.equation.discovery_criteria import (
    has_large_remainder,
    needs_no_disturbance,
    outperforms_effects,
    remaining_term_gain,
    select_equation,
    triggers_discovery,
)
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import disturbance_units
from diagnosis.localisation.location import Location
from diagnosis.localisation.location_text import format_location
from diagnosis.localisation.ranking import localise, unexplained_gain
from diagnosis.pipeline.diagnosis_case import Case
from diagnosis.result.effect_naming import verdict_id
from diagnosis.result.verdict import DecisionOutcome
from diagnosis.selection.active_bound import has_opposing_active_bound
from diagnosis.selection.bootstrap import bootstrap_thresholds, cached_thresholds
from diagnosis.selection.bound_score import is_at_bound, rejects_bounds
from diagnosis.selection.candidate_search import LogCallback
from diagnosis.selection.forward_selection import Selection, select_effects
from diagnosis.selection.intersample import RecalibratedSet, best_hold, select_hold
from diagnosis.selection.nested_form import accepts_restriction, restricted_candidates
from diagnosis.selection.output_error import (
    CROSS_VALIDATED_FRACTION,
    OUTPUT_ERROR_SCREENING_FRACTION,
    OUTPUT_ERROR_THRESHOLDS,
    fit_output_error,
    has_fading_memory,
)
from diagnosis.unknown_input.detection import detect_unknown_input
from diagnosis.validation.adequacy import (
    has_autocorrelated_residuals_in_most,
    has_stacked_effects,
    is_inadequate,
    lacks_simulation_improvement,
    reject_effects,
)
from diagnosis.validation.confidence_cap import cap_probability
from diagnosis.validation.parameter_constancy import rejects_constancy

AMBIGUITY_GAIN = 1.0
"""A rival of another name within this of the best [nats] makes the verdict ambiguous."""
UNKNOWN_INPUT_FACTOR = 6.0
"""Times the threshold that an input must gain that acts in windows."""
FREE_DISTURBANCE_FACTOR = 4.0
"""Times the threshold that free drifts must gain where effects are to be something else."""
UNKNOWN_FACTOR = 8.0
"""Times the threshold that a free drift must gain where no effect was accepted."""


@dataclass(frozen=True)
class DiagnosisDecision:
    """The result of the selection; `model_set` has
    the recordings on which the decision is based.
    """

    model_set: ModelSet
    base: Estimate
    selection: Selection
    locations: tuple[Location, ...]
    outcome: DecisionOutcome
    thresholds: Thresholds
    equation: DiscoveredEquation | None = None


def decide(
    case: Case, full_rate_set: ModelSet, recalibrated: Sequence[RecalibratedSet], log: LogCallback
) -> DiagnosisDecision:
    """Return the decision on a case, for the recordings under each inter-sample behaviour.

    A base with fading memory is decided by the output-error criterion, every other one by
    prediction errors.
    """
    model_set, base = best_hold(recalibrated)
    if has_fading_memory(base, model_set.series):
        return _decide_by_output_error(case, full_rate_set, model_set, base, log)
    return _decide_by_prediction_error(case, full_rate_set, recalibrated, log)


def _decide_by_prediction_error(
    case: Case, full_rate_set: ModelSet, recalibrated: Sequence[RecalibratedSet], log: LogCallback
) -> DiagnosisDecision:
    """Judge models by what an observer foresees from sample to sample."""
    thresholds = _choose_thresholds(case, *best_hold(recalibrated), full_rate_set.series, log)
    most = max(DEFAULT_THRESHOLD, thresholds.largest)
    model_set, base, selection = select_hold(recalibrated, thresholds, log)
    units = disturbance_units(base.candidate, model_set.series, base.values(0))
    locations = localise(model_set, base)
    log(format_location(locations, model_set))
    selection, locations = detect_unknown_input(
        model_set, selection, locations, UNKNOWN_INPUT_FACTOR * most, log
    )
    left = unexplained_gain(model_set, selection.base, locations)
    says = _outcome_of(selection, left, model_set, most)
    formula = None
    over = remaining_term_gain(model_set, selection, units) if says == "effect" else 0.0
    if triggers_discovery(says, selection, left, over, most):
        formula = discover_equation(model_set, selection.base, locations, units, most, log)
    if formula is not None and outperforms_effects(formula, selection):
        says, selection = "unknown", select_equation(selection, formula)
    else:
        formula = None
        is_free = says == "effect" and not selection.has_unknown_input
        is_other = is_free and has_large_remainder(selection, over, most)
        says, selection = _check_adequacy(
            model_set, selection, says, FREE_DISTURBANCE_FACTOR * most, units, is_other, log
        )
    return DiagnosisDecision(model_set, base, selection, locations, says, thresholds, formula)


def _check_adequacy(
    model_set: ModelSet,
    selection: Selection,
    outcome: DecisionOutcome,
    min_gain: float,
    units: Mapping[str, float],
    has_large_remainder: bool,
    log: LogCallback,
) -> tuple[DecisionOutcome, Selection]:
    """Return a verdict, or `unknown` without effects that leave much of it unexplained.

    `has_large_remainder` where what they leave over at their places is known to be much.
    """
    if not selection.accepted:
        return outcome, selection
    is_free = (
        outcome == "effect"
        and not needs_no_disturbance(selection, units)
        and not selection.has_unknown_input
    )
    why = "terms at their places explain much beside them" if has_large_remainder else ""
    why = why or _rejection_reason(selection, model_set)
    if not why and is_free and is_inadequate(model_set, selection, min_gain):
        why = "free drifts explain much beside them"
    if not why:
        return outcome, cap_probability(
            model_set, selection, log
        ) if outcome == "effect" else selection
    names = ", ".join(tried.placed_effect.id for tried in selection.accepted)
    log(f"taken back: {names}: {why}, so it is something else")
    return "unknown", reject_effects(selection)


def _rejection_reason(selection: Selection, model_set: ModelSet) -> str:
    """Return why accepted effects are something else; nothing where they seem to be right.

    Beside a hidden input, which takes up anything at all, only ends of ranges are looked at.
    """
    first = selection.accepted[0]
    if is_at_bound(selection.model, first.placed_effect):
        return "the first is at the end of a range"
    if selection.has_unknown_input:
        return ""
    if rejects_bounds(selection.model, selection.accepted):
        return "they are pulled out of their ranges"
    if rejects_constancy(selection.model, first, model_set.series, len(selection.accepted) == 1):
        return "the parameters of the first differ from recording to recording"
    if has_opposing_active_bound(selection.model, first.placed_effect, model_set.automaton):
        return "the first is more than what its balance can give up for it"
    if has_stacked_effects(selection):
        return "two at one place gain alike"
    if has_autocorrelated_residuals_in_most(model_set, selection):
        return "most recordings remember what is left"
    if lacks_simulation_improvement(model_set, selection):
        return "simulations hardly show them"
    is_known = any(restricted_candidates(first, selection.first_round))
    if not is_known and accepts_restriction(selection.model, first.placed_effect, model_set.series):
        return "the first may as well be a plainer one"
    return ""


def _decide_by_output_error(
    case: Case, full_rate_set: ModelSet, model_set: ModelSet, base: Estimate, log: LogCallback
) -> DiagnosisDecision:
    """Judge models by simulations of whole recordings, in which nothing is fed back."""
    locations = localise(model_set, base)
    log(format_location(locations, model_set))
    left = unexplained_gain(model_set, base, locations)
    log("what happened long ago does not matter here: whole simulations are judged")
    thresholds = (
        OUTPUT_ERROR_THRESHOLDS if case.thresholds == DEFAULT_THRESHOLDS else case.thresholds
    )
    found = fit_output_error(full_rate_set, base)
    selection = select_effects(
        found.model_set,
        found.base,
        {},
        thresholds,
        log,
        CROSS_VALIDATED_FRACTION,
        screening_fraction=OUTPUT_ERROR_SCREENING_FRACTION,
    )
    says = _outcome_of(selection, left, found.model_set, max(DEFAULT_THRESHOLD, thresholds.largest))
    model_set = dataclasses.replace(model_set, series=found.model_set.series)
    return DiagnosisDecision(model_set, found.base, selection, locations, says, thresholds)


def _choose_thresholds(
    case: Case,
    model_set: ModelSet,
    base: Estimate,
    full_rate_series: Sequence[SampledRecording],
    log: LogCallback,
) -> Thresholds:
    """Return the thresholds of a case: given, kept from an earlier bootstrap, or made by one."""
    if case.bootstrap == "never":
        return case.thresholds
    kept = cached_thresholds(model_set, full_rate_series)
    if kept is None and case.bootstrap == "made":
        units = disturbance_units(base.candidate, model_set.series, base.values(0))
        kept = bootstrap_thresholds(model_set, base, units, full_rate_series, log)
    found = kept or case.thresholds
    log(f"thresholds of {found.text} nats, {found.origin}")
    return found


def _outcome_of(
    selection: Selection, unexplained: float, model_set: ModelSet, min_gain: float
) -> DecisionOutcome:
    """Return the outcome of a selection; `unexplained` is the gain [nats] that the base leaves."""
    if not selection.accepted:
        return "unknown" if unexplained > UNKNOWN_FACTOR * min_gain else "nothing_missing"
    best, automaton = selection.accepted[0], model_set.automaton
    name = verdict_id(best.placed_effect, automaton)
    others = (one for one in selection.rivals if verdict_id(one.placed_effect, automaton) != name)
    is_open = any(one.score > best.score - AMBIGUITY_GAIN for one in others)
    return "ambiguous" if is_open else "effect"
