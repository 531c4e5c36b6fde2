"""Diagnosis: the whole procedure - recalibration, localisation, selection, decision, validation.

Only the training recordings are used until the decision is final. Held-out recordings are read
after that; they confirm the verdict or not, and change nothing else.
"""

from __future__ import annotations

import dataclasses
import hashlib
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

import numpy as np

from diagnosis.criterion.threshold import DEFAULT_THRESHOLDS, Thresholds
from diagnosis.data.sampled_recording import (
    SampledRecording,
    compared_outputs,
    resample,
    share_period,
)
from diagnosis.equation.discovery import DiscoveredEquation
from diagnosis.estimation.covariance import quantities_of
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.initial_input import average_initial_inputs, choose_initial_inputs
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.per_recording_parameters import reestimate_per_recording
from diagnosis.experiment.discrimination import ExperimentPlan, plan_experiment
from diagnosis.localisation.location import Location
from diagnosis.localisation.location_text import format_location
from diagnosis.localisation.ranking import rank_accepted_first, rank_causes_first
from diagnosis.model.placed_effect import PlacedEffect, place_path
from diagnosis.pipeline.decision import decide
from diagnosis.pipeline.diagnosis_case import Case, build_model_set, read_series
from diagnosis.result.verdict import (
    DecisionOutcome,
    NamedEffect,
    RankedCandidate,
    Verdict,
    named_effect_of,
    verdict_id,
)
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.forward_selection import Selection
from diagnosis.selection.intersample import LogCallback
from diagnosis.validation.free_simulation import Misfit, compare_misfits
from diagnosis.validation.oscillation import Oscillation, analyse_oscillation
from engine.recordings.recording_window import paths_overlap, strip_window_suffix
from language.loading.load import automaton_of
from language.model.automaton import Automaton
from language.text.diagnostic import DataError, SpecError

MAX_WORSE_RATIO = 1.1
"""Ratio of the simulation misfit after to before from which a signal is simulated worse."""
CONFIRMATION_RATIO = 0.8
"""Ratio below which the misfit of every signal confirms an effect."""


@dataclass(frozen=True)
class Diagnosis:
    """A verdict with the models behind it; `model_set` holds the training recordings.

    `equation` is the formula that is accepted for an unknown disturbance. `plan` is the experiment
    that would separate an accepted effect from its rivals. `oscillations` after the largest step
    are those of the base and, if effects were accepted, of the final model. `unread` says which
    held-out files could not be used.
    """

    verdict: Verdict
    selection: Selection = field(repr=False)
    model_set: ModelSet = field(repr=False)
    held_out: tuple[SampledRecording, ...] = field(repr=False)
    equation: DiscoveredEquation | None = field(default=None, repr=False)
    thresholds: Thresholds = DEFAULT_THRESHOLDS
    plan: ExperimentPlan | None = field(default=None, repr=False)
    oscillations: tuple[Oscillation, ...] = field(default=(), repr=False)
    unread: tuple[str, ...] = ()


def diagnose(case: Case, log: LogCallback = lambda text: None) -> Diagnosis:
    """Return the diagnosis of a case; progress is reported to `log`, a line at a time.

    Held-out recordings are read after the decision; those that cannot be read, or that are a copy
    of another recording, only give a line in `unread`. Fits are stored in the checkpoint folder of
    the case, if it has one. Raises SpecError, ValueError (if no output is compared, or a training
    recording has too few samples) and MissingToolError, and what `before_fit` of the case raises.
    """
    start_time = time.monotonic()
    automaton = automaton_of(case.document, case.project)
    seen = compared_outputs(case.mapping, automaton)
    if not seen:
        raise DataError(f"map `{case.mapping.name}` compares no output of `{automaton.name}`")
    series = share_period(
        [one for path in case.train for one in read_series(path, case, automaton, seen)]
    )
    raw = build_model_set(case, automaton, series, seen)
    decision = decide(case, raw, log)
    model_set, selection, locations = decision.model_set, decision.selection, decision.locations
    plan = plan_experiment(model_set, _models_to_discriminate(selection, automaton))
    if plan is not None:
        log(plan.format_sentence())
    locations = rank_accepted_first(
        locations, [place_path(tried.placed_effect) for tried in selection.accepted], model_set
    )
    if decision.outcome == "unknown":
        candidates = _candidates_above(selection, decision.thresholds.default)
        locations = rank_causes_first(
            locations, [place_path(one.placed_effect) for one in candidates], model_set
        )
    fit = {"train": compare_misfits(selection.base, selection.model, model_set.series)}
    verdict = _build_verdict(decision.outcome, selection, locations, automaton, fit)
    hashes = {case.name_of(path): _file_digest(path) for path in case.train}
    verdict = dataclasses.replace(
        verdict, inputs=hashes, messages=(format_location(locations, model_set),)
    )
    held_out, unread = _read_held_out(case, automaton, seen, series[0].period, model_set)
    for text in unread:
        log(text)
    if held_out:
        log(
            "held out: "
            + ", ".join(f"{case.name_of(path)} {_file_digest(path)}" for path in case.held_out)
        )
        held_out = choose_initial_inputs(
            selection.base, [average_initial_inputs(one) for one in held_out]
        )
        verdict = _confirm(verdict, selection, held_out)
    verdict = dataclasses.replace(verdict, runtime_s=time.monotonic() - start_time)
    oscillations = _oscillations(selection, model_set)
    details = decision.equation, decision.thresholds, plan, oscillations
    return Diagnosis(verdict, selection, model_set, held_out, *details, unread=unread)


def _read_held_out(
    case: Case,
    automaton: Automaton,
    output_names: Sequence[str],
    period: Fraction,
    model_set: ModelSet,
) -> tuple[tuple[SampledRecording, ...], tuple[str, ...]]:
    """Return the held-out recordings, and a message for each file that cannot be used.

    They are brought to the period [s] of the training recordings, then decimated to that of the
    model set.
    Unreadable files and copies of other recordings are left out; the verdict stands without them.
    """
    recordings: list[SampledRecording] = []
    unread = []
    for k, path in enumerate(case.held_out):
        known = next((o for o in (*case.train, *case.held_out[:k]) if paths_overlap(path, o)), None)
        if known is not None:
            named = f"{case.name_of(path)} was held out and cannot be used"
            unread.append(f"{named}: it is a copy of {case.name_of(known)}")
            continue
        try:
            shared = share_period(read_series(path, case, automaton, output_names), period)
            is_linear = model_set.series[0].is_first_order_hold
            recordings += resample(shared, automaton, output_names, is_linear, model_set.period)
        except (SpecError, ValueError) as error:
            why = error.problems[0].label if isinstance(error, SpecError) else str(error)
            unread.append(f"{case.name_of(path)} was held out and cannot be used: {why}")
    return tuple(recordings), tuple(unread)


def _oscillations(selection: Selection, model_set: ModelSet) -> tuple[Oscillation, ...]:
    """Return the oscillation of the base and of the final model; empty if the base has none."""
    models = [selection.base, *([selection.model] if selection.accepted else [])]
    found = [analyse_oscillation(model, model_set.series) for model in models]
    return tuple(one for one in found if one is not None) if found[0] is not None else ()


def _candidates_above(selection: Selection, min_gain: float) -> list[CandidateFit]:
    """Return the candidates of the first round with a gain above `min_gain` [nats],
    best score first.
    """
    rounds = selection.first_round
    return [one for one in rounds if one.gain > min_gain]


def _models_to_discriminate(
    selection: Selection, automaton: Automaton
) -> list[tuple[str, Estimate]]:
    """Return the first accepted effect and its rivals with their fits, by name and place."""
    some = (*selection.accepted[:1], *selection.rivals)
    return [
        ("@".join(_verdict_name(tried.placed_effect, automaton)), tried.estimate)
        for tried in some
        if tried.estimate is not None and tried.estimate.normal_equations is not None
    ]


def _build_verdict(
    outcome: DecisionOutcome,
    selection: Selection,
    locations: Sequence[Location],
    automaton: Automaton,
    fit: dict[str, dict[str, Misfit]],
) -> Verdict:
    """Return the verdict of a selection, without held-out misfits and run time.

    An ambiguous verdict states the accepted effect first, then its rivals.
    """
    effects = tuple(
        named_effect_of(tried.placed_effect, selection.model, automaton)
        for tried in selection.accepted
    )
    rivals = _name_rivals(selection, automaton)
    before, after = quantities_of(selection.base), quantities_of(selection.model)
    base = {name: (before[name], after.get(name, before[name])) for name in before}
    return Verdict(
        outcome,
        effects if outcome == "effect" else (),
        _rank_candidates(selection, automaton),
        selection.probabilities()["other"],
        (*effects, *rivals) if outcome == "ambiguous" else rivals,
        tuple(locations),
        fit,
        base,
        None,
        0.0,
    )


def _verdict_name(placed_effect: PlacedEffect, automaton: Automaton) -> tuple[str, str]:
    """Return the name of an effect in a verdict, and its place."""
    return verdict_id(placed_effect, automaton), place_path(placed_effect)


def _rank_candidates(selection: Selection, automaton: Automaton) -> tuple[RankedCandidate, ...]:
    """Return the fitted candidates in the order of the first round.

    Forms with the same name and place are merged: probabilities are added, the gain is the first
    one.
    """
    probabilities = selection.probabilities()
    found: dict[tuple[str, str], RankedCandidate] = {}
    for tried in selection.first_round:
        if tried.estimate is None:
            continue
        name = _verdict_name(tried.placed_effect, automaton)
        each = probabilities[tried.placed_effect.id]
        std = _gain_std(selection.base, tried.estimate)
        new = RankedCandidate(*name, each, tried.gain, std)
        old = found.setdefault(name, new)
        if old is not new:
            both = old.probability + new.probability
            found[name] = dataclasses.replace(old, probability=both)
    return tuple(found.values())


def _gain_std(base: Estimate, model: Estimate) -> float:
    """Return the standard deviation [nats] of a gain over recordings: that of one times their root.

    The gain of a recording is half its reduction of squared innovations over the variances.
    """
    variances = model.prediction.variances
    before, after = base.prediction.runs.squared_sums, model.prediction.runs.squared_sums
    gains = 0.5 * np.sum((before - after) / variances, axis=1)
    return float(np.std(gains) * np.sqrt(len(gains)))


def _name_rivals(selection: Selection, automaton: Automaton) -> tuple[NamedEffect, ...]:
    """Return the rivals under their names in a verdict,
    without the accepted names and repetitions.
    """
    taken = [_verdict_name(one.placed_effect, automaton) for one in selection.accepted]
    found: dict[tuple[str, str], NamedEffect] = {}
    for tried in selection.rivals:
        name = _verdict_name(tried.placed_effect, automaton)
        if name not in taken and tried.estimate is not None:
            found.setdefault(name, named_effect_of(tried.placed_effect, tried.estimate, automaton))
    return tuple(found.values())


def _confirm(
    verdict: Verdict, selection: Selection, held_out: tuple[SampledRecording, ...]
) -> Verdict:
    """Return the verdict with the misfits of held-out recordings and whether they confirm it.

    They confirm accepted effects if the likelihood is better and no signal is simulated worse by 10
    %, or if every misfit falls by 20 %: a base with disturbances may predict as well without the
    physics.
    """
    base = reestimate_per_recording(selection.base, held_out)
    model = reestimate_per_recording(selection.model, held_out)
    misfits = compare_misfits(base, model, held_out)
    fit = {**verdict.fit, "held_out": misfits}
    left = [one.nrmse_after / one.nrmse_before for one in misfits.values() if one.nrmse_before]
    is_predicted = (
        model.negative_log_likelihood < base.negative_log_likelihood
        and max(left, default=0.0) < MAX_WORSE_RATIO
    )
    is_better = is_predicted or max(left, default=1.0) < CONFIRMATION_RATIO
    confirmed = is_better if selection.accepted else None
    return dataclasses.replace(verdict, fit=fit, confirmed=confirmed)


def _file_digest(path: Path) -> str:
    """Return the first 16 hexadecimal digits of the SHA-256 of a file."""
    return hashlib.sha256(strip_window_suffix(path).read_bytes()).hexdigest()[:16]
