"""Column hypothesis: columns with a wrong clock or sign, found by the prediction error.

A column that is shifted in time or negated, and then predicted far better, has that error. Unknown
loads, wrong parameters and missing physics increase the errors in both cases.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from statistics import median

import numpy as np

from codegen.toolchain.compiler import BuildError
from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import (
    SampledRecording,
    compared_outputs,
    resample,
    sample_windows,
    share_period,
)
from diagnosis.data_quality.finding import Finding
from diagnosis.estimation.estimate import Estimate, evaluate
from diagnosis.estimation.innovations import measured_noise_levels, predict_at_points
from diagnosis.estimation.model_set import ModelSet, balance_disturbances
from diagnosis.estimation.noise_level import disturbance_units
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import vector_of
from engine.recordings.recording import Recording, split_by_windows
from language.model.automaton import Automaton
from language.model.system import ColumnMapping, RecordingMap
from language.overlays.expand_document import Project
from language.text.diagnostic import MissingToolError, SpecError
from language.text.document import Document

MAX_LAG, LAG_STEP = 0.48, 0.04
"""Largest offset that is tried, and the distance of trials [s]."""
MIN_LAG = 0.1
"""Smallest offset [s] that is an error; actuators and sensors have smaller lags."""
MIN_GAIN, MIN_GAIN_PER_SAMPLE = 100.0, 0.2
"""Log-likelihood gain [nats] that a correction needs in a recording, and the gain per sample."""
HARMLESS_GAIN_FACTOR = 1.5
"""Factor by which the gain must exceed that of a small lag or of an unused input."""
OTHER_COLUMN_FACTOR = 1.15
"""The same for another column: a late torque and an early speed have similar effects."""
SHARED_FRACTION = 0.6
"""Fraction of the erroneous recordings that must agree for an error to apply to all."""
CLOCK_TOLERANCE = 0.06
"""Lags within this distance [s] are the same offset."""
HIGH_PASS_TIME = 0.4
"""Window [s] of the moving mean that is removed from innovations: slow parts carry no timing."""
UNUSED_FACTOR = 1e-6
"""Factor that makes an input nearly 0 but keeps its sign, to test the model without it."""


@dataclass(frozen=True)
class ColumnHypothesis:
    """A column (inputs, then outputs) advanced by `lag` [s] and negated (-1) or unused (0)."""

    column: int
    lag: float = 0.0
    factor: int = 1

    @property
    def is_error(self) -> bool:
        """Whether the change is a negation or a lag of at least `MIN_LAG` (0.1 s)."""
        return self.factor < 0 or abs(self.lag) >= MIN_LAG

    def is_similar(self, other: ColumnHypothesis) -> bool:
        """Return whether column and factor are equal and lags differ by at most 0.06 s."""
        near = abs(self.lag - other.lag) <= CLOCK_TOLERANCE
        return near and (self.column, self.factor) == (other.column, other.factor)


def find_clock_and_sign_errors(
    document: Document,
    project: Project,
    automaton: Automaton,
    mapping: RecordingMap,
    recordings: Sequence[Recording],
) -> list[Finding] | None:
    """Return errors on clocks and signs, or None if the model cannot be used.

    Windows that cannot be sampled are left out. None if no window remains, or the model does not
    compile or cannot be linearised.
    """
    seen = compared_outputs(mapping, automaton)
    sampled: list[SampledRecording] = []
    for piece in (piece for recording in recordings for piece in split_by_windows(recording)):
        with suppress(ValueError, KeyError):
            sampled += sample_windows(piece, mapping, automaton, seen)
    if not sampled:
        return None
    series: list[SampledRecording] = []
    for one in share_period(sampled):
        with suppress(ValueError):
            series += resample([one], automaton, seen, False)
    if not series:
        return None
    drifts = balance_disturbances(document, automaton)
    model_set = ModelSet(document, project, automaton, (), tuple(series), seen, drifts)
    try:
        found = find_column_errors(model_set.compile_candidate(()), series)
    except (SpecError, MissingToolError, BuildError, ValueError, OSError):
        return None
    names = [*automaton.inputs, *seen]
    columns = {column.to or column.compare: column for column in mapping.columns.values()}
    return [_to_finding(recording, columns[names[one.column]], one) for recording, one in found]


def _to_finding(recording: str, column: ColumnMapping, error: ColumnHypothesis) -> Finding:
    """Return the finding for an error of a column."""
    called = f"input `{column.name}`" if column.to else f"`{column.name}`"
    if error.factor < 0:
        text = f"{called} has the wrong sign: it moves against what the model gives"
        return Finding("sign", recording, column.name, text, "error")
    way = "late" if error.lag > 0.0 else "early"
    text = f"the clock of {called} is {abs(error.lag):.2f} s {way}"
    return Finding("clock_offset", recording, column.name, text, "error")


def find_column_errors(
    candidate: Candidate, series: Sequence[SampledRecording]
) -> list[tuple[str, ColumnHypothesis]]:
    """Return one error of all recordings (""), else at most one error of each recording, by name.

    Recordings not longer than four times `MAX_LAG` are left out. The error of a recording is its
    clearest hypothesis (`_clearest_hypothesis`), if it is similar to the others of that column. A
    common error is clear in the sum of gains, and similar to those of two recordings, a third of
    all and `SHARED_FRACTION` of those with an error.
    """
    series = [one for one in series if float(one.period) * one.count > 4.0 * MAX_LAG]
    if not series:
        return []
    gains = hypothesis_gains(candidate, series)
    min_gains = [max(MIN_GAIN, MIN_GAIN_PER_SAMPLE * one.count) for one in series]
    own = [
        _clearest_hypothesis({hypothesis: float(g[k]) for hypothesis, g in gains.items()}, least)
        for k, least in enumerate(min_gains)
    ]
    whole = {hypothesis: float(np.sum(g[np.isfinite(g)])) for hypothesis, g in gains.items()}
    shared = _clearest_hypothesis(whole, sum(min_gains)) if len(series) > 1 else None
    errors = [one for one in own if one]
    similar = [one for one in errors if shared and one.is_similar(shared)]
    least = max(2.0, len(series) / 3.0)
    if shared and len(similar) > SHARED_FRACTION * len(errors) and len(similar) >= least:
        lag = median(one.lag for one in similar)
        return [("", dataclasses.replace(shared, lag=lag))]
    return [  # different errors of a column indicate missing physics
        (one.name, own_error)
        for own_error, one in zip(own, series, strict=True)
        if own_error
        if all(e.is_similar(own_error) for e in errors if e.column == own_error.column)
    ]


def hypothesis_gains(
    candidate: Candidate, series: Sequence[SampledRecording]
) -> Mapping[ColumnHypothesis, Reals]:
    """Return the log-likelihood gain [nats] of each hypothesis in each recording (recordings,).

    Hypotheses are lags to `MAX_LAG` in steps of `LAG_STEP`, negations, and inputs not used;
    constant inputs are not tested. The gain is -inf where the model diverges.
    """
    inputs = series[0].inputs.shape[1]
    moving_inputs = [
        k for k in range(inputs) if all(float(s.inputs[:, k].std()) > 0.0 for s in series)
    ]
    seen = range(inputs, inputs + series[0].measured.shape[1])
    reference = [apply_hypothesis(one, ColumnHypothesis(0)) for one in series]
    base = _evaluate_declared(candidate, reference)
    before = _high_pass_costs(base, reference)
    count = round(MAX_LAG / LAG_STEP)
    lags = [k * LAG_STEP for k in range(-count, count + 1) if k]
    hypotheses = [ColumnHypothesis(k, lag) for k in (*moving_inputs, *seen) for lag in lags]
    hypotheses += [ColumnHypothesis(k, factor=-1) for k in (*moving_inputs, *seen)]
    hypotheses += [ColumnHypothesis(k, factor=0) for k in moving_inputs]
    found = {}
    for hypothesis in hypotheses:
        right = [apply_hypothesis(one, hypothesis) for one in series]
        model = base if hypothesis.factor == 1 else _evaluate_declared(candidate, right)
        after = _high_pass_costs(model, right)
        known = np.isfinite(before) & np.isfinite(after)
        found[hypothesis] = np.full(len(series), -np.inf)
        found[hypothesis][known] = before[known] - after[known]
    return found


def apply_hypothesis(series: SampledRecording, hypothesis: ColumnHypothesis) -> SampledRecording:
    """Return a recording with a hypothesis applied to its column, without `MAX_LAG` at both ends.

    The lag is rounded to samples; `start` of the result is still that of the recording.
    """
    margin = round(MAX_LAG / float(series.period))
    late = round(hypothesis.lag / float(series.period))
    inside = slice(margin, series.count - margin)
    moved = slice(inside.start + late, inside.stop + late)
    factor = hypothesis.factor or UNUSED_FACTOR
    inputs, measured = series.inputs[inside].copy(), series.measured[inside].copy()
    column, count = hypothesis.column, inputs.shape[1]
    if column < count:
        inputs[:, column] = factor * series.inputs[moved, column]
    else:
        measured[:, column - count] = factor * series.measured[moved, column - count]
    return dataclasses.replace(series, inputs=inputs, measured=measured)


def _evaluate_declared(candidate: Candidate, series: Sequence[SampledRecording]) -> Estimate:
    """Return the declared model with disturbances that let it follow the recordings."""
    process = disturbance_units(candidate, series, {})
    noise_levels = dataclasses.replace(measured_noise_levels(series, {}), process=process)
    return evaluate(candidate, series, noise_levels, vector_of(candidate, len(series), {}))


def _high_pass_costs(model: Estimate, series: Sequence[SampledRecording]) -> Reals:
    """Return -log L [nats] (recordings,) of high-pass innovations, inf for a diverged run."""
    values, found = [model.values(0)] * len(series), []
    (there,) = predict_at_points(
        model.candidate, series, [values], model.gains, model.noise_levels.huber_limits
    )
    for one, done, missed, counts in zip(
        series, there.done.tolist(), there.by_recording, there.counts, strict=True
    ):
        quick = _high_pass(missed, float(one.period))
        spread = np.log(np.maximum(np.nanmean(quick**2, axis=0), 1e-300))
        whole = done == one.count
        found.append(float(np.sum(0.5 * counts * spread)) if whole else np.inf)
    return np.array(found)


def _high_pass(innovations: Reals, period: float) -> Reals:
    """Return innovations (samples, outputs) without their moving mean."""
    width = max(1, round(HIGH_PASS_TIME / period))
    known = np.where(np.isfinite(innovations), innovations, 0.0)
    kernel = np.ones(width) / width
    slow = np.array([np.convolve(column, kernel, mode="same") for column in known.T]).T
    found: Reals = innovations - slow
    return found


def _clearest_hypothesis(
    gains: Mapping[ColumnHypothesis, float], min_gain: float
) -> ColumnHypothesis | None:
    """Return the hypothesis of largest gain if it is a clear error, else None.

    Its gain must reach `min_gain` and exceed the gains of harmless changes and of other columns by
    their factors.
    """
    best = max(gains, key=lambda one: gains[one])
    if not best.is_error or gains[best] < min_gain:
        return None
    small = max([0.0, *[gain for one, gain in gains.items() if not one.is_error]])
    other = max([0.0, *[gain for one, gain in gains.items() if one.column != best.column]])
    least = max(HARMLESS_GAIN_FACTOR * small, OTHER_COLUMN_FACTOR * other)
    return best if gains[best] > least else None
