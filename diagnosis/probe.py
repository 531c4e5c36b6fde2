"""Probe: how the innovations of a model answer to a known disturbance at one place.

The disturbance is put in through a drift that is measured without noise: what is prescribed is
what acts. So each term of a formula is tried by one run, with the observer as it is.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from codegen.runs import Prediction, Recorded
from diagnosis.bench import Bench
from diagnosis.candidate import Candidate, candidate
from diagnosis.estimate import Estimate
from diagnosis.joined import burnt, joined
from diagnosis.layers import DRIFT, Layer, drift
from diagnosis.scale import KINDS
from diagnosis.series import Series
from language.document import Document, Entry, Scalar, Table
from language.element import outputs_as_mapping
from language.model import Automaton
from language.syntax import Name

Reals = NDArray[np.float64]


@dataclass(frozen=True)
class Probe:
    """A model that can be disturbed at one place: its observer has the gains of `model`.

    Its signals are those compared, then `torques` of elements, then the disturbance.
    """

    model: Estimate = field(repr=False)
    candidate: Candidate = field(repr=False)
    series: tuple[Series, ...] = field(repr=False)
    torques: tuple[str, ...]
    first: Reals = field(repr=False)
    steady: Reals = field(repr=False)

    def run(self, disturbance: Sequence[Reals]) -> tuple[Prediction, ...]:
        """Return the predictions of all recordings under a disturbance (samples,) of each."""
        pages, recorded = self._disturbed(disturbance)
        predictor, substeps = self.candidate.predictor, self.candidate.recipe.substeps
        limits = np.full(len(predictor.seen), np.inf)
        runs = predictor.predict_all(pages, recorded, self.first, self.steady, substeps, limits)
        return runs.each()

    def missed(self, disturbance: Sequence[Reals]) -> list[Reals]:
        """Return the innovations of such predictions, of which nothing else is told."""
        pages, recorded = self._disturbed(disturbance)
        predictor, substeps = self.candidate.predictor, self.candidate.recipe.substeps
        runs = predictor.predict_points(
            pages[np.newaxis], recorded, self.first, self.steady, substeps
        )
        edges = pairwise(recorded.starts.tolist())
        return self._counted([runs[0][0][low:high] for low, high in edges])

    def _disturbed(self, disturbance: Sequence[Reals]) -> tuple[Reals, Recorded]:
        """Return the page of each recording and the recordings, with a disturbance measured."""
        together, candidate = joined(self.series), self.candidate
        recorded, seen = together.recorded, candidate.predictor.seen
        nothing = np.full((len(recorded.inputs), len(self.torques)), np.nan)
        shown = np.column_stack([recorded.measured, nothing, np.concatenate(disturbance)])
        first = np.full((len(self.series), len(seen)), np.nan)
        first[:, : together.first.shape[1]] = together.first
        first[:, -1] = [values[np.argmax(np.isfinite(values))] for values in disturbance]
        given = dataclasses.replace(recorded, measured=np.ascontiguousarray(shown))
        return candidate.pages(self._values, first), given

    @cached_property
    def _values(self) -> list[dict[str, float]]:
        return [self.model.values(k) for k in range(len(self.series))]

    def innovations(self, predictions: Sequence[Prediction]) -> list[Reals]:
        """Return the innovations of the compared signals behind the burn-in."""
        return self._counted([one.innovations for one in predictions])

    def _counted(self, innovations: Sequence[Reals]) -> list[Reals]:
        seen = len(self.model.candidate.predictor.seen)
        skip = burnt(self.series[0])
        return [one[skip:, :seen] for one in innovations]


def probe_of(bench: Bench, section: str, place: str, model: Estimate) -> Probe:
    """Return a model of a bench, made ready to be disturbed at a place. Raises SpecError."""
    kind = KINDS[section]
    own = drift(kind, place)
    layer = Layer(own.effect, place, f"probe_{place}"[:25])
    torques = torques_of(bench.automaton)
    seen = (*bench.seen, *torques, layer.named(DRIFT))
    document = _shown(bench.document, seen)
    made = candidate(
        document, bench.project, model.candidate.layers, (*bench.drifts, layer), seen, bench.period
    )
    first, steady = _gains(made, model, layer.named(DRIFT))
    return Probe(model, made, bench.series, torques, first, steady)


def torques_of(automaton: Automaton) -> tuple[str, ...]:
    """Return the names of the torques that elastic elements transmit."""
    trees = [
        one.parts["torque"].tree for one in automaton.elements.values() if "torque" in one.parts
    ]
    return tuple(tree.path for tree in trees if isinstance(tree, Name))


def _shown(document: Document, names: Sequence[str]) -> Document:
    """Return a document that shows some names beside its outputs."""
    node = document.root.get("outputs")
    assert node is not None
    outputs = outputs_as_mapping(node)
    span = outputs.span
    added = {name: Entry(name, span, Scalar(name, span)) for name in names}
    table = Table({**added, **outputs.entries}, span)
    root = {**document.root.entries, "outputs": Entry("outputs", span, table)}
    return dataclasses.replace(document, root=Table(root, document.root.span))


def _gains(made: Candidate, model: Estimate, disturbance: str) -> tuple[Reals, Reals]:
    """Return the gains of a model, for one that has its states and signals among others."""
    states, known = made.predictor.states, model.candidate.predictor
    rows = [states.index(name) for name in known.states]
    columns = [made.predictor.seen.index(name) for name in known.seen]
    place = np.ix_(rows, columns)
    first = np.zeros((len(model.gains.first), len(states), len(made.predictor.seen)))
    steady = np.zeros((len(made.predictor.modes), *first.shape[1:]))
    for k, gain in enumerate(model.gains.first):
        first[k][place] = gain
    for k, mode in enumerate(made.predictor.modes):
        steady[k][place] = model.gains.steady[known.modes.index(mode)]
    row, column = states.index(disturbance), made.predictor.seen.index(disturbance)
    first[:, row, column] = 1.0
    steady[:, row, column] = 1.0
    return first, steady
