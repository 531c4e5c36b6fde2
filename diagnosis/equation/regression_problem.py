"""Regression problem: innovations at a place, and the response of innovations to each term."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from codegen.predictor.predictor_arrays import Prediction
from diagnosis.criterion.effective_sample_size import integrated_autocorrelation
from diagnosis.data.array_types import Reals
from diagnosis.equation.disturbance_response import DisturbanceResponse, build_disturbance_response
from diagnosis.equation.forward_regression import RegressionProblem, TermColumns, build_problem
from diagnosis.equation.term_library import LibraryTerm, Signals, generate_terms
from diagnosis.estimation.estimate import Estimate, with_normal_equations
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.place_magnitude import place_bindings
from diagnosis.localisation.correlate import angle_rates
from language.expressions.units import Dimension
from language.overlays.name_types import TreeTypes, format_si_unit

TEST_DISTURBANCE = 0.1
"""Size [SI] of the disturbance in a test of a term, small relative to what acts."""


@dataclass(frozen=True)
class EquationRegression:
    """The regression problem at a place, and its terms with their columns."""

    problem: RegressionProblem = field(repr=False)
    terms: tuple[LibraryTerm, ...] = field(repr=False)
    columns: tuple[TermColumns, ...] = field(repr=False)


def regression_at(
    model_set: ModelSet, model: Estimate, section: str, place: str
) -> EquationRegression:
    """Return the regression of innovations on the terms of `generate_terms` at a place.

    Responses to terms and parameters are weighted by inverse standard deviations and Huber weights.
    Raises SpecError if no disturbance can be placed there.
    """
    probe = build_disturbance_response(model_set, section, place, model)
    zero_disturbance = [np.zeros(one.count) for one in model_set.series]
    runs = probe.predict(zero_disturbance)
    before = probe.innovations_of(runs)
    weigh = _HuberWeights(model, before)
    output = place_bindings(model_set, section, place).get("y", "") if section == "outputs" else ""
    signals = _formula_signals(model_set, probe, runs, {output: place} if output else {})
    terms = tuple(generate_terms(signals, section, output))
    model = model if model.jacobian else with_normal_equations(model, model_set.series)
    parameters = _parameter_responses(model, weigh)
    waves: list[tuple[Reals, ...]] = []
    columns: list[TermColumns] = []
    free = parameters[0].shape[1]
    for term in terms:
        waves += [_weighted_response(probe, before, values, weigh) for values in term.values]
        places = tuple(range(free, free + len(term.values)))
        columns.append(TermColumns(term.name, places, term.has_recording_coefficients))
        free += len(places)
    rows = [np.stack(one, axis=1) for one in zip(*waves, strict=True)]
    autocorrelation = integrated_autocorrelation(model, model_set.series)
    problem = build_problem(weigh.weight_and_flatten(before), parameters, rows, autocorrelation)
    return EquationRegression(problem, terms, tuple(columns))


class _HuberWeights:
    """Inverse standard deviations times sqrt(limit / |e|) beyond the limit (Huber 1964), or 0."""

    def __init__(self, model: Estimate, innovations: Sequence[Reals]) -> None:
        size = np.sqrt(model.prediction.variances)
        limits = model.prediction.huber_limits
        self.weights = [
            np.where(np.isfinite(e), 1.0 / np.sqrt(np.maximum(np.abs(e) / limits, 1.0)), 0.0) / size
            for e in innovations
        ]

    def weight_and_flatten(self, values: Sequence[Reals]) -> tuple[Reals, ...]:
        """Return weighted values of each recording as vectors (samples * outputs,)."""
        pairs = zip(values, self.weights, strict=True)
        return tuple((np.nan_to_num(one) * weight).reshape(-1) for one, weight in pairs)


def _weighted_response(
    response: DisturbanceResponse,
    before: Sequence[Reals],
    values: Sequence[Reals],
    weights: _HuberWeights,
) -> tuple[Reals, ...]:
    """Return the weighted decrease of innovations per unit of a disturbance, by recording."""
    size = float(np.sqrt(np.mean(np.concatenate(values) ** 2))) or 1.0
    runs = response.predict([one * (TEST_DISTURBANCE / size) for one in values])
    after = response.innovations_of(runs)
    moved = [(a - b) * (size / TEST_DISTURBANCE) for a, b in zip(before, after, strict=True)]
    return weights.weight_and_flatten(moved)


def _parameter_responses(model: Estimate, weights: _HuberWeights) -> tuple[Reals, ...]:
    """Return the weighted decreases per coordinate, (samples * outputs, parameters) each."""
    slices = model.prediction.slices
    columns = [
        weights.weight_and_flatten([-model.jacobian[name][part] for part in slices])
        for name in model.candidate.names
    ]
    if not columns:
        return tuple(np.empty((weight.size, 0)) for weight in weights.weights)
    return tuple(np.stack(one, axis=1) for one in zip(*columns, strict=True))


def _formula_signals(
    model_set: ModelSet,
    response: DisturbanceResponse,
    runs: Sequence[Prediction],
    sources: Mapping[str, str],
) -> Signals:
    """Return the signals that formulas may read: states, inputs, element torques and twists.

    `sources` gives the compared output that has the values of a further name, such as an equation.
    """
    predictor, automaton = response.candidate.predictor, model_set.automaton
    known = TreeTypes(model_set.document.root)
    values: dict[str, list[Reals]] = {}
    for name in automaton.states:
        column = predictor.states.index(name)
        values[name] = [one.states[:, column] for one in runs]
    for column, name in enumerate(automaton.inputs):
        values[name] = [one.inputs[:, column] for one in model_set.series]
    for name in response.element_torques:
        column = predictor.outputs.index(name)
        values[name] = [one.outputs[:, column] for one in runs]
    for name, output in sources.items():
        column = predictor.outputs.index(output)
        values.setdefault(name, [one.outputs[:, column] for one in runs])
    stretches = []
    for name, element in automaton.elements.items():
        if element.kind == "elastic":
            bindings = place_bindings(model_set, "elements", name)
            twist, gap = bindings.get("twist", ""), bindings.get("gap", "")
            if twist in values and gap in values:
                text = f"({twist} - {gap})"
                values[text] = [a - b for a, b in zip(values[twist], values[gap], strict=True)]
                stretches.append(text)
            elif twist in values:
                stretches.append(twist)
    units = {}
    for name in values:
        kind = known.type_of_name(name.strip("()").split(" ")[0])
        units[name] = format_si_unit(kind) if isinstance(kind, Dimension) else "1"
    speeds = tuple(one.place for one in model_set.disturbances if one.place in values)
    forces = {units[name] for name in response.element_torques} | {"N*m", "N"}
    driven = [name for name in automaton.inputs if units[name] in forces]
    torques = (*driven, *response.element_torques)
    rates = tuple(name for name in angle_rates(model_set) if name in values)
    period = float(model_set.period)
    return Signals(values, units, speeds, torques, tuple(stretches), rates, period)
