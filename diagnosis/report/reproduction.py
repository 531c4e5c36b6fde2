"""Reproduction: the worst window as a scenario, and commands that use the result."""

from __future__ import annotations

import json
import math
import shlex
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.variant_file import missing_effects, variant_name
from diagnosis.validation.worst_window import WorstWindow
from language.overlays.name_types import format_si_unit

VARIANT = "variant.yaml"
WINDOW = "window.csv"
SCENARIO = "scenario.yaml"


def format_window_csv(window: WorstWindow, inputs: Mapping[str, str]) -> str:
    """Return `t_s`, inputs, recorded outputs and both simulations of a window as CSV in SI."""
    seen = window.signals
    names = ["t_s", *inputs, *seen]
    names += [f"{name}_{word}" for word in ("without", "with") for name in seen]
    parts = (window.times[:, None], window.inputs, window.measured, window.before, window.after)
    rows = [
        ",".join(f"{value:.9g}" if math.isfinite(value) else "" for value in row)
        for row in np.concatenate(parts, axis=1)
    ]
    return "\n".join([",".join(names), *rows]) + "\n"


def format_scenario(report: DiagnosisReport, window: WorstWindow) -> str:
    """Return the YAML of a scenario that runs `variant.yaml` through `window.csv`.

    Inputs are held between samples; compared states start at their first recorded value.
    """
    automaton = report.automaton
    fed = {name: format_si_unit(one.unit.dimension) for name, one in automaton.inputs.items()}
    lines = [
        "language: 1",
        f"scenario: {variant_name(report.name, '_window')}",
        f"of: {VARIANT}",
        f"about: {json.dumps(window.title, ensure_ascii=False)}",
        "horizon: recording",
        "recording:",
        f"  file: {WINDOW}",
        "  time: {column: t_s, unit: s}",
        "  columns:",
    ]
    lines += [f"    {n}: {{to: {n}, unit: {unit}, hold: previous}}" for n, unit in fed.items()]
    starts = []
    for name, unit in zip(window.signals, window.units, strict=True):
        lines.append(f"    {name}: {{compare: {name}, unit: {unit}, blank: skip}}")
        if name in automaton.states:
            starts.append(f"{name}: column({name})")
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
