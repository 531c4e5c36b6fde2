"""Summary cards: four short answers at the top of a report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from diagnosis.data_quality.finding import format_findings
from diagnosis.report import report_text as sentences
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.number_text import format_change, format_percent, format_probability
from diagnosis.report.tables import location_rows
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.forward_selection import Selection
from diagnosis.validation.whiteness import WhitenessTest

MAX_LINES = 4


@dataclass(frozen=True)
class Card:
    """A question and its answer in lines."""

    title: str
    lines: tuple[str, ...]


def summary_cards(
    report: DiagnosisReport, residual_tests: Sequence[WhitenessTest] = ()
) -> list[Card]:
    """Return the cards on location, confidence, improvement and caveats that have lines.

    `residual_tests` are those of the final model.
    """
    if report.diagnosis is None:
        return []
    selection = report.diagnosis.selection
    cards = [
        _location_card(report),
        _confidence_card(report, selection),
        _improvement_card(report),
        _caveat_card(report, residual_tests),
    ]
    return [card for card in cards if card.lines]


def _location_card(report: DiagnosisReport) -> Card:
    """Return the card on where physics is missing."""
    verdict = report.verdict
    named = verdict.effects or verdict.ambiguous_with
    lines = [sentences.format_effect(one) for one in named]
    if verdict.verdict == "unknown":
        lines = [f"most at {one.path}" for one in verdict.location[:1] if one.gain > 0.0]
    if not lines:
        return Card("Where", ("nowhere: no place asks for more than the model has",))
    rows = dict(location_rows(verdict.location[0], 2)) if verdict.location else {}
    lines = [*dict.fromkeys(lines)][:MAX_LINES]
    lines += [f"{words} {rows[words]}" for words in ("by mode", "strongest in") if words in rows]
    return Card("Where", tuple(lines))


def _confidence_card(report: DiagnosisReport, selection: Selection) -> Card:
    """Return the card on probabilities, gains and the confirmation."""
    fitted = [one for one in selection.first_round if one.is_fitted]
    count = f"{len(selection.first_round)} candidates, {len(fitted)} fitted in full"
    lines = []
    if selection.accepted:
        shares = selection.probabilities()
        for one in (selection.accepted[0], *selection.rivals):
            if one.placed_effect.id in shares:
                share = format_probability(shares[one.placed_effect.id])
                lines.append(f"{share} probable: {one.placed_effect.id}")
        lines += [f"best of {count}", *(_format_gain(one) for one in selection.accepted)]
        lines.append(f"{report.case.thresholds.text} nats are needed")
    else:
        lines.append(f"none of {count}, gains enough")
        if fitted:
            lines.append(f"best: {_format_gain(max(fitted, key=lambda one: one.gain))}")
            lines.append(f"{report.case.thresholds.text} nats are needed")
    confirmed = {
        True: "better on recordings that were held out, too",
        False: "not better on recordings that were held out",
        None: "",
    }[report.verdict.confirmed]
    return Card("How sure", (*lines, confirmed) if confirmed else tuple(lines))


def _format_gain(candidate_fit: CandidateFit) -> str:
    """Return the gain and the explained share of a candidate as text."""
    one, share = candidate_fit, 100.0 * max(candidate_fit.share, 0.0)
    return f"{one.placed_effect.id}: {one.gain:.0f} nats, explains {share:.0f} %"


def _improvement_card(report: DiagnosisReport) -> Card:
    """Return the card on the misfits, of held-out recordings if there are any."""
    fit = report.verdict.fit
    part = "held_out" if fit.get("held_out") else "train"
    lines = []
    has_model = bool(report.diagnosis and report.diagnosis.selection.accepted)
    for name, one in fit.get(part, {}).items():
        line = f"{name}: {format_percent(one.nrmse_before)}"
        if has_model:
            moved = format_change(one.nrmse_before, one.nrmse_after)
            line += f" \N{RIGHTWARDS ARROW} {format_percent(one.nrmse_after)} ({moved})"
        lines.append(line)
    title = "How much better" if has_model else "How well it fits"
    words = "held-out" if part == "held_out" else "training"
    return Card(title, (f"misfit of free simulation, {words} recordings", *lines))


def _caveat_card(report: DiagnosisReport, residual_tests: Sequence[WhitenessTest]) -> Card:
    """Return the card on residuals, rivals, findings and excitation."""
    verdict = report.verdict
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
    lines += [findings[0].replace("`", "")] if findings else ["nothing odd in the recordings"]
    lacking = sum(not one.is_testable for one in report.check.excitation.effects)
    if lacking:
        whole = len(report.check.excitation.effects)
        lines.append(f"{lacking} of {whole} effects are hardly testable with these recordings")
    return Card("Keep in mind", tuple(lines[:MAX_LINES]))
