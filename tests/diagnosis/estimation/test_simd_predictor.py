"""Recordings that are followed side by side have the bits of those that are followed alone."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from codegen.predictor import predictor as predictor_module
from codegen.predictor.predictor import Predictor, columns_of, slice_to_outputs
from codegen.predictor.predictor_arrays import Prediction, StackedRecordings
from codegen.predictor.simd_predictor import simd_recordings_context
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.model_set import ModelSet, balance_disturbances
from diagnosis.model import compile_cache as recipe
from diagnosis.model.candidate import Candidate
from diagnosis.model.placed_effect import shipped_effects
from language.loading.load import automaton_of, program_of
from language.overlays.expand_document import Project, expand_document, read_document
from tests.diagnosis.conftest import SOON
from tests.diagnosis.estimation.test_levenberg_marquardt import OUTPUTS, PERIOD, place_effect
from tests.language.spec_builders import ROOT

pytestmark = pytest.mark.long

Reals = NDArray[np.float64]
COUNTS = (150, 90, 211, 40, 171)
"""Samples of recordings: one vector and one that is left over."""
LINEAR = ((1, 1), (0, 0), (1, 0), (0, 1), (0, 0))
"""Inputs that are linear between samples, by recording."""
POINTS = 3
UNKNOWN = 0.2
"""Part of the measurements that are not known."""
FIRST = 20
LAID = {
    "": True,
    "actuator_delay@T_em": True,
    "backlash@half_shaft": True,
    "actuator_lag@T_em": True,
    "coulomb_friction@w_em": True,
    "mount_compliance@half_shaft": True,
    "second_gap@half_shaft": True,
    "sensor_lag@w_s": True,
    "stiffness_hysteresis@half_shaft": True,
    "torque_ripple@T_em": True,
    "tyre_slip@vehicle": True,
    "unequal_half_shafts@half_shaft": True,
}
"""Effects on the blind driveline: whether recordings go side by side."""


@pytest.fixture(autouse=True, scope="module")
def _predictors_are_compiled_soon() -> None:
    """Not those of these tests: what goes side by side is in vectors, as a user has it."""


@pytest.fixture(scope="module")
def bench() -> ModelSet:
    project = Project(ROOT)
    document = expand_document(read_document(project.path_of("blind_driveline")), project)
    automaton = automaton_of(document, project)
    blank = SampledRecording("blank", PERIOD, PERIOD * 0, np.zeros((2, 2)), np.zeros((2, 2)))
    drifts = balance_disturbances(document, automaton)
    return ModelSet(document, project, automaton, shipped_effects(), (blank,), OUTPUTS, drifts)


def candidate_of(bench: ModelSet, name: str) -> Candidate:
    return bench.compile_candidate((place_effect(bench, name),) if name else ())


def recorded(predictor: Predictor, seed: int) -> StackedRecordings:
    """Return recordings with torques that go through the gap, at rest, slowly and fast; parts of
    what is measured are not known, and the second one leaves all bounds.
    """
    draw = np.random.default_rng(seed)
    starts = np.cumsum([0, *COUNTS], dtype=np.int64)
    inputs = np.repeat(draw.uniform(-90.0, 90.0, (starts[-1] // 8 + 1, 2)), 8, axis=0)[: starts[-1]]
    inputs[:, predictor.inputs.index("T_br")] = np.abs(inputs[:, 1]) * 3.0 * (inputs[:, 0] > 50.0)
    speeds = np.repeat([0.0, 3.0, 60.0, 5.0, 100.0], COUNTS)
    measured = speeds[:, np.newaxis] * [1.0, 1.0 / 9.0] + draw.normal(size=(starts[-1], 2))
    measured[draw.uniform(size=measured.shape) < UNKNOWN] = np.nan
    measured[starts[1] + 60] = 1e16
    return StackedRecordings(
        np.ascontiguousarray(inputs), measured, starts, np.full(5, 9), np.array(LINEAR)
    )


def gains_of(predictor: Predictor, draw: np.random.Generator, count: int) -> Reals:
    """Return gains under which the states stay near what is measured."""
    found = draw.normal(0.0, 1e-4, (count, len(predictor.states), len(OUTPUTS)))
    for k, name in enumerate(OUTPUTS):
        found[:, predictor.states.index(name), k] += draw.uniform(0.1, 0.3, count)
    return found


def alone(
    predictor: Predictor,
    page: Reals,
    given: StackedRecordings,
    r: int,
    gains: tuple[Reals, Reals],
    n: int,
) -> Prediction:
    low, high = given.starts[r : r + 2]
    inputs, measured = given.inputs[low:high], given.measured[low:high]
    return predictor.predict(
        page, inputs, measured, *gains, n, linear_inputs=given.linear_inputs[r]
    )


def assert_same(mine: Reals, theirs: Reals) -> None:
    """Bit for bit; one NaN is as good as another."""
    known = ~np.isnan(theirs)
    assert np.array_equal(known, ~np.isnan(mine))
    assert np.array_equal(mine[known].view(np.int64), theirs[known].view(np.int64))


@pytest.mark.parametrize("effect", LAID)
def test_side_by_side_they_have_the_bits_of_one(effect: str, bench: ModelSet) -> None:
    candidate = candidate_of(bench, effect)
    predictor, substeps = candidate.predictor, candidate.compiled.substeps
    given = recorded(predictor, len(effect))
    draw = np.random.default_rng(5)
    page = np.array(list(predictor.page.values()))
    pages = page * draw.uniform(0.9, 1.1, (POINTS, len(COUNTS), len(page)))
    first, steady = (gains_of(predictor, draw, n) for n in (FIRST, len(predictor.modes)))
    innovations, done = predictor.predict_points(pages, given, first, steady, substeps)
    limits = np.full(len(OUTPUTS), np.inf)
    whole = predictor.predict_recordings(pages[0], given, first, steady, substeps, limits).split()
    for r, (low, high) in enumerate(zip(given.starts[:-1], given.starts[1:], strict=True)):
        for p in range(POINTS):
            run = alone(predictor, pages[p, r], given, r, (first, steady), substeps)
            assert_same(innovations[p, low:high], run.innovations)
            assert done[p, r] == run.completed
        run = alone(predictor, pages[0, r], given, r, (first, steady), substeps)
        assert whole[r].completed == run.completed
        assert_same(whole[r].outputs, run.outputs)
        assert_same(whole[r].states[: run.completed], run.states[: run.completed])
        assert np.array_equal(whole[r].modes[: run.completed], run.modes[: run.completed])
    assert done[0].tolist() == [150, 60, 211, 40, 171]
    assert len({int(mode) for one in whole for mode in one.modes}) > 1


@pytest.mark.parametrize("effect", ["", "torque_ripple@T_em", "backlash@half_shaft"])
def test_other_tests_follow_with_the_same_bits(
    effect: str, bench: ModelSet, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They compile sooner: see conftest.py."""
    found: list[tuple[Reals, NDArray[np.int64]]] = []
    for flags in (predictor_module.LIBRARY_FLAGS, SOON):
        monkeypatch.setattr(predictor_module, "LIBRARY_FLAGS", flags)
        folder = tmp_path / str(len(found))
        folder.mkdir()
        monkeypatch.setattr(recipe, "_cache_folder", lambda folder=folder: folder)
        predictor = candidate_of(dataclasses.replace(bench, _compiled={}), effect).predictor
        given, draw = recorded(predictor, 3), np.random.default_rng(5)
        pages = np.tile(list(predictor.page.values()), (1, len(COUNTS), 1))
        first, steady = (gains_of(predictor, draw, n) for n in (FIRST, len(predictor.modes)))
        found.append(predictor.predict_points(pages, given, first, steady, 2))
    (mine, done), (theirs, other) = found
    assert_same(mine, theirs)
    assert np.array_equal(done, other)
    plain, soon = (path.read_bytes() for path in sorted(tmp_path.glob("*/*.so")))
    assert plain != soon


@pytest.mark.parametrize("effect", LAID)
def test_each_point_may_have_gains_of_its_own(effect: str, bench: ModelSet) -> None:
    candidate = candidate_of(bench, effect)
    predictor, substeps = candidate.predictor, candidate.compiled.substeps
    given = recorded(predictor, len(effect))
    draw = np.random.default_rng(6)
    pages = np.tile(list(predictor.page.values()), (POINTS, len(COUNTS), 1))
    each = [
        tuple(gains_of(predictor, draw, n) for n in (FIRST, len(predictor.modes)))
        for _ in range(POINTS)
    ]
    first, steady = (np.array(gains) for gains in zip(*each, strict=True))
    innovations, _ = predictor.predict_points(pages, given, first, steady, substeps)
    for r, (low, high) in enumerate(zip(given.starts[:-1], given.starts[1:], strict=True)):
        for p in range(POINTS):
            run = alone(predictor, pages[p, r], given, r, (first[p], steady[p]), substeps)
            assert_same(innovations[p, low:high], run.innovations)


@pytest.mark.parametrize("effect", LAID)
def test_most_effects_go_side_by_side(effect: str, bench: ModelSet) -> None:
    """The library tells: it holds what follows several."""
    candidate = candidate_of(bench, effect)
    library = Path(candidate.predictor._library._name).read_bytes()
    assert (b"follow_simd" in library) == LAID[effect]


@pytest.mark.parametrize("substeps", [1, 3])
def test_between_samples_inputs_are_held_or_run_straight(substeps: int, bench: ModelSet) -> None:
    candidate = candidate_of(bench, "")
    predictor = candidate.predictor
    given = recorded(predictor, 77)
    pages = np.tile(list(predictor.page.values()), (1, len(COUNTS), 1))
    gains = np.zeros((len(predictor.modes), len(predictor.states), len(OUTPUTS)))
    innovations, _ = predictor.predict_points(pages, given, gains[:0], gains, substeps)
    for r, (low, high) in enumerate(zip(given.starts[:-1], given.starts[1:], strict=True)):
        run = alone(predictor, pages[0, r], given, r, (gains[:0], gains), substeps)
        assert_same(innovations[0, low:high], run.innovations)


def test_both_sides_of_a_gap_take_a_step_at_once(bench: ModelSet) -> None:
    """They differ in a guard; the gap flows in another way."""
    program = slice_to_outputs(program_of(bench.automaton))
    columns = columns_of(program, OUTPUTS)
    found = simd_recordings_context(program, columns.states, columns.outputs)
    assert [sorted(step.modes.values()) for step in found["fast_steps"]] == [
        ["coast_contact", "drive_contact"],
        ["no_contact"],
    ]
