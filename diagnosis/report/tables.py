"""Tables: the rows of the tables of a report, cells as texts."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from diagnosis.estimation.covariance import quantities_of
from diagnosis.localisation.location import Location
from diagnosis.localisation.location_text import MIN_CORRELATION
from diagnosis.pipeline.parameter_fit import parameter_note
from diagnosis.report import report_text as sentences
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.model_comparison import ModelComparison
from diagnosis.report.number_text import (
    format_change,
    format_percent,
    format_probability,
    format_significant,
    format_with_std,
)
from diagnosis.selection.forward_selection import Selection
from language.text.document import MappingNode
from language.text.node_edit import mapping_entries

Cell = tuple[str, str, str, str]
"""A misfit before and after, its change, and the trend: `better`, `worse` or `same`."""

MAX_WINDOWS = 6

MIN_BIAS, MIN_BIAS_STDS, MAX_BIASED = 0.03, 3.0, 5
"""Relative bias and standard deviations from which parameters are biased; how many are named."""

CHANGE_TOLERANCE = 0.02
"""Relative change of a misfit below which it is unchanged."""


def misfit_rows(
    report: DiagnosisReport, comparison: ModelComparison
) -> list[tuple[str, str, list[Cell], bool]]:
    """Return recording, set, misfits [SI] by signal, and whether it is the sum, of each recording.

    The sum row of normalised misfits is the last one.
    """
    first, last = comparison.models[0].rms, comparison.models[-1].rms
    rows = []
    for name, *errors in zip(comparison.recordings, first, last, strict=True):
        cells = [
            misfit_cell(float(a), float(b), format_significant)
            for a, b in zip(*errors, strict=True)
        ]
        rows.append((name, comparison.label, cells, False))
    whole = report.verdict.fit.get(comparison.dataset, {}).values()
    sums = [misfit_cell(m.nrmse_before, m.nrmse_after, format_percent) for m in whole]
    return [*rows, ("all together, over the spread of the signal", comparison.label, sums, True)]


def misfit_cell(before: float, after: float, text: Callable[[float], str]) -> Cell:
    """Return the cell of a misfit; `text` formats its values. An unknown change is no trend."""
    is_known = before > 0.0 and math.isfinite(after)
    part = after / before - 1.0 if is_known else 0.0
    trend = "same" if abs(part) < CHANGE_TOLERANCE else "better" if part < 0.0 else "worse"
    return text(before), text(after), format_change(before, after), trend


def candidate_rows(report: DiagnosisReport, selection: Selection) -> list[dict[str, Any]]:
    """Return the rows of fitted candidates: accepted ones, then the others of the first round.

    They have `effect`, `place`, `gain`, `share`, `probability`, `reason` and `is_accepted`; `bar`
    is the gain in per cent of the largest one.
    """
    ids = {one.placed_effect.id for one in selection.accepted}
    first = [one for one in selection.first_round if one.placed_effect.id not in ids]
    listed = [one for one in (*selection.accepted, *first) if one.is_fitted]
    most = max([one.gain for one in listed] + [1.0])
    probabilities = selection.probabilities()
    accepted_reasons = {
        "ambiguous": "best, but not separated from others: applied in the model shown here",
        "unknown": "a formula, no effect of the library: applied in the model shown here",
    }
    rows = []
    for rank, one in enumerate(listed):
        own = one.placed_effect
        probability = probabilities.get(own.id)
        effect, _, place = sentences.candidate_title(own, report).partition("@")
        reason = sentences.format_reason(one, rank, selection, report.case.thresholds)
        if own.id in ids:
            reason = accepted_reasons.get(report.verdict.verdict, reason)
        rows.append(
            {
                "effect": effect,
                "place": place,
                "gain": f"{one.gain:.0f}" if math.isfinite(one.gain) else "diverges",
                "share": f"{100.0 * max(one.share, 0.0):.0f} %",
                "probability": "" if probability is None else format_probability(probability),
                "bar": 100.0 * max(one.gain, 0.0) / most,
                "reason": reason,
                "is_accepted": own.id in ids,
            }
        )
    return rows


def unfitted_candidates(
    report: DiagnosisReport, selection: Selection
) -> list[tuple[str, list[str]]]:
    """Return the reasons why candidates of the first round were not fitted, with their names."""
    found: dict[str, list[str]] = {}
    ids = {one.placed_effect.id for one in selection.accepted}
    for tried in selection.first_round:
        if not tried.is_fitted and tried.placed_effect.id not in ids:
            why = sentences.format_reason(tried, 0, selection, report.case.thresholds)
            found.setdefault(why, []).append(sentences.candidate_title(tried.placed_effect, report))
    return list(found.items())


def location_rows(location: Location, max_windows: int = MAX_WINDOWS) -> list[tuple[str, str]]:
    """Return windows, modes and correlates of a location as pairs of heading and text."""
    modes = sorted(location.modes.items(), key=lambda pair: -pair[1])
    shares = [f"{name} {format_percent(share)}" for name, share in modes if share >= 0.005]
    shares = shares if len(modes) > 1 else []
    windows = [f"{file} {start:.2f}-{end:.2f} s" for start, end, file in location.windows]
    more = len(windows) - max_windows
    window_text = ", ".join(windows[:max_windows]) + (f" and {more} more" if more > 0 else "")
    known = [(name, r) for name, r in location.correlates if abs(r) >= MIN_CORRELATION]
    along = [f"{name} (correlation {r:.2f})" for name, r in known]
    texts = window_text, ", ".join(shares), ", ".join(along)
    headings = "strongest in", "by mode", "goes along with"
    return [row for row in zip(headings, texts, strict=True) if row[1]]


def recording_rows(report: DiagnosisReport) -> list[tuple[str, ...]]:
    """Return name, use, length, rate, lost samples and findings of each checked recording."""
    check = report.check
    rows: list[tuple[str, ...]] = []
    for name in dict.fromkeys(one.recording for one in check.channels):
        channels = [one for one in check.channels if one.recording == name]
        length = max(one.end for one in channels) - min(one.start for one in channels)
        rates = sorted({round(one.rate) for one in channels if math.isfinite(one.rate)})
        lost = max(one.dropped for one in channels)
        found = [one.severity for one in check.findings if one.recording == name]
        worst = ", ".join(f"{found.count(s)} {s}" for s in ("error", "warning") if s in found)
        is_unused = report.diagnosis is None or name in report.unused_recordings
        used = "not used" if is_unused else "training"
        rate = "-".join(f"{rate}" for rate in (rates[:1] + rates[1:][-1:]))
        missing = format_percent(lost) if lost else "none"
        rows.append((name, used, f"{length:.1f} s", f"{rate} Hz", missing, worst or "none"))
    return rows


def split_code_spans(text: str) -> list[tuple[str, bool]]:
    """Return the parts of a sentence between back quotes, with whether each was quoted."""
    return [(part, place % 2 == 1) for place, part in enumerate(text.split("`"))]


def parameter_rows(report: DiagnosisReport, selection: Selection) -> list[tuple[str, ...]]:
    """Return the rows of the parameters of the final model.

    They have name, unit, declared, recalibrated and final value, change, description and note.
    """
    before, after = quantities_of(selection.base), quantities_of(selection.model)
    effect_abouts = {
        tried.placed_effect.qualified_name(entry.key): entry.node.text_of("about")
        for tried in selection.accepted
        for entry in mapping_entries(tried.placed_effect.effect.body.get("parameters"))
        if isinstance(entry.node, MappingNode)
    }
    coordinates = {one.name: one for one in selection.model.candidate.free_parameters}
    rows: list[tuple[str, ...]] = []
    for name, now in after.items():
        declared = report.automaton.parameters.get(name)
        value = None if declared is None or declared.value is None else float(declared.value)
        rows.append(
            (
                name,
                "" if now.unit == "1" else now.unit,
                "new" if value is None else f"{value:.5g}",
                format_with_std(before[name].value, before[name].std) if name in before else "",
                format_with_std(now.value, now.std),
                format_change(value, now.value) if value is not None and value > 0.0 else "",
                _about_of(report, name) or effect_abouts.get(name, ""),
                parameter_note(now, coordinates[name]),
            )
        )
    return rows


def format_biased_parameters(selection: Selection) -> str:
    """Return `name +12 %, ...`: how far the fit without effects moves parameters."""
    before, after = quantities_of(selection.base), quantities_of(selection.model)
    found = []
    for name, one in before.items():
        now = after.get(name)
        if now is None or now.value <= 0.0 or one.value <= 0.0:
            continue
        part = one.value / now.value - 1.0
        if abs(part) >= MIN_BIAS and abs(one.value - now.value) > MIN_BIAS_STDS * now.std:
            found.append((abs(part), f"{name} {format_change(now.value, one.value)}"))
    return ", ".join(text for _, text in sorted(found, reverse=True)[:MAX_BIASED])


def _about_of(report: DiagnosisReport, name: str) -> str:
    """Return the text of `about` of a parameter of the spec; "" if there is none."""
    table = report.case.document.root.get("parameters")
    entry = table.get(name) if isinstance(table, MappingNode) else None
    return entry.text_of("about") if isinstance(entry, MappingNode) else ""


def format_fixed_parameters(report: DiagnosisReport) -> list[str]:
    """Return `name = value` [SI] of each real parameter without a range."""
    return [
        f"{name} = {float(one.value):.5g}"
        for name, one in report.automaton.parameters.items()
        if one.range is None and one.value is not None and one.type == "real"
    ]
