"""Report text: a diagnosis in words, for the console and the report."""

from __future__ import annotations

from diagnosis.criterion.threshold import Thresholds
from diagnosis.data_quality.finding import format_findings
from diagnosis.localisation.location_text import PLACE_PHRASES, format_location
from diagnosis.model.placed_effect import PlacedEffect, place_path
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.number_text import format_probability, format_quantity
from diagnosis.result.verdict import NamedEffect, verdict_id
from diagnosis.selection.candidate_search import MIN_SCREENING_GAIN, CandidateFit
from diagnosis.selection.forward_selection import Selection

MAX_NAMED = 4
"""Maximum number of rivals, windows or findings in a sentence."""


def format_headline(report: DiagnosisReport) -> str:
    """Return the verdict in one sentence."""
    verdict = report.verdict
    if report.end_reason:
        return f"Nothing is concluded yet: {report.end_reason}."
    if report.diagnosis is None:
        return "Nothing is concluded about the physics: these recordings are not usable."
    if verdict.verdict == "effect":
        named = " and ".join(_format_effect_values(one) for one in verdict.effects)
        return f"`{report.name}` lacks {named}."
    if verdict.verdict == "ambiguous":
        shares = {(one.id, one.place): one.probability for one in verdict.candidates}
        names = [
            f"{format_effect(one)} ({format_probability(shares.get((one.id, one.place), 0.0))})"
            for one in verdict.ambiguous_with
        ]
        return (
            f"`{report.name}` lacks something, and these recordings cannot tell which of these "
            f"it is: {'; '.join(names)}."
        )
    if verdict.verdict == "unknown":
        names = [format_effect(one) for one in verdict.ambiguous_with[:MAX_NAMED]]
        nearest = f"; the nearest is {' or '.join(names)}" if names else ""
        like = _format_equation(report) or nearest
        return f"`{report.name}` lacks something that none of the effects tried explains{like}."
    return (
        f"`{report.name}` lacks nothing that these recordings show: with its parameters "
        f"recalibrated no effect gains the {report.case.thresholds.text} nats asked for."
    )


def _format_equation(report: DiagnosisReport) -> str:
    """Return the discovered formula as the end of a sentence; "" without one."""
    found = report.diagnosis.equation if report.diagnosis else None
    if found is None:
        return ""
    where = f"{PLACE_PHRASES[found.location.section]} {found.location.place}"
    return f"; it is like `{found.text}` {where}"


def format_effect(effect: NamedEffect) -> str:
    """Return an effect with its place, such as `viscous friction in the balance of w`."""
    section, _, name = effect.place.partition(".")
    return f"{effect.id.replace('_', ' ')} {PLACE_PHRASES[section]} {name}"


def _format_effect_values(effect: NamedEffect) -> str:
    """Return an effect with its place and parameter values."""
    values = ", ".join(f"{name} = {format_quantity(q)}" for name, q in effect.parameters.items())
    return f"{format_effect(effect)} ({values})" if values else format_effect(effect)


def format_two_digits(value: float) -> str:
    """Return a number with two significant digits: `100`, not `1e+02`."""
    return f"{float(f'{value:.2g}'):g}"


def format_improvement(report: DiagnosisReport) -> str:
    """Return the misfits before and after and the confirmation in one line; "" without any."""
    parts = []
    for part, signals in report.verdict.fit.items():
        found = []
        for name, one in signals.items():
            before, after = f"{100 * one.nrmse_before:.3g} %", f"{100 * one.nrmse_after:.3g} %"
            found.append(f"{name} {before}" if before == after else f"{name} {before} to {after}")
        if found:
            parts.append(f"{part.replace('_', ' ')}: {', '.join(found)}")
    if not parts:
        return ""
    confirmed = {True: " - confirmed", False: " - not confirmed", None: ""}
    return f"misfit of free simulation, {'; '.join(parts)}{confirmed[report.verdict.confirmed]}"


def format_missing_location(report: DiagnosisReport) -> str:
    """Return where physics is missing by `format_location`; "" if nothing is."""
    found = report.diagnosis
    if found is None or report.verdict.verdict == "nothing_missing":
        return ""
    return format_location(report.verdict.location, found.model_set)


def format_separation(report: DiagnosisReport) -> list[str]:
    """Return the experiment, and notes of effects, that separate accepted effects from others."""
    if report.diagnosis is None:
        return []
    selection = report.diagnosis.selection
    lines = [format_experiment(report)]
    for tried in (*selection.accepted, *selection.rivals):
        effect = tried.placed_effect.effect
        if effect.separated_by and effect.confused_with:
            name = verdict_id(tried.placed_effect, report.automaton)
            others = ", ".join(effect.confused_with)
            lines.append(f"{name} from {others}: {'; '.join(effect.separated_by)}")
    return [line for line in lines if line]


def format_oscillation(report: DiagnosisReport) -> str:
    """Return how long base and model follow the largest step; "" if the base follows."""
    found = report.diagnosis.oscillations if report.diagnosis else ()
    if not found or not found[0].has_other_frequency or report.verdict.verdict == "nothing_missing":
        return ""
    text = found[0].format_sentence()
    if len(found) > 1:
        is_whole = found[1].followed_time >= found[1].length
        end = "to the end" if is_whole else f"until t = {found[1].followed_time:.2f} s"
        text += f"; with what was found it fits {end}"
    return text


def format_experiment(report: DiagnosisReport) -> str:
    """Return the experiment to record in one sentence; "" without a plan."""
    found = report.diagnosis
    return found.plan.format_sentence() if found and found.plan else ""


def format_reason(
    candidate_fit: CandidateFit, rank: int, selection: Selection, thresholds: Thresholds
) -> str:
    """Return why a candidate was accepted or not; `rank` is its index in the table."""
    own = candidate_fit.placed_effect
    if own.id in {one.placed_effect.id for one in selection.accepted}:
        return "accepted"
    if own.id in {one.placed_effect.id for one in selection.rivals}:
        return "cannot be told from the accepted one"
    if not candidate_fit.is_fitted:
        return f"not fitted: gains less than {MIN_SCREENING_GAIN:g} nats in screening"
    threshold = thresholds.threshold_of(own)
    if candidate_fit.gain <= threshold:
        return f"gains less than {threshold:.0f} nats"
    share = f"explains {100.0 * max(candidate_fit.share, 0.0):.0f} % of what is unexplained"
    if not selection.accepted:
        least = selection.first.least_share_of(candidate_fit)
        return f"{share}, {100.0 * min(least, 1.0):.0f} % are needed"
    return f"{share}, less than what was accepted" if rank else "not needed beside the others"


def candidate_title(placed_effect: PlacedEffect, report: DiagnosisReport) -> str:
    """Return `name@section.place` of a candidate as in verdicts."""
    return f"{verdict_id(placed_effect, report.automaton)}@{place_path(placed_effect)}"


def summary_lines(report: DiagnosisReport) -> list[str]:
    """Return headline, location, experiment or oscillation, improvement and caveat.

    There are at most four lines; of five, the second and the third one are joined.
    """
    is_ambiguous = report.verdict.verdict == "ambiguous"
    more = format_experiment(report) if is_ambiguous else format_oscillation(report)
    place, doubt = format_missing_location(report), _format_caveat(report)
    if place and more and doubt:
        place, more = f"{place}; {more}", ""
    lines = [format_headline(report), place, more, format_improvement(report), doubt]
    return [line for line in lines if line]


def _format_caveat(report: DiagnosisReport) -> str:
    """Return the worst finding on recordings, else effects nearly as good, else an empty text."""
    worst = format_findings([finding for finding in report.findings if finding.severity != "note"])
    if worst:
        more = f" (and {len(worst) - 1} more)" if len(worst) > 1 else ""
        return f"recordings: {worst[0][1]}{more}"
    verdict = report.verdict
    names = [format_effect(one) for one in verdict.ambiguous_with]
    if verdict.verdict == "effect" and names:
        more = f" and {len(names) - MAX_NAMED} more" if len(names) > MAX_NAMED else ""
        return f"nearly as good: {', '.join(names[:MAX_NAMED])}{more}"
    return ""
