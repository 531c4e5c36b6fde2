"""Summary cards: four short answers at the top of a report."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.data_quality.finding import format_findings
from diagnosis.report import report_text as sentences
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.number_text import format_change, format_percent, format_probability
from diagnosis.report.tables import location_rows
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.forward_selection import Selection
from diagnosis.validation.whiteness import WhitenessTest

MAX_LINES = 4
CONFIRMATIONS = {
    True: ("better on recordings that were held out, too",),
    False: ("not better on recordings that were held out",),
    None: (),
}


def summary_cards(
    report: DiagnosisReport, residual_tests: Sequence[WhitenessTest] = ()
) -> list[tuple[str, Sequence[str]]]:
    """Return title and lines of the cards on location, confidence, improvement and caveats.

    `residual_tests` are those of the final model. There are no cards without a diagnosis.
    """
    if report.diagnosis is None:
        return []
    selection = report.diagnosis.selection
    is_changed = bool(selection.accepted)
    return [
        ("Where", _location_lines(report)),
        ("How sure", _confidence_lines(report, selection)),
        (
            "How much better" if is_changed else "How well it fits",
            _improvement_lines(report, is_changed),
        ),
        ("Keep in mind", _caveat_lines(report, residual_tests)[:MAX_LINES]),
    ]


def _location_lines(report: DiagnosisReport) -> list[str]:
    """Return where physics is missing."""
    verdict = report.verdict
    named = verdict.effects or verdict.ambiguous_with
    lines = [sentences.format_effect(one) for one in named]
    if verdict.verdict == "unknown":
        lines = [f"most at {one.path}" for one in verdict.location[:1] if one.gain > 0.0]
    if not lines:
        return ["nowhere: no place asks for more than the model has"]
    rows = dict(location_rows(verdict.location[0], 2)) if verdict.location else {}
    lines = [*dict.fromkeys(lines)][:MAX_LINES]
    return lines + [
        f"{words} {rows[words]}" for words in ("by mode", "strongest in") if words in rows
    ]


def _confidence_lines(report: DiagnosisReport, selection: Selection) -> list[str]:
    """Return probabilities, gains and the confirmation."""
    fitted = [one for one in selection.first_round if one.is_fitted]
    count = f"{len(selection.first_round)} candidates, {len(fitted)} fitted in full"
    needed = f"{report.case.thresholds.text} nats are needed"
    lines = [f"none of {count}, gains enough"]
    if selection.accepted:
        shares = selection.probabilities()
        lines = [
            f"{format_probability(shares[one.placed_effect.id])} probable: {one.placed_effect.id}"
            for one in (selection.accepted[0], *selection.rivals)
            if one.placed_effect.id in shares
        ]
        lines += [f"best of {count}", *(_format_gain(one) for one in selection.accepted), needed]
    elif fitted:
        lines += [f"best: {_format_gain(max(fitted, key=lambda one: one.gain))}", needed]
    return [*lines, *CONFIRMATIONS[report.verdict.confirmed]]


def _format_gain(candidate_fit: CandidateFit) -> str:
    """Return the gain and the explained share of a candidate as text."""
    one, share = candidate_fit, 100.0 * max(candidate_fit.share, 0.0)
    return f"{one.placed_effect.id}: {one.gain:.0f} nats, explains {share:.0f} %"


def _improvement_lines(report: DiagnosisReport, is_changed: bool) -> list[str]:
    """Return the misfits, of held-out recordings if there are any."""
    fit = report.verdict.fit
    part, words = ("held_out", "held-out") if fit.get("held_out") else ("train", "training")
    lines = [f"misfit of free simulation, {words} recordings"]
    for name, one in fit.get(part, {}).items():
        line = f"{name}: {format_percent(one.nrmse_before)}"
        if is_changed:
            moved = format_change(one.nrmse_before, one.nrmse_after)
            line += f" \N{RIGHTWARDS ARROW} {format_percent(one.nrmse_after)} ({moved})"
        lines.append(line)
    return lines


def _caveat_lines(report: DiagnosisReport, residual_tests: Sequence[WhitenessTest]) -> list[str]:
    """Return caveats on residuals, rivals, findings and excitation."""
    verdict, effects = report.verdict, report.check.excitation.effects
    coloured = [one.signal for one in residual_tests if one.rating == "coloured"]
    lines = []
    if coloured:
        lines.append(f"{', '.join(coloured)}: what is left is not noise alone")
    if verdict.verdict == "ambiguous":
        lines.append("more than one effect explains it: see what to record to be sure")
    if verdict.verdict == "effect":
        rivals = ", ".join(sentences.format_effect(one) for one in verdict.ambiguous_with)
        nearest = f"nearly as good: {rivals}" if rivals else "no rival that was fitted comes close"
        lines.append(nearest)
    findings = [text for severity, text in format_findings(report.findings) if severity != "note"]
    lines.append(findings[0].replace("`", "") if findings else "nothing odd in the recordings")
    lacking = sum(not one.is_testable for one in effects)
    if lacking:
        lines.append(
            f"{lacking} of {len(effects)} effects are hardly testable with these recordings"
        )
    return lines
