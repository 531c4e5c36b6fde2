"""The intervals of a fit contain the parameters that were simulated, and are not too wide."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tests.validation.properties.fit_coverage import (
    ParameterResult,
    fit_machine,
    random_machine,
    simulate_machine,
)

THERMOSTAT, HALF_BRIDGE = 9, 8
"""Numbers of the machines: one with a switch inside, and one that is sampled at 5 kHz."""
MOST_CHI2 = 0.99
"""Quantile of the sum of squared errors, in standard errors."""


def fit_number(number: int, folder: Path) -> list[ParameterResult]:
    """Return the fitted parameters of a random machine."""
    machine = random_machine(number, 0)
    return list(fit_machine(machine, simulate_machine(machine, folder / "case", number)))


@pytest.mark.parametrize("number", [THERMOSTAT, pytest.param(HALF_BRIDGE, marks=pytest.mark.long)])
def test_intervals_contain_the_simulated_parameters(number: int, tmp_path: Path) -> None:
    found = fit_number(number, tmp_path)
    assert sum(one.z**2 for one in found) < chi2.ppf(MOST_CHI2, len(found)), found
    assert np.median([one.std / one.bound for one in found]) < 1.3
    assert all(one.std > 0.9 * one.bound for one in found)
    assert all(one.is_determined for one in found)
    assert all(one.error_after < one.error_before for one in found)
