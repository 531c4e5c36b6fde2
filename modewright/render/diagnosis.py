"""Diagnosis output: print verdicts and fits."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

from diagnosis.model.parameter import in_unit
from diagnosis.pipeline.parameter_fit import STRONG_CORRELATION, Fit
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.report.report_text import format_two_digits, summary_lines
from diagnosis.result.verdict import replace_non_finite
from modewright.runtime.json_format import format_entry


def print_diagnosis(screen: Console, report: DiagnosisReport) -> None:
    """Print the lines of `summary_lines` for a diagnosis, without backticks."""
    for line in summary_lines(report):
        screen.print(line.replace("`", ""), highlight=False, markup=False, soft_wrap=True)


def print_fit(screen: Console, fit: Fit) -> None:
    """Print a table of the fitted parameters, then misfits, strong correlations and other notes.

    Values are in declared units. Misfits are those of free simulation before and after the fit.
    Correlations are printed from STRONG_CORRELATION on. Parameters that the data do not determine
    are named last.
    """
    table = Table(
        "parameter", "declared", "fitted", "std", "unit", "of prior", "goes with", "",
        box=None, pad_edge=False, header_style="bold",
    )  # fmt: skip
    for one in fit.parameters:
        goes = (
            f"{one.strongest_correlation[0]} {one.strongest_correlation[1]:+.2f}"
            if one.strongest_correlation
            else ""
        )
        unit, quantity = fit.automaton.parameters[one.name].unit, one.quantity
        table.add_row(
            one.name, f"{in_unit(one.declared, unit):.5g}", f"{in_unit(quantity.value, unit):.5g}",
            format_two_digits(quantity.std / float(unit.factor)), unit.text,
            f"{one.prior_ratio:.0%}", goes, one.note,
        )  # fmt: skip
    screen.print(table)
    for name, misfit in fit.misfits.items():
        text = f"misfit of free simulation, {name}: {misfit.nrmse_before:.2%} as declared, "
        screen.print(text + f"{misfit.nrmse_after:.2%} as fitted", highlight=False)
    for (first, second), value in fit.correlations.items():
        if abs(value) >= STRONG_CORRELATION:
            text = f"hardly told apart: {first} and {second}, correlation {value:+.2f}"
            screen.print(text, highlight=False)
    if fit.undetermined:
        names = ", ".join(fit.undetermined)
        screen.print(f"these data do not determine {names}: the prior does", highlight=False)


def fit_json(fit: Fit) -> dict[str, Any]:
    """Return a fit as a dict for JSON; values in SI, numbers that are not finite are null.

    The keys are of, parameters, correlations, undetermined, misfits and inputs.
    """
    found = {
        **format_entry("fit"),
        "of": fit.automaton.name,
        "parameters": {
            one.name: {
                "declared": one.declared,
                "value": one.quantity.value,
                "std": one.quantity.std,
                "unit": one.quantity.unit,
                "of_prior": one.prior_ratio,
                "note": one.note,
            }
            for one in fit.parameters
        },
        "correlations": [[*pair, value] for pair, value in fit.correlations.items()],
        "undetermined": list(fit.undetermined),
        "misfits": {name: vars(misfit) for name, misfit in fit.misfits.items()},
        "inputs": dict(fit.inputs),
    }
    return dict(replace_non_finite(found))
