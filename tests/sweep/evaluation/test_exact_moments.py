"""Numbers of numbers against exact fractions, up to the largest that there are."""

from __future__ import annotations

import json
import math
import re
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from engine.batch.batch import Batch, BatchResult
from modewright.render.study import summary_json
from sweep.analysis.confidence_interval import interval_of_mean, interval_of_quantile
from sweep.analysis.plots import draw_pictures
from sweep.analysis.summary import summary_of
from sweep.evaluation.exact_moments import (
    deviation_of,
    mean_of,
    quantiles_of,
    root_mean_square,
    total_of,
)
from sweep.execution.executor import SerialExecutor
from sweep.execution.study_run import run_study
from tests.sweep.evaluation.test_measures import make_observation, signal
from tests.sweep.example_studies import make_study, quick_results, store_rows

ORDINARY = np.random.default_rng(2).normal(3.0, 2.0, 200)
LARGEST = 1.7e308


@pytest.mark.parametrize("exponent", [0, 300, 600, 1015, -300])
def test_moments_are_those_of_exact_arithmetic_at_any_size(exponent: int) -> None:
    values = np.ldexp(ORDINARY, exponent)
    exact = [Fraction(float(value)) for value in values]
    mean = sum(exact) / len(exact)
    assert mean_of(values) == pytest.approx(float(mean), rel=1e-15)
    spread = sum((one - mean) ** 2 for one in exact) / (len(exact) - 1)
    root = math.ldexp(math.sqrt(spread / Fraction(2) ** (2 * exponent)), exponent)
    assert deviation_of(values) == pytest.approx(root, rel=1e-14)
    square = sum(one**2 for one in exact) / len(exact)
    root = math.ldexp(math.sqrt(square / Fraction(2) ** (2 * exponent)), exponent)
    assert root_mean_square(values) == pytest.approx(root, rel=1e-14)
    assert quantiles_of(values, (0.5,)) == [float(np.quantile(values, 0.5))]


def test_ordinary_numbers_have_the_bits_of_plain_sums() -> None:
    assert mean_of(ORDINARY) == math.fsum(ORDINARY) / 200
    assert total_of(ORDINARY) == math.fsum(ORDINARY)
    assert root_mean_square(ORDINARY) == math.sqrt(math.fsum(ORDINARY * ORDINARY) / 200)


def test_what_is_larger_than_any_number_is_none() -> None:
    values = np.array([LARGEST, LARGEST, -LARGEST, LARGEST])
    assert mean_of(values) == LARGEST / 2
    assert math.isnan(total_of(values[:2]))
    assert interval_of_mean(values, np.arange(4), 0.95) is None
    assert interval_of_quantile(np.tile(values, 20), np.arange(80), 0.5, 0.95) == (LARGEST, LARGEST)
    pairs = np.tile([0.5 * LARGEST, 0.4 * LARGEST], 38)  # four of them are more than any number
    low, high = interval_of_mean(pairs, np.arange(76) // 4, 0.95) or (0.0, 0.0)
    assert low == high == pytest.approx(0.45 * LARGEST)
    assert quantiles_of(values, (0.0, 0.25, 1.0)) == [-LARGEST, LARGEST / 2, LARGEST]


@pytest.mark.filterwarnings("error")
def test_measures_of_the_largest_signals_are_finite_or_null() -> None:
    wave = LARGEST * np.sin(np.arange(0.0, 40.0, 0.25))
    seen = make_observation(times=np.arange(160.0) / 80.0, values=wave)  # type: ignore[arg-type]
    assert signal("mean", seen) == pytest.approx(math.fsum(wave / LARGEST) / 160 * LARGEST)
    assert signal("rms", seen) == pytest.approx(LARGEST * np.sqrt(np.mean((wave / LARGEST) ** 2)))
    for by in ("crossings", "spectrum"):
        assert signal("frequency", seen, by=by) == pytest.approx(20.0 / (2.0 * math.pi), rel=0.02)
    assert signal("settling", seen, within=1.0) == 159 / 80.0


def huge(batch: Batch) -> BatchResult:
    """Results of both signs, some the largest that there are, some of ordinary size."""
    found = quick_results(batch)
    for values in found.outputs.values():
        values[0::3] = LARGEST
        values[1::3] = -LARGEST
    return found


@pytest.mark.filterwarnings("error")
def test_a_study_of_the_largest_numbers_is_summed_up_and_drawn(tmp_path: Path) -> None:
    changes = (
        ("[1 rad/s, 3 rad/s, 5]", "[1 rad/s, 2 rad/s, 3]"),
        ("[0.5 m, 1.5 m]", "[1 m, 1.0e307 m]"),
    )
    store = run_study(make_study("grid", *changes), tmp_path, SerialExecutor(huge)).store
    found = summary_of(store)
    (final,) = [line for line in found.lines if line.measure == "final"]
    assert (final.count, final.low, final.high) == (36, -LARGEST, LARGEST)
    assert math.isnan(final.deviation) or math.isfinite(final.deviation)
    json.dumps(summary_json(found), allow_nan=False)
    drawn = draw_pictures(store)
    assert all(picture.data("svg") for picture in drawn.values())
    shown = drawn["heat"].figure.get_suptitle()
    assert re.search(r"\(36 variants, without \d\d numbers above 1e\+300\)", shown), shown


def test_an_infinite_number_in_a_store_counts_as_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As stores of before hold it: the root mean square of a signal above 1e154."""
    monkeypatch.setattr(
        "sweep.evaluation.evaluate_measures.evaluate_signal", lambda *given: math.inf
    )
    store = run_study(make_study("alone"), tmp_path, SerialExecutor(quick_results)).store
    assert [row["final"] for row in store_rows(store)] == [math.inf] * 5
    found = summary_of(store)
    assert found.lines[0].count == 0
    json.dumps(summary_json(found), allow_nan=False)
    assert draw_pictures(store)["matters"].data("svg")
