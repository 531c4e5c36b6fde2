"""Output comparison: the error of a simulated output, also of one that is constant."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.data_quality.output_comparison import MIN_STD, OutputComparison


def comparison(measured: list[float], simulated: list[float]) -> OutputComparison:
    times = np.arange(float(len(measured)))
    return OutputComparison("w", times, np.array(measured), np.array(simulated))


def test_the_error_is_relative_to_the_spread_of_the_measured_values() -> None:
    found = comparison([1.0, 3.0], [1.5, 3.5])
    assert (found.rms, found.nrmse) == (0.5, 0.5)


def test_the_relative_error_of_a_constant_output_is_finite() -> None:
    assert comparison([2.0, 2.0], [2.0, 2.0]).nrmse == 0.0
    assert comparison([2.0, 2.0], [2.0, 4.0]).nrmse == pytest.approx(2.0**0.5 / MIN_STD)
