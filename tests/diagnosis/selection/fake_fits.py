"""Faking: fits with given costs and innovations, of models that are never compiled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from codegen.predictor.predictor import PredictorColumns
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.innovations import NoiseLevels
from diagnosis.estimation.model_set import ModelSet
from diagnosis.model.candidate import Candidate
from diagnosis.model.compile_cache import CompiledModel
from diagnosis.model.parameter import FreeParameter
from diagnosis.model.parameter_vector import vector_of
from diagnosis.model.placed_effect import PlacedEffect, effect_names, find_placements
from diagnosis.selection.candidate_search import CandidateFit
from diagnosis.selection.comparison import Round
from language.loading.load import automaton_of
from language.overlays.effect_reader import Effect
from language.overlays.expand_document import Project
from language.text.diagnostic import Source
from language.text.project_files import parse_document
from tests.diagnosis.rotor_project import SPEC

SAMPLES = 1000.0
NOTHING = cast(Any, None)


FRICTION = "0.1 N*m*s/rad, range: [0.01, 0.5]"
"""The viscous friction of the rotor in its spec."""


def rotor_model_set(effects: Sequence[Effect] = (), friction: str = FRICTION) -> ModelSet:
    """The rotor without recordings."""
    text = SPEC.replace("recording_map: bench_columns\n", "").replace(FRICTION, friction)
    document = parse_document(Source("spinner.yaml", tuple(text.splitlines())), text)
    project = Project(Path())
    automaton = automaton_of(document, project)
    return ModelSet(document, project, automaton, tuple(effects), (), ("w",), ())


def places_of(model_set: ModelSet, effects: Sequence[Effect], count: int) -> list[PlacedEffect]:
    """The first effects that have a place in the rotor, each at one of its places."""
    found = [layer for one in effects for layer in find_placements(model_set.document, one)[:1]]
    assert len(found) >= count
    return found[:count]


def candidate_of(effects: Sequence[PlacedEffect], own: int = 1) -> Candidate:
    """A candidate with one free parameter of the base, and at most `own` of each effect."""
    names = ["J", *(name for one in effects for name in sorted(effect_names(one))[:own])]
    free = tuple(FreeParameter(name, 1.0, 0.1, 9.0, 1.0, False) for name in names)
    columns = PredictorColumns("spinner", (), (), (), (), (), {})
    return Candidate(tuple(effects), CompiledModel(columns, 1, (), free, (), ()), NOTHING)


def fit_of(
    effects: Sequence[PlacedEffect],
    cost: float,
    variances: Sequence[float] = (1.0,),
    own: int = 1,
) -> Estimate:
    """A fit with white innovations of these variances."""
    candidate = candidate_of(effects, own)
    random = np.random.default_rng(1)
    prediction = SimpleNamespace(
        variances=np.array(variances),
        counts=np.full(len(variances), SAMPLES),
        innovations=(random.normal(size=(int(SAMPLES), len(variances))),),
        is_complete=math.isfinite(cost),
    )
    levels = NoiseLevels(np.ones(len(variances)), np.ones(1), {}, np.full(len(variances), np.inf))
    point = vector_of(candidate, 1, {})
    return Estimate(candidate, point, cost, cast(Any, prediction), NOTHING, levels)


def tried(
    base: Estimate, effect: PlacedEffect, gain: float, share: float, is_fitted: bool = True
) -> CandidateFit:
    """A candidate beside a base with a gain and a share; the base leaves the energy 10."""
    effects = [*base.candidate.placed_effects, effect]
    left = 1.0 + 10.0 * (1.0 - share)
    model = fit_of(effects, base.cost - gain, [left]) if is_fitted else None
    return CandidateFit(effect, gain, model, gain if is_fitted else -math.inf, share)


def round_of(
    base: Estimate, candidates: Sequence[CandidateFit], energy: float = 10.0, total: float = 0.0
) -> Round:
    """A comparison beside a base; a free disturbance gains `total`."""
    free = {"flow.w": fit_of((), base.cost - total)}
    return Round(base, free, tuple(candidates), np.ones(1), energy, 1.0, 1e6)
