"""Errors of recordings that have no sample in free simulation are unknown, without a warning."""

from __future__ import annotations

import warnings
from fractions import Fraction

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.report.model_comparison import rms_of_free_parts
from diagnosis.report.number_text import format_significant
from diagnosis.report.tables import misfit_cell
from diagnosis.validation.free_simulation import is_free


def recording(count: int) -> SampledRecording:
    measured = np.column_stack([np.arange(count, dtype=np.float64), np.full(count, np.nan)])
    return SampledRecording("a.csv", Fraction(1, 100), Fraction(0), np.zeros((count, 0)), measured)


def test_an_error_without_values_is_unknown() -> None:
    short, long = recording(3), recording(600)
    assert not np.any(is_free(short))
    runs = [np.where(np.isnan(one.measured), 0.0, one.measured + 2.0) for one in (short, long)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = [rms_of_free_parts(*pair) for pair in zip((short, long), runs, strict=True)]
    assert np.isnan(found[0]).all()
    np.testing.assert_allclose(found[1], [2.0, np.nan])


def test_an_unknown_change_is_no_trend() -> None:
    before, after, _, trend = misfit_cell(2.0, np.nan, format_significant)
    assert (before, after, trend) == ("2.00", "-", "same")
    assert misfit_cell(np.nan, 1.0, format_significant)[-1] == "same"
    assert misfit_cell(2.0, 1.0, format_significant)[-1] == "better"
