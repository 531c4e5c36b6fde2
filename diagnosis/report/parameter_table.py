"""Parameter table: declared, recalibrated and final values of each parameter as texts."""

from __future__ import annotations

from diagnosis.estimation.covariance import quantities_of
from diagnosis.pipeline.parameter_fit import parameter_note
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.number_text import format_change, format_with_std
from diagnosis.selection.forward_selection import Selection
from language.text.document import MappingNode
from language.text.node_edit import mapping_entries

MIN_BIAS, MIN_BIAS_STDS, MAX_BIASED = 0.03, 3.0, 5
"""Relative bias and standard deviations from which parameters are biased; how many are named."""


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
