"""Differences of runs, by values that are worked out by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from engine.results.comparison_plot import draw_difference
from engine.results.run_comparison import compare_runs
from engine.results.sampled_run import Event
from engine.results.time_alignment import TimeShift, shift_times
from engine.results.trajectory import Trajectory
from language.text.diagnostic import DataError


def run(values: list[float], modes: list[int] | None = None, step: float = 1.0) -> Trajectory:
    times = np.array([step * k for k in range(len(values))])
    modes = modes or [0] * len(values)
    names = {0: "gap", 1: "drive"}
    events = [
        Event(float(times[k]), 1, "p", names[modes[k]], names[modes[k - 1]], names[modes[k]])
        for k in range(1, len(modes))
        if modes[k] != modes[k - 1]
    ]
    signals = {"p.T": np.array(values), "p.mode": np.array(modes, dtype=np.int64)}
    return Trajectory(
        "r", times, signals, {"p.T": "N*m", "p.mode": "1"}, {"p.mode": names}, tuple(events)
    )


def test_a_run_does_not_differ_from_itself() -> None:
    found = compare_runs(run([1.0, -0.0, math.nan]), run([1.0, -0.0, math.nan]))
    assert found.is_within and found.first is None
    assert (found.signals[0].rms, found.signals[0].largest) == (0.0, 0.0)


def test_rms_largest_and_first_are_those_of_the_formula() -> None:
    found = compare_runs(run([0.0, 4.0, 0.0, 0.0]), run([0.0, 1.0, -4.0, 0.0]))
    (signal,) = found.signals
    assert signal.rms == math.sqrt((9 + 16) / 4)
    assert (signal.largest, signal.at, signal.first) == (4.0, 2.0, 1.0)
    assert not found.is_within
    assert found.first == (1.0, "p.T")


def test_one_last_bit_is_a_difference_and_a_tolerance_allows_it() -> None:
    a, b = run([1.0, 1.0]), run([1.0, math.nextafter(1.0, 2.0)])
    assert not compare_runs(a, b).is_within
    assert compare_runs(a, b, relative=1e-15).is_within
    assert compare_runs(a, b, tolerances={"*.T": 3e-16}).is_within
    assert not compare_runs(a, b, tolerances={"*.T": 2e-16}).is_within


def test_a_number_against_none_is_an_infinite_difference() -> None:
    found = compare_runs(run([1.0, 1.0]), run([1.0, math.nan]), relative=10.0)
    assert found.signals[0].largest == math.inf
    assert not found.is_within


def test_another_time_base_is_read_on_straight_lines_and_modes_are_held() -> None:
    coarse = run([0.0, 2.0, 4.0], [0, 1, 1], step=2.0)
    fine = run([0.0, 1.0, 2.0, 3.0, 4.0], [0, 0, 1, 1, 1])
    assert compare_runs(fine, coarse).is_within
    assert compare_runs(coarse, fine).is_within


def test_windows_say_who_was_in_which_mode() -> None:
    found = compare_runs(run([0.0] * 5, [0, 1, 1, 1, 0]), run([0.0] * 5, [0, 0, 0, 1, 0]))
    (window,) = found.windows
    assert (window.start, window.end, window.a, window.b) == (1.0, 3.0, "drive", "gap")
    assert found.sequences[0].first_difference is None
    assert found.sequences[0].largest_time_difference == 2.0
    assert not found.is_within
    late = compare_runs(run([0.0] * 5, [0, 1, 1, 1, 0]), run([0.0] * 5, [0, 0, 0, 1, 0]), slack=2.0)
    assert late.is_within


def test_sequences_part_where_a_transition_is_missing() -> None:
    found = compare_runs(run([0.0] * 4, [0, 1, 0, 1]), run([0.0] * 4, [0, 1, 0, 0]))
    (sequence,) = found.sequences
    assert (sequence.count_a, sequence.count_b, sequence.first_difference) == (3, 2, 2)


def test_regions_beside_each_other_are_sequences_of_their_own() -> None:
    first = Event(1.0, 0, "p", "b", "a", "b", "chart")
    second = Event(1.0, 0, "p", "d", "c", "d", "gap")
    a = replace(run([0.0] * 3), events=(first, second))
    found = compare_runs(a, replace(a, events=(second, first)))
    assert [(each.instance, each.first_difference) for each in found.sequences] == [
        ("p", None),
        ("p.gap", None),
    ]


def test_samples_alone_are_compared_with_a_run_that_has_events() -> None:
    a = run([0.0] * 4, [0, 1, 0, 1])
    b = Trajectory("b", a.times, a.signals, a.units, {}, ())
    assert compare_runs(a, b).is_within
    assert compare_runs(b, a).is_within


def test_a_shorter_run_and_a_missing_signal_are_not_within() -> None:
    short = compare_runs(run([0.0] * 5), run([0.0] * 3))
    assert (short.uncovered, short.is_within) == (2.0, False)
    assert compare_runs(run([0.0] * 5), run([0.0] * 3), span=(0.0, 2.0)).is_within
    a = run([0.0, 0.0])
    b = Trajectory("b", a.times, {"p.T": a.signals["p.T"]}, {"p.T": "N*m"}, {}, ())
    assert compare_runs(a, b).only_a == ("p.mode",)
    assert compare_runs(b, a).only_b == ("p.mode",)
    assert not compare_runs(a, b).is_within
    assert compare_runs(a, b, patterns=["p.T"]).is_within


@pytest.mark.parametrize(
    ("b", "told"),
    [
        (Trajectory("b", np.zeros(1), {"p.T": np.zeros(1)}, {"p.T": "N"}, {}, ()), "is in `N"),
        (Trajectory("b", np.zeros(1), {"q": np.zeros(1)}, {"q": "N"}, {}, ()), "no signal in c"),
        (Trajectory("b", np.array([9.0]), {"p.T": np.zeros(1)}, {"p.T": "N*m"}, {}, ()), "no time"),
        (Trajectory("b", np.zeros(0), {"p.T": np.zeros(0)}, {"p.T": "N*m"}, {}, ()), "without sam"),
    ],
)
def test_what_cannot_be_compared_is_refused(b: Trajectory, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        compare_runs(run([0.0, 1.0]), b)


def test_a_tolerance_for_no_signal_is_refused() -> None:
    with pytest.raises(ValueError, match=r"no common signal matches the tolerance of `q"):
        compare_runs(run([0.0]), run([0.0]), tolerances={"q": 1.0})


@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf])
def test_a_tolerance_that_is_negative_or_not_finite_is_refused(value: float) -> None:
    for given in ({"tolerances": {"p.T": value}}, {"relative": value}, {"slack": value}):
        with pytest.raises(ValueError, match="it is finite and at least 0"):
            compare_runs(run([0.0]), run([0.0]), **given)


def test_the_picture_shades_where_modes_disagree_and_draws_the_difference() -> None:
    a, b = run([0.0] * 5, [0, 1, 1, 1, 0]), run([1.0] * 5, [0, 0, 0, 1, 0])
    figure = draw_difference(a, b, compare_runs(a, b), ("one", "two")).figure
    assert figure.axes[0].get_title(loc="left") == "A: one; B: two; shaded: modes disagree"
    labels = [text.get_text() for text in figure.axes[-1].get_legend().get_texts()]  # type: ignore[union-attr]
    assert labels[0] == "A - B, RMS 1"
    assert list(figure.axes[-1].lines[0].get_ydata()) == [-1.0] * 5  # type: ignore[arg-type]


def renamed(made: Trajectory, instance: str) -> Trajectory:
    """Return a run of `p` with another name of its instance."""
    return replace(
        made,
        signals={name.replace("p.", f"{instance}."): v for name, v in made.signals.items()},
        units={name.replace("p.", f"{instance}."): v for name, v in made.units.items()},
        modes={name.replace("p.", f"{instance}."): v for name, v in made.modes.items()},
        events=tuple(replace(event, instance=instance) for event in made.events),
    )


def test_runs_of_one_instance_each_are_compared_by_signal() -> None:
    a, b = run([0.0, 4.0, 0.0]), renamed(run([0.0, 1.0, 0.0]), "variant")
    found = compare_runs(a, b, tolerances={"p.T": 5.0})
    assert found.renamed_instance == "variant"
    assert [signal.name for signal in found.signals] == ["p.T"]
    assert found.is_within and found.only_a == found.only_b == ()
    assert draw_difference(a, b, found, ("A", "B")).data().startswith(b"\x89PNG")


def test_the_transitions_of_a_renamed_instance_are_compared() -> None:
    a = run([0.0, 0.0, 0.0], [0, 1, 1])
    found = compare_runs(a, renamed(run([0.0, 0.0, 0.0], [0, 0, 0]), "variant"))
    assert [sequence.instance for sequence in found.sequences] == ["p"]
    assert (found.sequences[0].count_a, found.sequences[0].count_b) == (1, 0)


@pytest.mark.parametrize("name", ["q.other", "T"])
def test_an_instance_is_renamed_only_if_a_signal_is_in_common_then(name: str) -> None:
    a = run([1.0])
    b = Trajectory("b", a.times, {name: np.zeros(1)}, {name: "N*m"}, {}, ())
    message = f"the signals of A are p.T, p.mode; those of B are {name}"
    with pytest.raises(ValueError, match=f"no signal in common: {message}"):
        compare_runs(a, b)


def test_an_instance_among_others_is_not_renamed() -> None:
    a, b = run([1.0]), renamed(run([1.0]), "first")
    both = replace(
        b,
        signals={**b.signals, "second.T": np.zeros(1)},
        units={**b.units, "second.T": "N*m"},
    )
    with pytest.raises(ValueError, match="no signal in common"):
        compare_runs(a, both)


def noise(times: NDArray[np.float64]) -> Trajectory:
    """Return a run with a smooth and a held signal at times (n,) [s]."""
    smooth = np.sin(3 * times) + np.exp(-((times - 2.0) ** 2))
    held = np.floor(times / 0.25)
    return Trajectory(
        "r",
        times,
        {"p.x": smooth, "p.h": held},
        {"p.x": "m", "p.h": "1"},
        {},
        (Event(1.0, 1, "p", "t", "a", "b"),),
        piecewise_constant=frozenset({"p.h"}),
    )


def test_a_held_signal_is_held_between_samples() -> None:
    fine, coarse = np.arange(0.0, 4.0, 0.01), np.arange(0.0, 4.0, 0.25)
    found = compare_runs(noise(coarse), noise(fine), patterns=["p.h"], span=(0.0, 3.75))
    assert found.is_within
    found = compare_runs(noise(fine), noise(coarse), patterns=["p.h"], span=(0.0, 3.7))
    assert found.signals[0].largest == 0.0


@pytest.mark.parametrize("shift", [0.35, -0.2, 0.0137, 0.0])
@pytest.mark.parametrize("period", [0.01, 0.013])
def test_the_time_shift_of_a_run_is_found(shift: float, period: float) -> None:
    a, b = noise(np.arange(0.0, 5.0, 0.01)), noise(np.arange(0.0, 5.0, period))
    moved = shift_times(b, -shift)
    found = compare_runs(a, moved, offset=None, patterns=["p.x"], relative=1e-3)
    assert found.shift.offset == pytest.approx(shift, abs=2e-4)
    assert found.shift.correlation == pytest.approx(1.0, abs=1e-3)
    assert all(signal.first is None for signal in found.signals)


def test_a_stated_offset_moves_samples_and_events() -> None:
    a = noise(np.arange(0.0, 5.0, 0.01))
    assert shift_times(a, 0.5).events[0].time == 1.5
    found = compare_runs(a, shift_times(a, -0.5), offset=0.5, relative=1e-12)
    assert found.is_within and found.shift == TimeShift(0.5)


@pytest.mark.parametrize(
    ("other", "reason"),
    [
        (replace(noise(np.arange(0.0, 5.0, 0.01)), signals={"p.x": np.ones(500)}), "varies"),
        (
            replace(
                noise(np.arange(0.0, 5.0, 0.01)),
                signals={"p.x": np.random.default_rng(1).normal(size=500)},
            ),
            "do not correlate",
        ),
    ],
)
def test_runs_that_do_not_correlate_are_refused(other: Trajectory, reason: str) -> None:
    with pytest.raises(DataError, match=reason):
        compare_runs(noise(np.arange(0.0, 5.0, 0.01)), other, offset=None, patterns=["p.x"])


@pytest.mark.parametrize("offset", [math.nan, math.inf])
def test_an_offset_is_a_finite_time(offset: float) -> None:
    with pytest.raises(ValueError, match="finite time"):
        compare_runs(run([1.0, 1.0]), run([1.0, 1.0]), offset=offset)


def test_a_window_outside_of_both_runs_is_a_wrong_argument() -> None:
    with pytest.raises(ValueError, match="no sample from 99 s to inf s") as caught:
        compare_runs(run([1.0, 1.0]), run([1.0, 1.0]), span=(99.0, math.inf))
    assert not isinstance(caught.value, DataError)
