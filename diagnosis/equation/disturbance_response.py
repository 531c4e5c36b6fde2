"""Disturbance response: innovations of a model under a prescribed disturbance at one place.

The disturbance is imposed through a disturbance state that is measured without noise, so the
observer sets it to the prescribed values. Each term of a formula is tested by one such run.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

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
        """Return the predictions of all recordings while the disturbance follows given values.

        `disturbance` is in SI units, (samples,) for each recording; a prediction has all outputs of
        the model with the disturbance, and no Huber limits.
        """
        pages, recorded = self._with_disturbance(disturbance)
        predictor, substeps = self.candidate.predictor, self.candidate.compiled.substeps
        limits = np.full(len(predictor.outputs), np.inf)
        runs = predictor.predict_recordings(
            pages, recorded, self.transient_gains, self.steady_state_gains, substeps, limits
        )
        return runs.split()

    def predict_innovations(self, disturbance: Sequence[Reals]) -> list[Reals]:
        """Return the innovations of compared outputs while the disturbance follows given values.

        `disturbance` is (samples,) for each recording. The result is (samples, outputs) for each,
        after the burn-in: the innovations of `predict`, without storing states.
        """
        pages, recorded = self._with_disturbance(disturbance)
        predictor, substeps = self.candidate.predictor, self.candidate.compiled.substeps
        runs = predictor.predict_points(
            pages[np.newaxis], recorded, self.transient_gains, self.steady_state_gains, substeps
        )
        edges = pairwise(recorded.starts.tolist())
        return self._after_burn_in([runs[0][0][low:high] for low, high in edges])

    def _with_disturbance(self, disturbance: Sequence[Reals]) -> tuple[Reals, StackedRecordings]:
        """Return calibration pages, and the recordings
        with the disturbance as a measured output.
        """
        together, candidate = stack_recordings(self.series), self.candidate
        recorded, seen = together.recorded, candidate.predictor.outputs
        nothing = np.full((len(recorded.inputs), len(self.element_torques)), np.nan)
        measured = np.column_stack([recorded.measured, nothing, np.concatenate(disturbance)])
        first = np.full((len(self.series), len(seen)), np.nan)
        first[:, : together.first_measured.shape[1]] = together.first_measured
        first[:, -1] = [values[np.argmax(np.isfinite(values))] for values in disturbance]
        with_outputs = dataclasses.replace(recorded, measured=np.ascontiguousarray(measured))
        return candidate.calibration_pages(self._values, first), with_outputs

    @cached_property
    def _values(self) -> list[dict[str, float]]:
        """The parameter values [SI] of each recording."""
        return [self.model.values(k) for k in range(len(self.series))]

    def innovations(self, predictions: Sequence[Prediction]) -> list[Reals]:
        """Return the innovations of the compared outputs from predictions, (samples, outputs) each.

        The burn-in of each recording is cut off; element torques and disturbance are left out.
        """
        return self._after_burn_in([one.innovations for one in predictions])

    def _after_burn_in(self, innovations: Sequence[Reals]) -> list[Reals]:
        """Return the part of innovations after the burn-in, for the compared outputs."""
        seen = len(self.model.candidate.predictor.outputs)
        pairs = zip(innovations, self.series, strict=True)
        return [values[burn_in_samples(one) :, :seen] for values, one in pairs]


def build_disturbance_response(
    model_set: ModelSet, section: str, place: str, model: Estimate
) -> DisturbanceResponse:
    """Return the model of a fit, compiled with a disturbance at `section.place`.

    The disturbance is named `probe_<place>`, cut to 25 characters. It has the effects of the fit
    and all disturbances of the model set besides. Its Kalman gains are those of the fit; the gain
    from the disturbance output to the disturbance state is 1. Raises SpecError if the disturbance
    cannot be placed, KeyError for a section other than flow, elements and outputs.
    """
    kind = DISTURBANCE_KIND_BY_SECTION[section]
    disturbance = model_set.scale_disturbance(disturbance_effect(kind, place))
    placed_effect = dataclasses.replace(disturbance, suffix=f"probe_{place}"[:25])
    torques = element_torques(model_set.automaton)
    seen = (*model_set.output_names, *torques, placed_effect.qualified_name(DISTURBANCE_STATE))
    document = _with_outputs(model_set.document, seen)
    candidate = compile_candidate(
        document,
        model_set.project,
        model.candidate.placed_effects,
        (*model_set.disturbances, placed_effect),
        seen,
        model_set.period,
    )
    first, steady = _embed_gains(candidate, model, placed_effect.qualified_name(DISTURBANCE_STATE))
    return DisturbanceResponse(model, candidate, model_set.series, torques, first, steady)


def element_torques(automaton: Automaton) -> tuple[str, ...]:
    """Return the names of the torques of elements, in the order of the elements.

    Only elements whose `torque` is a single name are included, not those with an expression.
    """
    trees = [
        one.parts["torque"].tree for one in automaton.elements.values() if "torque" in one.parts
    ]
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
    """Return the Kalman gains of a model at the indices of a candidate with more states and
    outputs.

    The gain from the disturbance output to the disturbance state is 1, all others are 0.
    """
    states, known = candidate.predictor.states, model.candidate.predictor
    rows = [states.index(name) for name in known.states]
    columns = [candidate.predictor.outputs.index(name) for name in known.outputs]
    place = np.ix_(rows, columns)
    first = np.zeros((len(model.gains.transient), len(states), len(candidate.predictor.outputs)))
    steady = np.zeros((len(candidate.predictor.modes), *first.shape[1:]))
    for k, gain in enumerate(model.gains.transient):
        first[k][place] = gain
    for k, mode in enumerate(candidate.predictor.modes):
        steady[k][place] = model.gains.steady_state[known.modes.index(mode)]
    row, column = states.index(disturbance), candidate.predictor.outputs.index(disturbance)
    first[:, row, column] = 1.0
    steady[:, row, column] = 1.0
    return first, steady
