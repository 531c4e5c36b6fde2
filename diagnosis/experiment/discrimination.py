"""Plan: the manoeuvre that would tell candidates apart - each drives it, the other foresees it.

What one candidate would show is foreseen by another, with its observer and its parameters moved as
far as the recordings that there are let them: half the squares that remain, over its innovations'
variances, are the nats by which the first would be preferred.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.innovations import KalmanGains, predict
from diagnosis.estimation.jacobian import STEP
from diagnosis.estimation.model_set import ModelSet
from diagnosis.experiment.manoeuvre import Manoeuvre, manoeuvres_for
from diagnosis.model.parameter_vector import ParameterVector, vector_of

Reals = NDArray[np.float64]
MAX_CANDIDATES = 3
"""Candidates that are told apart pair by pair."""
MIN_LOG_BAYES_FACTOR = 20.0
"""Nats below which a manoeuvre would tell nothing."""


@dataclass(frozen=True)
class CandidateExperiment:
    """A manoeuvre with the nats by which it would tell the two nearest candidates apart, and what
    each candidate would show: `shown` (samples, seen) in the order of the plan's names.
    """

    manoeuvre: Manoeuvre
    log_bayes_factor: float
    outputs: tuple[Reals, ...] = field(repr=False)


@dataclass(frozen=True)
class ExperimentPlan:
    """Candidates by name, and the options, the best first."""

    names: tuple[str, ...]
    options: tuple[CandidateExperiment, ...]

    @property
    def is_discriminating(self) -> bool:
        """Whether the best manoeuvre would tell the candidates apart."""
        return bool(self.options) and self.options[0].log_bayes_factor >= MIN_LOG_BAYES_FACTOR

    def format_sentence(self) -> str:
        """Return what to record, in one sentence."""
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
    """Return the plan for two or more fitted candidates; None where nothing can be planned."""
    some = list(candidates)[:MAX_CANDIDATES]
    if len(some) < 2:
        return None
    options = []
    for manoeuvre in manoeuvres_for(model_set):
        shown = [_simulate_outputs(model, manoeuvre.series) for _, model in some]
        if any(one is None for one in shown):
            continue
        runs = [one for one in shown if one is not None]
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
    """Return what a model shows of a manoeuvre (samples, seen); None where it does not run."""
    gains = KalmanGains(model.gains.transient[:0], np.zeros_like(model.gains.steady_state))
    run = predict(
        model.candidate, [series], [model.values(0)], gains, model.noise_levels.huber_limits
    )
    return run.predictions[0].outputs if run.is_complete else None


def _expected_log_bayes_factor(
    model: Estimate, recorded: Sequence[SampledRecording], series: SampledRecording, outputs: Reals
) -> float:
    """Return the nats by which a model would fail to foresee what another one shows."""
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
    """Return the innovations over their standard deviations (samples * seen,)."""
    values = {
        one.name: one.value(float(point.shared[k]))
        for k, one in enumerate(model.candidate.free_parameters)
    }
    run = predict(model.candidate, [record], [values], model.gains, model.noise_levels.huber_limits)
    if not run.is_complete:
        return None
    size = np.sqrt(model.prediction.variances)
    return np.asarray((run.innovations[0] / size).reshape(-1), dtype=np.float64)
