"""Disturbance response: innovations of a model under a prescribed disturbance at one place.

A disturbance state that is measured without noise imposes it: the observer sets it so.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from codegen.predictor.predictor_arrays import Prediction, StackedRecordings
from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.data.stacked_recordings import burn_in_samples, stack_recordings
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.place_magnitude import DISTURBANCE_KIND_BY_SECTION
from diagnosis.model.candidate import Candidate, compile_candidate
from diagnosis.model.placed_effect import DISTURBANCE_STATE, disturbance_effect
from language.expressions.syntax_tree import Name
from language.model.automaton import Automaton
from language.readers.element_reader import outputs_as_mapping
from language.text.document import Document, Entry, MappingNode, ScalarNode


@dataclass(frozen=True)
class DisturbanceResponse:
    """A model with an additional disturbance state at one place and the Kalman gains of `model`.

    Its outputs are the compared ones, then the torques of elements, then the disturbance.
    """

    model: Estimate = field(repr=False)
    candidate: Candidate = field(repr=False)
    series: tuple[SampledRecording, ...] = field(repr=False)
    element_torques: tuple[str, ...]
    transient_gains: Reals = field(repr=False)
    steady_state_gains: Reals = field(repr=False)

    def predict(self, disturbance: Sequence[Reals]) -> tuple[Prediction, ...]:
        """Return the predictions while the disturbance [SI] follows values (samples,).

        A prediction has all outputs, and no Huber limits.
        """
        pages, recorded = self._with_disturbance(disturbance)
        predictor, substeps = self.candidate.predictor, self.candidate.compiled.substeps
        limits = np.full(len(predictor.outputs), np.inf)
        runs = predictor.predict_recordings(
            pages, recorded, self.transient_gains, self.steady_state_gains, substeps, limits
        )
        return runs.split()

    def _with_disturbance(self, disturbance: Sequence[Reals]) -> tuple[Reals, StackedRecordings]:
        """Return the pages, and recordings in which the disturbance is measured."""
        together, candidate = stack_recordings(self.series), self.candidate
        recorded, seen = together.recorded, candidate.predictor.outputs
        nothing = np.full((len(recorded.inputs), len(self.element_torques)), np.nan)
        measured = np.column_stack([recorded.measured, nothing, np.concatenate(disturbance)])
        first = np.full((len(self.series), len(seen)), np.nan)
        first[:, : together.first_measured.shape[1]] = together.first_measured
        first[:, -1] = [values[np.argmax(np.isfinite(values))] for values in disturbance]
        with_outputs = dataclasses.replace(recorded, measured=np.ascontiguousarray(measured))
        values = [self.model.values(k) for k in range(len(self.series))]
        return candidate.calibration_pages(values, first), with_outputs

    def innovations_of(self, runs: Sequence[Prediction]) -> list[Reals]:
        """Return the innovations of compared outputs after burn-in, (samples, outputs) each."""
        seen = len(self.model.candidate.predictor.outputs)
        pairs = zip(runs, self.series, strict=True)
        return [run.innovations[burn_in_samples(one) :, :seen] for run, one in pairs]


def build_disturbance_response(
    model_set: ModelSet, section: str, place: str, model: Estimate
) -> DisturbanceResponse:
    """Return the model of a fit, compiled with a disturbance at `section.place`.

    Raises SpecError if the disturbance cannot be placed, KeyError for a section other than flow,
    elements and outputs.
    """
    kind = DISTURBANCE_KIND_BY_SECTION[section]
    disturbance = model_set.scale_disturbance(disturbance_effect(kind, place))
    placed_effect = dataclasses.replace(disturbance, suffix=f"probe_{place}"[:25])
    state = placed_effect.qualified_name(DISTURBANCE_STATE)
    torques = element_torques(model_set.automaton)
    seen = (*model_set.output_names, *torques, state)
    candidate = compile_candidate(
        _with_outputs(model_set.document, seen),
        model_set.project,
        model.candidate.placed_effects,
        (*model_set.disturbances, placed_effect),
        seen,
        model_set.period,
    )
    first, steady = _embed_gains(candidate, model, state)
    return DisturbanceResponse(model, candidate, model_set.series, torques, first, steady)


def element_torques(automaton: Automaton) -> tuple[str, ...]:
    """Return the torques of elements that are single names, in the order of elements."""
    torques = [one.parts.get("torque") for one in automaton.elements.values()]
    trees = [torque.tree for torque in torques if torque is not None]
    return tuple(tree.path for tree in trees if isinstance(tree, Name))


def _with_outputs(document: Document, names: Sequence[str]) -> Document:
    """Return a document that has additional outputs before its own."""
    node = document.root.get("outputs")
    assert node is not None
    outputs = outputs_as_mapping(node)
    span = outputs.span
    added = {name: Entry(name, span, ScalarNode(name, span)) for name in names}
    table = MappingNode({**added, **outputs.entries}, span)
    root = {**document.root.entries, "outputs": Entry("outputs", span, table)}
    return dataclasses.replace(document, root=MappingNode(root, document.root.span))


def _embed_gains(candidate: Candidate, model: Estimate, disturbance: str) -> tuple[Reals, Reals]:
    """Return the gains of a model in a larger candidate, with 1 from disturbance to its state."""
    whole, known = candidate.predictor, model.candidate.predictor
    rows = np.array([whole.states.index(name) for name in known.states])
    columns = [whole.outputs.index(name) for name in known.outputs]
    steady_state = model.gains.steady_state[[known.modes.index(mode) for mode in whole.modes]]
    embedded = []
    for gains in (model.gains.transient, steady_state):
        larger = np.zeros((len(gains), len(whole.states), len(whole.outputs)))
        larger[:, rows[:, np.newaxis], columns] = gains
        larger[:, whole.states.index(disturbance), whole.outputs.index(disturbance)] = 1.0
        embedded.append(larger)
    return embedded[0], embedded[1]
