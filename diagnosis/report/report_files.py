"""Report page: the files of a diagnosis - verdict, variant, figures and one HTML page."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

from codegen.toolchain.compiler import BuildError, compiler_version
from codegen.toolchain.templates import product_version, render_html
from diagnosis.data_quality.finding import format_findings
from diagnosis.model.compile_cache import node_text
from diagnosis.model.effect_library import equation_changes
from diagnosis.model.placed_effect import shipped_effects
from diagnosis.report import report_text as sentences, tables
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.figures import embed_svg, report_figures
from diagnosis.report.model_comparison import ModelComparison, compare_models
from diagnosis.report.number_text import format_percent, format_probability, format_significant
from diagnosis.report.reproduction import (
    SCENARIO,
    WINDOW,
    format_scenario,
    format_window_csv,
    report_command,
    reproduction_commands,
)
from diagnosis.report.summary_cards import summary_cards
from language.text.diagnostic import MissingToolError

REPORT = __name__.rpartition(".")[0]
"""The package of the report's templates."""
DIGEST_LENGTH = 16
"""Hexadecimal digits of SHA-256 that are shown."""


def provenance_rows(report: DiagnosisReport) -> list[tuple[str, str, str]]:
    """Return use, name and digest of spec, map, effects and each recording."""
    case = report.case
    effects = case.effects if case.effects is not None else shipped_effects()
    library = "\n".join(f"{one.name} {node_text(one.body)}" for one in effects)
    columns = "\n".join(case.mapping.span.source.lines)
    spec = _text_digest(node_text(case.document.root))
    found = [
        ("spec, with all that it extends", report.name, spec),
        ("map of columns", case.mapping.name, _text_digest(columns) if columns else ""),
        ("effects", f"{len(effects)} of them", _text_digest(library)),
    ]
    found += [("training", name, digest) for name, digest in report.verdict.inputs.items()]
    found += [("held out", name, digest) for name, digest in report.held_out.items()]
    return found


def _text_digest(text: str) -> str:
    """Return the first digits of the SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()[:DIGEST_LENGTH]


def tool_versions() -> str:
    """Return `modewright 1.0, Python 3.11.2, numpy 2.1, scipy 1.14, gcc ...`."""
    try:
        compiler = compiler_version().partition(": ")[2]
    except (BuildError, MissingToolError):
        compiler = "no C compiler"
    python = f"Python {platform.python_version()}"
    libraries = [f"{name} {metadata.version(name)}" for name in ("numpy", "scipy")]
    return ", ".join([f"modewright {product_version()}", python, *libraries, compiler])


def report_files(report: DiagnosisReport, variant: str, folder: Path = Path()) -> dict[str, bytes]:
    """Return the contents of all files of a diagnosis by name; `verdict.json` is the last one.

    `variant` is the text of the variant file, `folder` the one that commands on the page name.
    """
    comparisons = compare_models(report)
    figures = report_figures(report, comparisons) if comparisons else []
    files = {"variant.yaml": variant.encode()}
    if report.diagnosis and report.diagnosis.equation:
        formula = report.diagnosis.equation.formula
        files[f"{formula.placed_effect.effect.name}.yaml"] = formula.text.encode()
    for one in figures:
        files[f"{one.name}.svg"] = one.picture.data("svg")
        files[f"{one.name}.png"] = one.picture.data("png")
    if comparisons:
        files[WINDOW] = format_window_csv(report.automaton, comparisons[0]).encode()
        files[SCENARIO] = format_scenario(report, comparisons[0]).encode()
    context = {
        **_verdict_context(report),
        **_model_context(report, comparisons),
        "unread": report.diagnosis.unread if report.diagnosis else (),
        "findings": [
            (severity, tables.split_code_spans(text))
            for severity, text in format_findings(report.findings)
        ],
        "recordings": tables.recording_rows(report),
        "untestable": report.check.excitation.untestable,
        "fixed": tables.format_fixed_parameters(report),
        "thresholds": report.case.thresholds,
        "commands": reproduction_commands(report, folder),
        "made_by": report_command(report, folder),
        "tools": tool_versions(),
        "sources": provenance_rows(report),
        "variant": variant,
        "drawings": {one.name: one for one in figures},
        "svg": {one.name: embed_svg(one, files[f"{one.name}.svg"]) for one in figures},
    }
    files["report.html"] = render_html((REPORT,), "report.html.jinja", context).encode()
    verdict = json.dumps(report.verdict.to_json(), indent=2, allow_nan=False) + "\n"
    files["verdict.json"] = verdict.encode()
    return files


def _verdict_context(report: DiagnosisReport) -> dict[str, Any]:
    """Return the values of the template for the verdict and the changed equations."""
    verdict, found = report.verdict, report.diagnosis
    placed_effects = [one.placed_effect for one in found.selection.accepted] if found else []
    effects = [one.effect for one in placed_effects]
    return {
        "name": report.name,
        "about": report.case.document.root.text_of("about"),
        "verdict": verdict,
        "has_model": bool(placed_effects),
        "laid": [placed_effect.id for placed_effect in placed_effects],
        "headline": tables.split_code_spans(sentences.format_headline(report)),
        "location": sentences.format_missing_location(report),
        "messages": verdict.messages,
        "abouts": [(one.name.replace("_", " "), one.about, one.signature) for one in effects],
        "changes": equation_changes(report.case.document, placed_effects),
        "places": tables.location_rows(verdict.location[0]) if verdict.location else [],
        "rivals": [sentences.format_effect(one) for one in verdict.ambiguous_with],
        "separation": sentences.format_separation(report),
    }


def _model_context(
    report: DiagnosisReport, comparisons: Sequence[ModelComparison]
) -> dict[str, Any]:
    """Return the values of the template for cards, misfits, candidates, parameters, residuals."""
    if report.diagnosis is None:
        return dict.fromkeys(("cards", "fit", "candidates", "parameters"))
    selection, first = report.diagnosis.selection, comparisons[0]
    return {
        "cards": summary_cards(report, first.models[-1].whiteness),
        "compared": first,
        "noise": [format_significant(float(sd), 2) for sd in selection.base.noise_levels.outputs],
        "significant": format_significant,
        "percent": format_percent,
        "fit": [row for one in comparisons for row in tables.misfit_rows(report, one)],
        "candidates": tables.candidate_rows(report, selection),
        "unfitted": tables.unfitted_candidates(report, selection),
        "other": format_probability(report.verdict.other),
        "parameters": tables.parameter_rows(report, selection),
        "astray": tables.format_biased_parameters(selection),
    }
