"""Accepting: a dossier as a diagnosis leaves it when it has accepted given effects."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from codegen.predictor.predictor import PredictorColumns
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import EXCLUDED_EFFECTS
from diagnosis.estimation.normal_equations import NormalEquations
from diagnosis.model.candidate import Candidate
from diagnosis.model.compile_cache import CompiledModel
from diagnosis.model.effect_library import describe_effect, library_effects
from diagnosis.model.parameter import FreeParameter, free_parameters_of
from diagnosis.model.parameter_vector import ParameterVector, per_recording_mask
from diagnosis.model.placed_effect import PlacedEffect, automaton_with_effects, find_placements
from diagnosis.pipeline.diagnose import Diagnosis
from diagnosis.pipeline.diagnosis_case import Case
from diagnosis.report.diagnosis_report import DiagnosisReport
from diagnosis.result.verdict import Verdict, named_effect_of
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.comparison import Round
from diagnosis.selection.forward_selection import Selection
from language.loading.recording_map_reader import read_map
from language.overlays.effect_reader import added_names
from language.overlays.expand_document import Project, expand_document, read_document
from language.text.document import Document
from tests.diagnosis.estimation.test_levenberg_marquardt import SCALES

BASE = "blind_driveline"
MOVED = 0.2
"""How far the parameters of the base are from their declared values, in prior deviations."""
DATA = 100.0
"""How much the recordings know of each coordinate, in its prior's."""
NOTHING = cast(Any, None)


def base_of(project: Project) -> Document:
    """Return the expanded base."""
    return expand_document(read_document(project.path_of(BASE)), project)


def acceptable_layers(project: Project) -> list[PlacedEffect]:
    """Return every effect of the library that can be accepted, wherever the base takes it."""
    base = base_of(project)
    effects = [one for one in library_effects(project) if one.name not in EXCLUDED_EFFECTS]
    return [layer for one in effects for layer in describe_effect(one, base, project).placements]


def layers_of(project: Project, ids: Sequence[str]) -> list[PlacedEffect]:
    """Return effects at places, named `effect@place`."""
    base = base_of(project)
    known = {one.name: one for one in library_effects(project)}
    fits = [
        dataclasses.replace(layer, scales=SCALES)
        for name in ids
        for layer in find_placements(base, known[name.partition("@")[0]])
    ]
    return [next(layer for layer in fits if layer.id == name) for name in ids]


def make_dossier(project: Project, layers: Sequence[PlacedEffect]) -> DiagnosisReport:
    """Return a dossier in which layers were accepted, with parameters away from neutral values."""
    base = base_of(project)
    mapping = read_map(read_document(project.path_of("blind_columns")), project)
    case = Case(base, project, mapping, (Path("a.csv"), Path("b.csv")))
    whole = automaton_with_effects(base, project, layers)
    brought = [
        layer.qualified_name(name) for layer in layers for name in added_names(layer.effect.body)
    ]
    uncertain = free_parameters_of(whole, brought)
    recipe = CompiledModel(
        PredictorColumns(BASE, (), (), (), (), (), {}), 1, (), uncertain, (), (), ()
    )
    candidate = Candidate(tuple(layers), recipe, NOTHING)
    z = np.array([_coordinate(one) for one in uncertain])
    each = np.tile(np.eye(len(z)) * DATA, (2, 1, 1))
    normal = NormalEquations(each, np.zeros((2, len(z))), per_recording_mask(candidate))
    point = ParameterVector(z, np.tile(z, (2, 1)))
    exact = cast(Any, SimpleNamespace(stacked=np.zeros((2, 1)), slices=(slice(0, 1), slice(1, 2))))
    exact.variances = exact.huber_limits = np.ones(1)
    jacobian = {one.name: np.zeros((2, 1)) for one in uncertain}
    model = Estimate(candidate, point, 0.0, exact, NOTHING, NOTHING, normal, jacobian)
    tried = tuple(CandidateFit(layer, 100.0, model, 90.0, 0.9) for layer in layers)
    compared = Round(model, {}, tried, np.ones(1), 1.0, 1.0, 200.0)
    selection = Selection(model, model, tried, compared, compared)
    plain = automaton_with_effects(base, project, ())
    effects = tuple(named_effect_of(layer, model, plain) for layer in layers)
    verdict = Verdict(
        "effect", effects, (), 1.0, (), (), {"train": {}}, {}, None, 1.0, (), {"a.csv": "0" * 16}
    )
    return DiagnosisReport(
        case, plain, NOTHING, verdict, Diagnosis(verdict, selection, NOTHING, ())
    )


def _coordinate(one: FreeParameter) -> float:
    """Return where a parameter stands: where it shows most, or a little off what was declared."""
    low, high = one.bounds
    z = one.coordinate(one.starts[-1]) if one.starts and one.starts[-1] else MOVED
    return min(max(z, low), high)
