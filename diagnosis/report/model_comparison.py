"""Model comparison: the base and the final model on one set of recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.per_recording_parameters import reestimate_per_recording
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.validation.whiteness import WhitenessTest, innovation_whiteness
from diagnosis.validation.worst_window import (
    FreeRuns,
    WorstWindow,
    find_worst_window,
    simulate_free_runs,
)
from language.loading.recording_map_reader import column_dimension
from language.overlays.name_types import format_si_unit


@dataclass(frozen=True)
class ModelComparison:
    """The worst window and the whiteness tests of both models on one set of recordings."""

    dataset: str
    label: str
    runs: FreeRuns = field(repr=False)
    units: tuple[str, ...]
    window: WorstWindow = field(repr=False)
    before: tuple[WhitenessTest, ...] = field(repr=False)
    after: tuple[WhitenessTest, ...] = field(repr=False)


def compare_models(report: DiagnosisReport) -> list[ModelComparison]:
    """Return the comparison on held-out recordings (if any), then on training recordings.

    Parameters per recording are fitted to held-out recordings.
    """
    found = report.diagnosis
    if found is None:
        return []
    base, model = found.selection.base, found.selection.model
    sets = [_compare_on(report, "train", "training", base, model, found.model_set.series)]
    if found.held_out:
        held = found.held_out
        both = reestimate_per_recording(base, held), reestimate_per_recording(model, held)
        sets.insert(0, _compare_on(report, "held_out", "held-out", *both, held))
    return sets


def _compare_on(
    report: DiagnosisReport,
    dataset: str,
    label: str,
    base: Estimate,
    model: Estimate,
    series: Sequence[SampledRecording],
) -> ModelComparison:
    """Return the comparison of two models on one set of recordings."""
    runs = simulate_free_runs(base, model, series)
    columns = {one.compare: one for one in report.case.mapping.columns.values()}
    units = tuple(format_si_unit(column_dimension(columns[name])) for name in runs.signals)
    period = float(series[0].period)
    window = find_worst_window(runs, units, label)
    white = [tuple(innovation_whiteness(one, period)) for one in (base, model)]
    return ModelComparison(dataset, label, runs, units, window, *white)
