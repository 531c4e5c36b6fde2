"""Free simulation: errors of known runs, and of runs that diverge."""

from __future__ import annotations

from fractions import Fraction
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.validation import free_simulation
from diagnosis.validation.free_simulation import complete_nrmse, nrmse

COUNT = 1000
SERIES = SampledRecording(
    "a", Fraction(1, 100), Fraction(0), np.zeros((COUNT, 1)), np.tile([[1.0], [-1.0]], (500, 1))
)
"""A signal with a standard deviation of 1."""
MODEL = cast(
    Estimate, cast(Any, SimpleNamespace(noise_levels=SimpleNamespace(is_output_error=False)))
)


def simulated(run: Reals, monkeypatch: pytest.MonkeyPatch) -> tuple[float, float]:
    """Both errors of a run."""
    monkeypatch.setattr(free_simulation, "simulate_free", lambda *_: [run])
    return float(nrmse(MODEL, [SERIES])[0]), float(complete_nrmse(MODEL, [SERIES])[0])


def test_errors_are_relative_to_the_signal(monkeypatch: pytest.MonkeyPatch) -> None:
    assert simulated(SERIES.measured, monkeypatch) == (0.0, 0.0)
    assert simulated(SERIES.measured + 0.5, monkeypatch) == (0.5, 0.5)


def test_a_run_that_diverges_is_not_a_good_one(monkeypatch: pytest.MonkeyPatch) -> None:
    run = SERIES.measured.copy()
    run[COUNT // 2 :] = np.nan
    assert simulated(run, monkeypatch) == (0.0, np.inf)
