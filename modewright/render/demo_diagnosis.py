"""Demo diagnosis: print a verdict beside the truth, and the misfits before and after."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from diagnosis.report.report_text import format_headline
from diagnosis.result.verdict import replace_non_finite
from modewright.api.demo_data import DemoDiagnosis, DemoMachine
from modewright.runtime.json_format import format_entry


def print_demo_diagnosis(screen: Console, found: DemoDiagnosis, folder: Path) -> None:
    """Print truth, verdict, misfits and the command that repeats the diagnosis.

    `folder` contains the demo data and the results.
    """

    def line(text: str) -> None:
        screen.print(text, highlight=False, markup=False, soft_wrap=True)

    line(f"concealed: {'; '.join(_format_truth(one) for one in found.truth)}")
    line(f"verdict:   {format_headline(found.report).replace('`', '')}")
    line(f"right:     {'yes' if found.is_right else 'no'}")
    screen.print()
    screen.print(_misfit_table(found))
    line(f"\nreport:    {folder / found.machine.results / 'report.html'}")
    line(f"again:     {repeat_command(found.machine, folder)}")


def repeat_command(machine: DemoMachine, folder: Path) -> str:
    """Return the command line that repeats the diagnosis of a machine."""
    train = f"recordings/{machine.folder}/train_*.csv"
    return (
        f"cd {folder} && modewright diagnose {machine.spec} --train {train} "
        f"--held-out {machine.held_out} --out {machine.results}"
    )


def demo_diagnosis_json(found: DemoDiagnosis, folder: Path) -> dict[str, Any]:
    """Return the verdict with the truth as a dict for JSON.

    The keys are format, machine, spec, concealed, is_right, verdict and report.
    """
    return {
        **format_entry("demo"),
        "machine": found.machine.folder,
        "spec": found.machine.spec,
        "concealed": [replace_non_finite(one) for one in found.truth],
        "is_right": found.is_right,
        "verdict": found.report.verdict.to_json(),
        "report": str(folder / found.machine.results / "report.html"),
    }


def _format_truth(effect: dict[str, Any]) -> str:
    """Return a true effect with its place and its parameters of the simulation."""
    values = ", ".join(f"{name} = {value:.4g}" for name, value in effect["parameters"].items())
    return f"{effect['id'].replace('_', ' ')} at {effect['place']} ({values})"


def _misfit_table(found: DemoDiagnosis) -> Table:
    """Return the table of the misfits of free simulation before and after, for each signal."""
    table = Table(
        "misfit of free simulation", "signal", "before", "after", box=None, pad_edge=False,
        header_style="bold",
    )  # fmt: skip
    for part, signals in found.report.verdict.fit.items():
        for name, one in signals.items():
            before, after = f"{100 * one.nrmse_before:.3g} %", f"{100 * one.nrmse_after:.3g} %"
            table.add_row(f"{part.replace('_', ' ')} recordings", name, before, after)
    return table
