"""Reproduction: the worst window as a scenario, and commands that use the result."""

from __future__ import annotations

import json
import math
import shlex
from pathlib import Path

import numpy as np

from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.model_comparison import ModelComparison
from diagnosis.report.variant_file import missing_effects, variant_name
from language.model.automaton import Automaton
from language.overlays.name_types import format_si_unit

VARIANT = "variant.yaml"
WINDOW = "window.csv"
SCENARIO = "scenario.yaml"


def format_window_csv(automaton: Automaton, comparison: ModelComparison) -> str:
    """Return `t_s`, inputs, recorded outputs and both simulations of a window as CSV in SI."""
    window, seen = comparison.window, comparison.signals
    names = ["t_s", *automaton.inputs, *seen]
    names += [f"{name}_{word}" for word in ("without", "with") for name in seen]
    runs = window.runs[0], window.runs[-1]
    rows = [
        ",".join(f"{value:.9g}" if math.isfinite(value) else "" for value in row)
        for row in np.column_stack([window.times, window.inputs, window.measured, *runs])
    ]
    return "\n".join([",".join(names), *rows]) + "\n"


def format_scenario(report: DiagnosisReport, comparison: ModelComparison) -> str:
    """Return the YAML of a scenario that runs `variant.yaml` through `window.csv`.

    Inputs are held between samples; compared states start at their first recorded value.
    """
    automaton = report.automaton
    starts = [f"{n}: column({n})" for n in comparison.signals if n in automaton.states]
    lines = [
        "language: 1",
        f"scenario: {variant_name(report.name, '_window')}",
        f"of: {VARIANT}",
        f"about: {json.dumps(comparison.window.title, ensure_ascii=False)}",
        "horizon: recording",
        "recording:",
        f"  file: {WINDOW}",
        "  time: {column: t_s, unit: s}",
        "  columns:",
    ]
    for name, one in automaton.inputs.items():
        unit = format_si_unit(one.unit.dimension)
        lines.append(f"    {name}: {{to: {name}, unit: {unit}, hold: previous}}")
    for name, unit in zip(comparison.signals, comparison.units, strict=True):
        lines.append(f"    {name}: {{compare: {name}, unit: {unit}, blank: skip}}")
    if starts:
        lines.append(f"initial: {{{', '.join(starts)}}}")
    return "\n".join(lines) + "\n"


def reproduction_commands(report: DiagnosisReport, folder: Path) -> list[tuple[str, str]]:
    """Return a description and a shell command for each use of the variant in `folder`."""
    variant, scenario = (shlex.quote(str(folder / name)) for name in (VARIANT, SCENARIO))
    found = [
        *_effect_copy_commands(report, folder),
        ("look for problems", f"modewright check {variant}"),
    ]
    if report.diagnosis is not None:
        run = f"{variant} -s {scenario}"
        found += [
            ("simulate the worst window", f"modewright simulate {run} --plot run.png"),
            ("print it as C", f"modewright generate {variant} --out build"),
            ("compare engine and C, bit by bit", f"modewright lockstep {run}"),
            ("list what differs", f"modewright explain {report.name} {variant}"),
        ]
    return found


def _effect_copy_commands(report: DiagnosisReport, folder: Path) -> list[tuple[str, str]]:
    """Return commands that copy missing effects into the project."""
    formula = report.diagnosis.equation if report.diagnosis else None
    own = formula.formula.placed_effect.effect.name if formula else ""
    found = []
    for effect in missing_effects(report):
        file = folder / f"{own}.yaml" if effect.name == own else effect.body.span.source.name
        found.append(("copy its effect below spec/", f"cp {shlex.quote(str(file))} spec/"))
    return found


def report_command(report: DiagnosisReport, folder: Path) -> str:
    """Return the `modewright diagnose` command that makes this report, quoted for a shell."""
    words = ["modewright", "diagnose", report.name]
    for path in report.case.train:
        words += ["--train", str(path)]
    for path in report.case.held_out:
        words += ["--held-out", str(path)]
    return shlex.join([*words, "--out", str(folder)])
