"""Summaries and pictures of a small store, counted by hand."""

from __future__ import annotations

import csv
import dataclasses
import io
import itertools
from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Rectangle

from engine.batch.batch import Batch, BatchResult
from modewright.render import study as show_study
from sweep.analysis.confidence_interval import wilson_interval
from sweep.analysis.plots import (
    MAX_BINS,
    _assign_bins,
    draw_pictures,
    histogram_bin_edges,
    rank_correlation,
)
from sweep.analysis.summary import Summary, summary_of
from sweep.execution.executor import SerialExecutor
from sweep.execution.study_run import run_study
from sweep.store.store import Store
from tests.sweep.example_studies import QUICK_EXECUTOR, make_study, quick_results, store_rows


def faulty(batch: Batch) -> BatchResult:
    """Results in which the variants with the largest `w` have a fault bit."""
    found = quick_results(batch)
    for place in np.flatnonzero(batch.parameters["oscillator.w"] > 2.6).tolist():
        found.faults[place] = ("oscillator: stuck",)  # type: ignore[index]
    return found


def store_of(folder: Path, *changes: tuple[str, str]) -> Store:
    return run_study(
        make_study("grid", *changes), folder, SerialExecutor(faulty), block_size=13
    ).store


def line(summary: Summary, measure: str, **group: str) -> object:
    return next(x for x in summary.lines if (x.measure, x.group) == (measure, group))


def test_faulty_variants_are_counted_apart_and_in_no_number(tmp_path: Path) -> None:
    found = summary_of(store_of(tmp_path))
    assert found.counts == {"done": 48, "fault": 12}
    assert found.expected == 60
    (t_1,) = [x for x in found.lines if x.measure == "t_1"]
    assert t_1.count == 48
    assert 0.4 <= t_1.low <= t_1.p5 <= t_1.median <= t_1.p95 <= t_1.high <= 0.6
    assert t_1.mean_interval is not None and t_1.mean_interval[0] < t_1.mean < t_1.mean_interval[1]


def test_groups_have_the_numbers_of_their_variants(tmp_path: Path) -> None:
    store = store_of(tmp_path, ("plots:", "summary: {by: [d]}\nplots:"))
    found = summary_of(store)
    finals = [x for x in found.lines if x.measure == "final"]
    assert [x.group["d"] for x in finals] == ["0.1 1/s", "0.2 1/s", "0.4 1/s"]
    assert [x.count for x in finals] == [16, 16, 16]
    assert [x.draws for x in finals] == [4, 4, 4]  # 4 points of w see the same 4 samples
    rows = list(csv.DictReader(io.StringIO(found.csv())))
    assert len(rows) == 15 + 3
    assert float(rows[0]["mean"]) == found.lines[0].mean
    rate = found.rates[0]
    told = rows[15]
    assert [told[k] for k in ("d", "measure", "unit", "mean")] == ["0.1 1/s", "soon", "1", ""]
    assert (int(told["hits"]), int(told["count"])) == (rate.hits, rate.count)
    assert float(told["share"]) == rate.share
    assert rate.interval == (float(told["share_from"]), float(told["share_to"]))
    plain = show_study.summary_json(found)
    assert plain["counts"] == {"done": 48, "fault": 12}
    assert plain["measures"][0]["group"] == {"d": "0.1 1/s"}


def test_rates_of_a_match_have_their_intervals(tmp_path: Path) -> None:
    match = "{match: above, truth: below, before: 1 ms}"
    store = run_study(
        make_study("grid", ("{value: 2 * t_1}", match)), tmp_path, QUICK_EXECUTOR
    ).store
    rates = {rate.measure: rate for rate in summary_of(store).rates}
    assert (rates["twice.missed"].hits, rates["twice.missed"].count) == (60, 60)
    assert rates["twice.first_missed"].draws == 4  # which all 15 points of the grid see
    assert rates["twice.first_missed"].interval == wilson_interval(4, 4, 0.95)


def test_replicates_of_a_study_without_noise_make_nothing_surer(tmp_path: Path) -> None:
    """Here the runner knows no seed: replicates are copies."""

    def still(batch: Batch) -> BatchResult:
        assert batch.seeds is not None
        return quick_results(dataclasses.replace(batch, seeds=np.zeros_like(batch.seeds)))

    drawn = ("{random: 4, seed: 3}", "{random: 40, seed: 3}")
    one_axis = ("w:   {linspace: [1 rad/s, 3 rad/s, 5]}", "w:   [1 rad/s]")
    other = ("d:   [0.1 1/s, 0.2 1/s, 0.4 1/s]", "d:   [0.1 1/s]")
    made = [
        summary_of(run_study(make_study("grid", drawn, one_axis, other, *more), folder, run).store)
        for more, folder in (
            ([], tmp_path / "a"),
            ([("set:", "replicates: 9\nset:")], tmp_path / "b"),
        )
        for run in [SerialExecutor(still)]
    ]
    for one, nine in zip(made[0].lines, made[1].lines, strict=True):
        assert (nine.count, nine.draws, one.draws) == (9 * one.count, 40, 40)
        assert nine.mean_interval == pytest.approx(one.mean_interval)
        assert one.median_interval is not None and nine.median_interval is not None
        assert nine.median_interval[0] <= one.median_interval[0]
        assert one.median_interval[1] <= nine.median_interval[1]


def test_points_of_a_path_are_one_draw(tmp_path: Path) -> None:
    design = ("{random: 4, seed: 3}", "{morris: 6, seed: 3}")
    found = summary_of(run_study(make_study("grid", design), tmp_path, QUICK_EXECUTOR).store)
    assert {(x.count, x.draws) for x in found.lines} == {(6 * 3 * 15, 6)}


def test_a_grid_is_no_sample_and_its_replicates_are(tmp_path: Path) -> None:
    for count in (1, 8):
        made = make_study("alone", ("sampling: one_at_a_time", f"replicates: {count}"))
        store = run_study(made, tmp_path / str(count), QUICK_EXECUTOR).store
        (final,) = [line for line in summary_of(store).lines if line.measure == "final"]
        assert (final.count, final.draws) == (4 * count, count)
        assert (final.mean_interval is None) == (count == 1)


def test_reasons_that_differ_in_numbers_are_one(tmp_path: Path) -> None:
    store = store_of(tmp_path, ("{uniform: [0.5 m, 1.5 m]}", "{uniform: [-0.5 m, 0.5 m]}"),
                     ("set: {x_0: x_1}", "set: {x_0: x_1, d: 4 1/m/s * x_1}"),
                     ("  d:   [0.1 1/s, 0.2 1/s, 0.4 1/s]\n", ""),
                     ("heat_map: peak, over: [w, d]", "heat_map: peak, over: [w, x_1]"),
                     ("histogram: t_1, by: d", "histogram: t_1, by: w"))  # fmt: skip
    found = summary_of(store)
    refused = found.counts["refused"]
    assert 1 < refused < 60
    texts = show_study.failure_texts(found)
    assert len(texts) == 2 and {"fault", "refused"} == {one.status for one in found.failures}
    (one,) = [one for one in found.failures if one.status == "refused"]
    assert (one.count, one.message.endswith("is outside its range [0, 10]")) == (refused, True)
    first = next(row for row in store_rows(store) if row["status"] == "refused")
    assert (one.number, one.message) == (first["number"], first["message"])
    assert any("fault bit is set: `oscillator: stuck` (variant " in text for text in texts)
    assert show_study.summary_json(found)["failures"][0]["count"] == found.failures[0].count


def test_what_is_the_case_has_a_rate_and_no_mean(tmp_path: Path) -> None:
    store = run_study(make_study(), tmp_path, QUICK_EXECUTOR).store
    found = summary_of(store)
    (rate,) = found.rates
    hits = sum(row["t_1"] < 0.5 for row in store_rows(store))  # type: ignore[operator]
    assert (rate.measure, rate.hits, rate.count) == ("soon", hits, 60)
    assert 0 < hits < 60 and rate.interval is not None
    assert rate.interval[0] < hits / 60 < rate.interval[1]
    assert [x.measure for x in found.lines] == ["t_1", "falls", "peak", "final", "twice"]


def test_nothing_finished_is_an_empty_summary(tmp_path: Path) -> None:
    store = run_study(make_study(), tmp_path, lambda study, blocks: iter(())).store
    found = summary_of(store)
    assert found.counts == {}
    assert all(x.count == 0 and np.isnan(x.median) for x in found.lines)
    assert set(draw_pictures(store)) == {"heat", "lines", "matters", "spread"}


def test_pictures_show_what_the_store_holds(tmp_path: Path) -> None:
    store = store_of(tmp_path)
    drawn = draw_pictures(store)
    heat = drawn["heat"].figure.axes[0]
    assert [t.get_text() for t in heat.get_xticklabels()] == ["1", "1.5", "2", "2.5"]
    assert len(heat.texts) == 12
    assert heat.get_ylabel() == "d [1/s]"
    assert len(drawn["lines"].figure.axes[0].collections[0].get_paths()) == 48
    bars = drawn["matters"].figure.axes[0].patches
    assert len(bars) == 4
    spread = drawn["spread"].figure.axes
    bars_of = [bar for axis in spread for bar in axis.patches if isinstance(bar, Rectangle)]
    heights = [bar.get_height() for bar in bars_of]
    assert sum(heights) == 48
    assert drawn["heat"].data("svg") == draw_pictures(store)["heat"].data("svg")


def test_a_tornado_of_one_at_a_time_goes_from_lowest_to_highest(tmp_path: Path) -> None:
    store = run_study(make_study("alone"), tmp_path, QUICK_EXECUTOR).store
    axis = draw_pictures(store)["matters"].figure.axes[0]
    widths = [bar.get_extents().width for bar in axis.patches]
    assert len(widths) == 2
    assert widths == sorted(widths)
    assert all(width > 0 for width in widths)


def test_a_rank_correlation_sees_what_rises_together() -> None:
    a = np.array([1.0, 2.0, 3.0, 4.0])
    assert rank_correlation(a, np.exp(a)) == pytest.approx(1.0)
    assert rank_correlation(a, -(a**3)) == pytest.approx(-1.0)
    assert rank_correlation(a, np.ones(4)) == 0.0


def test_numbers_that_are_not_there_are_in_no_bin_of_many() -> None:
    values = np.array([*np.linspace(0.0, 1.0, 40), np.nan])
    places, middles = _assign_bins(values)
    assert places[-1] == -1
    assert (places[0], places[-2], len(middles)) == (0, 11, 12)


@pytest.mark.parametrize("count", [5, 9, 12, 24, 40])
def test_no_label_of_a_heat_map_is_over_another(count: int, tmp_path: Path) -> None:
    axes = (
        ("[1 rad/s, 3 rad/s, 5]", f"[1 rad/s, 3.14159 rad/s, {count}]"),
        ("[0.1 1/s, 0.2 1/s, 0.4 1/s]", f"{{linspace: [0.001 1/s, 0.4567 1/s, {count}]}}"),
        ("histogram: t_1, by: d", "histogram: t_1"),
        ("{random: 4, seed: 3}", "{random: 1, seed: 3}"),
    )
    store = run_study(make_study("grid", *axes), tmp_path, QUICK_EXECUTOR, block_size=5000).store
    figure = draw_pictures(store)["heat"].figure
    figure.canvas.draw()
    for labels in (figure.axes[0].get_xticklabels(), figure.axes[0].get_yticklabels()):
        boxes = [label.get_window_extent() for label in labels]
        assert len(boxes) == (count if count <= 24 else 12)
        assert not any(a.overlaps(b) for a, b in itertools.pairwise(boxes))


@pytest.mark.parametrize(
    "values", [[1.0e17], [1.0, 1.0 + 2.0**-52], [0.0, 0.0], [-1.0e300, -1.0e300], []]
)
def test_values_that_are_as_good_as_one_have_one_bin(values: list[float]) -> None:
    low, high = histogram_bin_edges(np.array(values))
    assert low < high
    assert all(low < value < high for value in values)


def test_bins_are_as_many_as_numpy_takes_but_not_without_end() -> None:
    values = np.random.default_rng(5).normal(size=400)
    np.testing.assert_allclose(
        histogram_bin_edges(values), np.histogram_bin_edges(values, bins="auto")
    )
    assert len(histogram_bin_edges(np.append(values, 1.0e9))) == MAX_BINS + 1
