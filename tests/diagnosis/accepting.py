"""Accepting: a dossier as a diagnosis leaves it when it has accepted given effects."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from codegen.predictor import Columns
from diagnosis.bench import NOT_CANDIDATES
from diagnosis.candidate import Candidate
from diagnosis.case import Case
from diagnosis.diagnose import Diagnosis
from diagnosis.dossier import Dossier
from diagnosis.estimate import Estimate
from diagnosis.evidence import Evidence
from diagnosis.layers import Layer, automaton, fitting
from diagnosis.library import described, library
from diagnosis.naming import named
from diagnosis.normal import Normal
from diagnosis.point import Point, is_own
from diagnosis.recipe import Recipe
from diagnosis.search import Tried
from diagnosis.selection import Selection
from diagnosis.uncertain import Uncertain, uncertain_of
from diagnosis.verdict import Verdict
from language.document import Document
from language.effect import own_names
from language.map import read_map
from language.project import Project, expanded, read_document

BASE = "blind_driveline"
MOVED = 0.2
"""How far the parameters of the base are from their declared values, in prior deviations."""
DATA = 100.0
"""How much the recordings know of each coordinate, in its prior's."""
NOTHING = cast(Any, None)


def base_of(project: Project) -> Document:
    """Return the expanded base."""
    return expanded(read_document(project.path_of(BASE)), project)


def acceptable(project: Project) -> list[Layer]:
    """Return every effect of the library that can be accepted, wherever the base takes it."""
    base = base_of(project)
    effects = [one for one in library(project) if one.name not in NOT_CANDIDATES]
    return [layer for one in effects for layer in described(one, base, project).layers]


def layers_of(project: Project, ids: Sequence[str]) -> list[Layer]:
    """Return effects at places, named `effect@place`."""
    base = base_of(project)
    known = {one.name: one for one in library(project)}
    fits = [layer for name in ids for layer in fitting(base, known[name.partition("@")[0]])]
    return [next(layer for layer in fits if layer.id == name) for name in ids]


def accepted(project: Project, layers: Sequence[Layer]) -> Dossier:
    """Return a dossier in which layers were accepted, with parameters away from neutral values."""
    base = base_of(project)
    mapping = read_map(read_document(project.path_of("blind_columns")), project)
    case = Case(base, project, mapping, (Path("a.csv"), Path("b.csv")))
    whole = automaton(base, project, layers)
    brought = [layer.named(name) for layer in layers for name in own_names(layer.effect.body)]
    uncertain = uncertain_of(whole, brought)
    recipe = Recipe(Columns(BASE, (), (), (), (), (), {}), 1, (), uncertain, (), (), ())
    candidate = Candidate(tuple(layers), recipe, NOTHING)
    z = np.array([_coordinate(one) for one in uncertain])
    each = np.tile(np.eye(len(z)) * DATA, (2, 1, 1))
    blocks = np.arange(2)
    normal = Normal(each, np.zeros((2, len(z))), is_own(candidate), blocks, blocks)
    point = Point(z, np.tile(z, (2, 1)))
    model = Estimate(candidate, point, 0.0, NOTHING, NOTHING, NOTHING, normal)
    gains = Evidence(100.0, 90.0, (50.0, 40.0))
    tried = tuple(Tried(layer, 100.0, model, gains) for layer in layers)
    selection = Selection(model, model, tried, tried, ())
    plain = automaton(base, project, ())
    effects = tuple(named(layer, model, plain) for layer in layers)
    verdict = Verdict(
        "effect", effects, (), 1.0, (), (), {"train": {}}, {}, None, 1.0, (), {"a.csv": "0" * 16}
    )
    return Dossier(case, plain, NOTHING, verdict, Diagnosis(verdict, selection, NOTHING, ()))


def _coordinate(one: Uncertain) -> float:
    """Return where a parameter stands: where it shows most, or a little off what was declared."""
    low, high = one.bounds
    z = one.coordinate(one.starts[-1]) if one.starts and one.starts[-1] else MOVED
    return min(max(z, low), high)
