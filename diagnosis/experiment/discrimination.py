"""Discriminating experiment: the manoeuvre that separates candidates best (T-optimality).

One candidate predicts the outputs of another one, after its parameters have moved as far as the
recordings allow. Half the remaining squares over the variances is the expected log Bayes factor
[nats] (Atkinson, Fedorov 1975).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.innovations import KalmanGains, predict
from diagnosis.estimation.jacobian import STEP
from diagnosis.estimation.model_set import ModelSet
from diagnosis.experiment.manoeuvre import Manoeuvre, manoeuvres_for
from diagnosis.model.parameter_vector import ParameterVector, values_at, vector_of

MAX_CANDIDATES = 3
"""Number of candidates that are compared pair by pair."""
MIN_LOG_BAYES_FACTOR = 20.0
"""Log Bayes factor [nats] from which a manoeuvre discriminates."""


@dataclass(frozen=True)
class CandidateExperiment:
    """A manoeuvre with its smallest expected log Bayes factor [nats] of all pairs.

    `outputs` (samples, outputs) are those of each candidate.
    """

    manoeuvre: Manoeuvre
    log_bayes_factor: float
    outputs: tuple[Reals, ...] = field(repr=False)


@dataclass(frozen=True)
class ExperimentPlan:
    """The names of the candidates and the manoeuvres, the most discriminating first."""

    names: tuple[str, ...]
    options: tuple[CandidateExperiment, ...]

    @property
    def is_discriminating(self) -> bool:
        """Whether an option reaches `MIN_LOG_BAYES_FACTOR` (20 nats)."""
        return bool(self.options) and self.options[0].log_bayes_factor >= MIN_LOG_BAYES_FACTOR

    def format_sentence(self) -> str:
        """Return what to record to tell the candidates apart, in one sentence."""
        names = " from ".join((self.names[0], " and ".join(self.names[1:])))
        if not self.is_discriminating:
            return f"no manoeuvre that was tried would tell {names}"
        best = self.options[0]
        return (
            f"to tell {names}, record: {best.manoeuvre.name} "
            f"({best.log_bayes_factor:.0f} nats expected, {MIN_LOG_BAYES_FACTOR:.0f} are enough)"
        )


def plan_experiment(
    model_set: ModelSet, candidates: Sequence[tuple[str, Estimate]]
) -> ExperimentPlan | None:
    """Return the plan for the first `MAX_CANDIDATES` (3) of the named, fitted candidates.

    Manoeuvres in which a candidate diverges are left out. None below two candidates or without a
    manoeuvre.
    """
    some = list(candidates)[:MAX_CANDIDATES]
    if len(some) < 2:
        return None
    options = []
    for manoeuvre in manoeuvres_for(model_set):
        simulated = [_simulate_outputs(model, manoeuvre.series) for _, model in some]
        runs = [run for run in simulated if run is not None]
        if len(runs) < len(some):
            continue
        nats = [
            _expected_log_bayes_factor(model, model_set.series, manoeuvre.series, run)
            for k, (_, model) in enumerate(some)
            for j, run in enumerate(runs)
            if j != k
        ]
        options.append(CandidateExperiment(manoeuvre, min(nats), tuple(runs)))
    options.sort(key=lambda option: -option.log_bayes_factor)
    return ExperimentPlan(tuple(name for name, _ in some), tuple(options)) if options else None


def _simulate_outputs(model: Estimate, series: SampledRecording) -> Reals | None:
    """Return the outputs of a model under a manoeuvre without correction; None if it diverges."""
    gains = KalmanGains(model.gains.transient[:0], np.zeros_like(model.gains.steady_state))
    run = predict(
        model.candidate, [series], [model.values(0)], gains, model.noise_levels.huber_limits
    )
    return run.predictions[0].outputs if run.is_complete else None


def _expected_log_bayes_factor(
    model: Estimate, recorded: Sequence[SampledRecording], series: SampledRecording, outputs: Reals
) -> float:
    """Return the expected log Bayes factor [nats] against a model for another one's outputs.

    The parameters move by one Gauss-Newton step, with the information of `recorded` as prior. The
    result is 0 if the model diverges.
    """
    record = dataclasses.replace(series, measured=np.ascontiguousarray(outputs))
    point = vector_of(model.candidate, 1, model.values(0))
    before = _normalised_innovations(model, record, point)
    if before is None:
        return 0.0
    columns = []
    for k in range(len(model.candidate.free_parameters)):
        ahead = point.perturb(model.candidate, k, STEP)
        size = float(ahead.shared[k] - point.shared[k])
        after = _normalised_innovations(model, record, ahead)
        columns.append(np.zeros_like(before) if after is None else (after - before) / size)
    normal = model.normal_equations
    assert normal is not None
    information = np.eye(len(columns))
    shared = ~normal.own
    information[np.ix_(shared, shared)] += np.sum(normal.a, axis=0)[np.ix_(shared, shared)]
    jacobian = np.stack(columns, axis=1)
    right = jacobian.T @ before
    moved = np.linalg.solve(information + jacobian.T @ jacobian, right)
    effective_fraction = 1.0 / integrated_autocorrelation(model, recorded)
    return 0.5 * effective_fraction * float(before @ before - right @ moved)


def _normalised_innovations(
    model: Estimate, record: SampledRecording, point: ParameterVector
) -> Reals | None:
    """Return innovations over standard deviations (samples * outputs,); None if diverged."""
    values = values_at(model.candidate, point, 0)
    run = predict(model.candidate, [record], [values], model.gains, model.noise_levels.huber_limits)
    if not run.is_complete:
        return None
    size = np.sqrt(model.prediction.variances)
    return np.asarray((run.innovations[0] / size).reshape(-1), dtype=np.float64)
