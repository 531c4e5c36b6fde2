"""Model comparison: the base and the final model on a set of recordings, and its worst window."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.per_recording_parameters import reestimate_per_recording
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.validation.free_simulation import (
    OBSERVED_TIME,
    WINDOW_TIME,
    is_free,
    output_stds,
    simulate_free,
)
from diagnosis.validation.whiteness import WhitenessTest, innovation_whiteness
from language.loading.recording_map_reader import column_dimension
from language.overlays.name_types import format_si_unit


@dataclass(frozen=True)
class ComparedModel:
    """A model on a set of recordings: `label` is `without` or `with` effects, or `recalibrated`.

    `rms` are the errors [SI] of free simulation in each recording (outputs,), `whiteness` the tests
    of the innovations.
    """

    label: str
    rms: Sequence[Reals]
    whiteness: Sequence[WhitenessTest]


@dataclass(frozen=True)
class WorstWindow:
    """A window: times [s] (n,), `inputs` (n, inputs) and outputs (n, outputs) in SI.

    The models run freely from `free_from` [s]; `runs` are their outputs.
    """

    title: str
    free_from: float
    times: Reals
    inputs: Reals
    measured: Reals
    runs: tuple[Reals, ...]


@dataclass(frozen=True)
class ModelComparison:
    """The base, then the final model if effects are accepted (`models`), on a set of recordings.

    `dataset` is the key of the set in the verdict, `label` its name in words.
    """

    dataset: str
    label: str
    recordings: tuple[str, ...]
    signals: tuple[str, ...]
    units: tuple[str, ...]
    models: tuple[ComparedModel, ...] = field(repr=False)
    window: WorstWindow = field(repr=False)


def compare_models(report: DiagnosisReport) -> list[ModelComparison]:
    """Return the comparison on held-out recordings (if any), then on training recordings.

    Parameters per recording are fitted to held-out recordings.
    """
    found = report.diagnosis
    if found is None:
        return []
    base, model = found.selection.base, found.selection.model
    estimates = {"without": base, "with": model}
    if not found.selection.accepted:
        estimates = {"recalibrated": base}
    sets = [_compare_on(report, "train", "training", estimates, found.model_set.series)]
    if found.held_out:
        held_out = {n: reestimate_per_recording(e, found.held_out) for n, e in estimates.items()}
        sets.insert(0, _compare_on(report, "held_out", "held-out", held_out, found.held_out))
    return sets


def _compare_on(
    report: DiagnosisReport,
    dataset: str,
    label: str,
    estimates: Mapping[str, Estimate],
    series: Sequence[SampledRecording],
) -> ModelComparison:
    """Return the comparison of models, by their labels, on one set of recordings."""
    runs = [simulate_free(one, series) for one in estimates.values()]
    models = tuple(
        ComparedModel(
            name,
            [rms_of_free_parts(*pair) for pair in zip(series, run, strict=True)],
            innovation_whiteness(one, float(series[0].period)),
        )
        for (name, one), run in zip(estimates.items(), runs, strict=True)
    )
    names = tuple(one.name for one in series)
    signals = tuple(next(iter(estimates.values())).candidate.predictor.outputs)
    columns = {one.compare: one for one in report.case.mapping.columns.values()}
    units = tuple(format_si_unit(column_dimension(columns[name])) for name in signals)
    window = _find_worst_window(series, runs, label)
    return ModelComparison(dataset, label, names, signals, units, models, window)


def _find_worst_window(
    series: Sequence[SampledRecording], runs: Sequence[Sequence[Reals]], label: str
) -> WorstWindow:
    """Return the window with the largest sum of normalised squared errors of the base, `runs[0]`.

    Windows are adjacent and `WINDOW_TIME` long; errors after `OBSERVED_TIME` count. `label` names
    the set of recordings in the title.
    """
    scale = output_stds(series)
    most, worst, window = -1.0, 0, slice(0)
    for r, one in enumerate(series):
        observed, whole = one.sample_count(OBSERVED_TIME), one.sample_count(WINDOW_TIME)
        for start in range(0, max(1, one.count - observed - 1), whole):
            end = min(one.count, start + whole)
            alone = slice(start + observed, end)
            missed = (one.measured[alone] - runs[0][r][alone]) / scale
            squares = float(np.nansum(missed**2))
            if squares > most:
                most, worst, window = squares, r, slice(start, end)
    one = series[worst]
    times = float(one.start) + np.arange(window.start, window.stop) * float(one.period)
    return WorstWindow(
        f"worst window of the {label} recordings: {one.name}, {times[0]:.4g} to {times[-1]:.4g} s",
        float(one.start) + (window.start + one.sample_count(OBSERVED_TIME)) * float(one.period),
        times,
        one.inputs[window],
        one.measured[window],
        tuple(run[worst][window] for run in runs),
    )


def rms_of_free_parts(series: SampledRecording, run: Reals) -> Reals:
    """Return the error [SI] of a run in the free parts of a recording (outputs,) or NaN."""
    errors = (series.measured - run)[is_free(series)]
    counts = np.sum(np.isfinite(errors), axis=0)
    squares = np.sum(np.where(np.isfinite(errors), errors, 0.0) ** 2, axis=0)
    return np.asarray(np.where(counts > 0, np.sqrt(squares / np.maximum(counts, 1)), np.nan))
