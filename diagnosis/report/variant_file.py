"""Variant file: the result of a diagnosis as a variant of the base, for all commands."""

from __future__ import annotations

import json
from collections.abc import Mapping

from codegen.toolchain.templates import product_version
from diagnosis.estimation.covariance import quantities_of
from diagnosis.estimation.quantity import Quantity
from diagnosis.model.parameter import format_value
from diagnosis.model.placed_effect import automaton_with_effects, effect_names
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.report_text import format_two_digits
from diagnosis.selection.forward_selection import Selection
from language.model.automaton import Automaton
from language.overlays.effect_reader import Effect
from language.overlays.expand_document import read_document
from language.text.document import MappingNode
from language.text.node_edit import mapping_entries

NAME_SUFFIX = "_diagnosed"
MAX_NAME_LENGTH = 31
MIN_RELATIVE_CHANGE = 1e-6
"""Relative change below which a parameter is not written."""


def variant_name(base: str, suffix: str = NAME_SUFFIX) -> str:
    """Return a base's name, cut so that it has `MAX_NAME_LENGTH` (31) characters with a suffix."""
    return base[: MAX_NAME_LENGTH - len(suffix)] + suffix


def format_variant(report: DiagnosisReport, extends: str) -> str:
    """Return the variant as YAML text; `extends` is the name or the file of the base.

    It has the changed parameters and the accepted effects in SI, with notes as comments.
    """
    lines = [
        "language: 1",
        f"variant: {variant_name(report.name)}",
        f"extends: {extends}",
        f"about: {json.dumps(_about_text(report), ensure_ascii=False)}",
    ]
    if report.diagnosis is None:
        return "\n".join(lines) + "\n"
    lines += [f"# {text}" for text in missing_effect_notes(report)]
    selection = report.diagnosis.selection
    fitted = quantities_of(selection.model)
    lines += _parameter_lines(report.automaton, fitted)
    lines += _effect_lines(report, selection, fitted)
    return "\n".join(lines) + "\n"


def missing_effect_notes(report: DiagnosisReport) -> list[str]:
    """Return a sentence on each of `missing_effects`, which a variant finds by name."""
    where = "has to be below spec/: the variant finds this effect by name"
    return [f"{effect.body.span.source.name} {where}" for effect in missing_effects(report)]


def missing_effects(report: DiagnosisReport) -> list[Effect]:
    """Return the accepted effects that the project does not have with the same lines."""
    project = report.case.project
    accepted = report.diagnosis.selection.accepted if report.diagnosis else ()
    found = []
    for effect in (tried.placed_effect.effect for tried in accepted):
        own = effect.body.span.source
        files = [read_document(path) for path in project.effect_index.get(effect.name, ())]
        if not any(file.source.lines == own.lines for file in files):
            found.append(effect)
    return found


def _about_text(report: DiagnosisReport) -> str:
    """Return the description of the variant: verdict, effects and recordings."""
    verdict = report.verdict
    found = [f"{one.id}@{one.place}" for one in verdict.effects]
    outcome = ", ".join([verdict.verdict, *found])
    files = ", ".join(f"{name} {digest}" for name, digest in verdict.inputs.items())
    return f"diagnosed by modewright {product_version()}: {outcome}; fitted to {files}"


def _parameter_lines(automaton: Automaton, fitted: Mapping[str, Quantity]) -> list[str]:
    """Return the lines of changed parameters."""
    lines = []
    for name, quantity in fitted.items():
        parameter = automaton.parameters.get(name)
        if parameter is None or parameter.value is None:
            continue
        was = float(parameter.value)
        if abs(quantity.value - was) > MIN_RELATIVE_CHANGE * abs(was):
            text = format_value(quantity.value, parameter)
            note = f"sd {format_two_digits(quantity.std)}, declared {was:.6g}"
            lines.append(f"  {name}: {{value: {text}}}  # {note}")
    return ["parameters:", *lines] if lines else []


def _effect_lines(
    report: DiagnosisReport, selection: Selection, fitted: Mapping[str, Quantity]
) -> list[str]:
    """Return the lines of the accepted effects with their fitted values.

    A parameter per recording has its mean. Multiples of a magnitude that are not fitted are written
    too: a variant has no recordings.
    """
    if not selection.accepted:
        return []
    model, lines = selection.model, ["effects:"]
    each = [model.values(k) for k in range(len(model.point.per_recording))]
    parameters = automaton_with_effects(
        report.case.document, report.case.project, model.candidate.placed_effects
    ).parameters
    for one in (tried.placed_effect for tried in selection.accepted):
        own_names, values = effect_names(one), []
        for final, quantity in fitted.items():
            if final not in own_names or final not in parameters:
                continue
            text = format_value(quantity.value, parameters[final])
            note = f"sd {format_two_digits(quantity.std)}"
            if parameters[final].fitting.per == "recording":
                note = "mean of " + ", ".join(f"{known[final]:.4g}" for known in each)
            values.append(f"      {own_names[final]}: {text}  # {note}")
        for entry in mapping_entries(one.effect.body.get("parameters")):
            final = one.qualified_name(entry.key)
            is_scaled = isinstance(entry.node, MappingNode) and "scale" in entry.node.entries
            if is_scaled and final not in fitted and final in parameters:
                value = parameters[final].value
                assert value is not None
                text = format_value(float(value), parameters[final])
                values.append(f"      {entry.key}: {text}  # from the recordings")
        if values:
            lines += [f"  {one.id}:  # {one.effect.about}", "    values:", *values]
        else:
            lines.append(f"  {one.id}: {{}}")
    return lines
