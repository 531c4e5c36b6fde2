"""Errors of recordings that have no sample in free simulation are unknown, without a warning."""

from __future__ import annotations

import warnings
from fractions import Fraction

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.report.number_text import format_significant
from diagnosis.report.tables import _misfit_cell
from diagnosis.validation.free_simulation import is_free
from diagnosis.validation.worst_window import FreeRuns, rms_by_recording


def recording(count: int) -> SampledRecording:
    measured = np.column_stack([np.arange(count, dtype=np.float64), np.full(count, np.nan)])
    return SampledRecording("a.csv", Fraction(1, 100), Fraction(0), np.zeros((count, 0)), measured)


def test_an_error_without_values_is_unknown() -> None:
    short, long = recording(3), recording(600)
    assert not np.any(is_free(short))
    runs = [np.where(np.isnan(one.measured), 0.0, one.measured + 2.0) for one in (short, long)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = rms_by_recording(FreeRuns((short, long), runs, runs, ("w", "v")))
    assert np.isnan(found[0][1]).all()
    np.testing.assert_allclose(found[1][1], [2.0, np.nan])


def test_an_unknown_change_is_no_trend() -> None:
    cell = _misfit_cell(2.0, np.nan, format_significant)
    assert (cell.before, cell.after, cell.trend) == ("2.00", "-", "same")
    assert _misfit_cell(np.nan, 1.0, format_significant).trend == "same"
    assert _misfit_cell(2.0, 1.0, format_significant).trend == "better"
