"""The search for a formula holds for recordings of unlike length and for outputs of equations."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.equation.regression_problem import regression_at
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.pipeline.diagnosis_case import Case, build_model_set
from diagnosis.selection.intersample import fit_base
from language.loading.load import automaton_of
from language.overlays.expand_document import Project
from language.text.diagnostic import Source
from language.text.project_files import parse_document
from tests.diagnosis.small_driveline import read_recording_map

SPEC = """\
language: 1
automaton: rubbing_block
step: 10 ms
parameters: {m: {value: 2 kg, range: [1, 4]}, c: {value: 3 N*s/m, range: [1, 9]}}
inputs: {F_m: {unit: N}}
states: {v: {unit: m/s, initial: 0 m/s}}
equations: {F_c: c * v}
flow: {v: m * der(v) = F_m - F_c}
outputs: [v, F_c]
"""
COUNTS = 240, 60
"""Samples of the recordings; the burn-in of the shorter one is shorter."""


def fit_block(text: str) -> tuple[ModelSet, Estimate]:
    """The block with recordings that its model does not explain, and the fit of its base."""
    document = parse_document(Source("block.yaml", tuple(text.splitlines())), text)
    project, chance = Project(Path()), np.random.default_rng(3)
    series = []
    for count in COUNTS:
        force = np.where(np.arange(count) % 50 < 25, 4.0, -4.0)
        outputs = np.cumsum(force)[:, None] * [0.005, 0.015]
        measured = outputs + 0.01 * chance.normal(size=(count, 2))
        series.append(
            SampledRecording(
                f"{count}.csv", Fraction(1, 100), Fraction(0), force[:, None], measured,
                holds=("previous",),
            )
        )  # fmt: skip
    case = Case(document, project, read_recording_map(), ())
    automaton = automaton_of(document, project)
    return fit_base(build_model_set(case, automaton, series, ("v", "F_c")))


@pytest.fixture(scope="module")
def fitted() -> tuple[ModelSet, Estimate]:
    return fit_block(SPEC)


@pytest.mark.parametrize(("section", "place"), [("flow", "v"), ("outputs", "F_c")])
def test_each_recording_has_its_own_burn_in(
    fitted: tuple[ModelSet, Estimate], section: str, place: str
) -> None:
    model_set, base = fitted
    burn_in = base.prediction.burn_in.tolist()
    assert burn_in[0] > burn_in[1]
    found = regression_at(model_set, base, section, place)
    assert any(place in term.name for term in found.terms)
    rows = [2 * (count - skipped) for count, skipped in zip(COUNTS, burn_in, strict=True)]
    assert [part.stop - part.start for part in base.prediction.slices] == [n // 2 for n in rows]


def test_a_model_without_free_parameters_has_terms_only() -> None:
    fixed = SPEC.replace(", range: [1, 4]", "").replace(", range: [1, 9]", "")
    found = regression_at(*fit_block(fixed), "flow", "v")
    assert found.problem.parameters == 0
    assert found.columns[0].places == (0,)
