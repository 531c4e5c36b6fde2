"""The steady gain is that of scipy's Riccati solver; the first gains end where it is."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from codegen.predictor.predictor import Predictor
from diagnosis.model.candidate import compile_candidate
from language.overlays.expand_document import Project, expand_document, read_document

RNG = np.random.default_rng(5)
SEEN = 2
ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def predictor() -> Predictor:
    project = Project(ROOT)
    document = read_document(ROOT / "spec" / "recorded" / "blind_driveline.yaml")
    whole = expand_document(document, project)
    return compile_candidate(whole, project, (), (), ("w_em", "w_s"), Fraction(1, 200)).predictor


def system(states: int) -> tuple[np.ndarray, ...]:
    phi = RNG.normal(size=(states, states))
    phi *= 0.98 / np.max(np.abs(np.linalg.eigvals(phi)))
    c = RNG.normal(size=(SEEN, states))
    return phi, c, np.diag(RNG.uniform(0.01, 1.0, states)), RNG.uniform(0.1, 1.0, SEEN)


def test_the_steady_gain_is_that_of_the_riccati_equation(predictor: Predictor) -> None:
    phi, c, q, r = system(len(predictor.states))
    p = solve_discrete_are(phi.T, c.T, q, np.diag(r))
    wanted = p @ c.T @ np.linalg.inv(c @ p @ c.T + np.diag(r))
    found = predictor.compute_gains(phi, c, q, r, np.eye(len(phi)), 0)
    assert found is not None
    assert np.allclose(found[1], wanted, rtol=1e-4, atol=1e-6)


def test_the_first_gains_become_the_steady_one(predictor: Predictor) -> None:
    phi, c, q, r = system(len(predictor.states))
    found = predictor.compute_gains(phi, c, q, r, 100.0 * np.eye(len(phi)), 400)
    assert found is not None
    first, steady, _ = found
    assert first.shape == (400, len(phi), SEEN)
    assert np.allclose(first[-1], steady, rtol=1e-5, atol=1e-7)
    assert np.linalg.norm(first[0]) > np.linalg.norm(steady)


def test_the_first_gain_is_that_of_all_signals_at_once(predictor: Predictor) -> None:
    phi, c, q, r = system(len(predictor.states))
    start = np.diag(RNG.uniform(1.0, 2.0, len(phi)))
    p = phi @ start @ phi.T + q
    wanted = p @ c.T @ np.linalg.inv(c @ p @ c.T + np.diag(r))
    found = predictor.compute_gains(phi, c, q, r, start, 1)
    assert found is not None
    assert np.allclose(found[0][0], wanted, rtol=1e-9)


def test_without_noise_nothing_is_corrected(predictor: Predictor) -> None:
    phi, c, q, r = system(len(predictor.states))
    found = predictor.compute_gains(phi, c, 0.0 * q, r, np.eye(len(phi)), 0)
    assert found is not None
    assert np.allclose(found[1], 0.0, atol=1e-3)


def test_a_gain_without_bounds_is_none(predictor: Predictor) -> None:
    phi, c, q, r = system(len(predictor.states))
    assert predictor.compute_gains(1e3 * phi, 1e-160 * c, q, r, np.eye(len(phi)), 0) is None
