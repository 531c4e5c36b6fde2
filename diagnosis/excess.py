"""Excess: the innovations at a place as a regression problem, with a column for each term."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from codegen.runs import Prediction
from diagnosis.bench import Bench
from diagnosis.companion import turning
from diagnosis.estimate import Estimate, with_normal
from diagnosis.evidence import inflation
from diagnosis.probe import Probe, probe_of
from diagnosis.regression import Columns, Problem, problem_of
from diagnosis.scale import holes_of
from diagnosis.term import Signals, Term, terms_of
from language.known import Known, unit_text
from language.units import Dimension

Reals = NDArray[np.float64]
PART = 0.1
"""Size of a disturbance that a term is tried with, in SI: small beside all that acts."""


@dataclass(frozen=True)
class Excess:
    """What is missing at a place: the regression `problem`, and `terms` with their `columns`."""

    problem: Problem = field(repr=False)
    terms: tuple[Term, ...] = field(repr=False)
    columns: tuple[Columns, ...] = field(repr=False)


def excess_at(bench: Bench, model: Estimate, section: str, place: str) -> Excess:
    """Return what the innovations of a model ask for at a place. Raises SpecError."""
    probe = probe_of(bench, section, place, model)
    quiet = [np.zeros(one.count) for one in bench.series]
    runs = probe.run(quiet)
    before = probe.innovations(runs)
    weigh = _Weights(model, before)
    signals = _signals(bench, probe, runs)
    shown = holes_of(bench, section, place).get("y", "") if section == "outputs" else ""
    terms = tuple(terms_of(signals, section, shown))
    model = model if model.columns else with_normal(model, bench.series)
    parameters = _parameters(model, weigh)
    waves: list[tuple[Reals, ...]] = []
    columns: list[Columns] = []
    free = parameters[0].shape[1]
    for term in terms:
        waves += [_answer(probe, before, values, weigh) for values in term.values]
        places = tuple(range(free, free + len(term.values)))
        columns.append(Columns(term.name, places, term.has_own))
        free += len(places)
    rows = [np.stack(one, axis=1) for one in zip(*waves, strict=True)]
    shrink = inflation(model, bench.series)
    problem = problem_of(weigh.flat(before), parameters, rows, shrink)
    return Excess(problem, terms, tuple(columns))


class _Weights:
    """Innovations over their standard deviations; those far out count less (Huber 1964)."""

    def __init__(self, model: Estimate, innovations: Sequence[Reals]) -> None:
        size = np.sqrt(model.outcome.variances)
        limits = model.outcome.limits
        self.weights = [
            np.where(np.isfinite(e), 1.0 / np.sqrt(np.maximum(np.abs(e) / limits, 1.0)), 0.0) / size
            for e in innovations
        ]

    def flat(self, values: Sequence[Reals]) -> tuple[Reals, ...]:
        pairs = zip(values, self.weights, strict=True)
        return tuple((np.nan_to_num(one) * weight).reshape(-1) for one, weight in pairs)


def _answer(
    probe: Probe, before: Sequence[Reals], values: Sequence[Reals], weigh: _Weights
) -> tuple[Reals, ...]:
    """Return how the innovations fall where some values act, of each recording."""
    size = float(np.sqrt(np.mean(np.concatenate(values) ** 2))) or 1.0
    after = probe.missed([one * (PART / size) for one in values])
    moved = [(a - b) * (size / PART) for a, b in zip(before, after, strict=True)]
    return weigh.flat(moved)


def _parameters(model: Estimate, weigh: _Weights) -> tuple[Reals, ...]:
    """Return how the innovations fall with each parameter (samples * seen, parameters)."""
    columns = [
        weigh.flat([-model.columns[name][part] for part in model.outcome.parts])
        for name in model.candidate.names
    ]
    return tuple(np.stack(one, axis=1) for one in zip(*columns, strict=True))


def _signals(bench: Bench, probe: Probe, runs: Sequence[Prediction]) -> Signals:
    """Return what formulas may read: states, inputs, torques and twists of elements."""
    predictor = probe.candidate.predictor
    known = Known(bench.document.root)
    values: dict[str, list[Reals]] = {}
    for name in bench.automaton.states:
        column = predictor.states.index(name)
        values[name] = [one.states[:, column] for one in runs]
    for column, name in enumerate(bench.automaton.inputs):
        values[name] = [one.inputs[:, column] for one in bench.series]
    for name in probe.torques:
        column = predictor.seen.index(name)
        values[name] = [one.seen[:, column] for one in runs]
    stretches = []
    for name, element in bench.automaton.elements.items():
        if element.kind == "elastic":
            twist = holes_of(bench, "elements", name).get("twist", "")
            gap = holes_of(bench, "elements", name).get("gap", "")
            if twist in values and gap in values:
                text = f"({twist} - {gap})"
                values[text] = [a - b for a, b in zip(values[twist], values[gap], strict=True)]
                stretches.append(text)
            elif twist in values:
                stretches.append(twist)
    units = {}
    for name in values:
        kind = known.kind(name.strip("()").split(" ")[0])
        units[name] = unit_text(kind) if isinstance(kind, Dimension) else "1"
    speeds = tuple(layer.place for layer in bench.drifts if layer.place in values)
    forces = {units[name] for name in probe.torques} | {"N*m", "N"}
    torques = (*(name for name in bench.automaton.inputs if units[name] in forces), *probe.torques)
    rates = tuple(name for name in turning(bench) if name in values)
    period = float(bench.period)
    return Signals(values, units, speeds, torques, tuple(stretches), rates, period)
