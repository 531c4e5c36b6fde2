"""Pictures: what stands on the axes, by what the figure holds (not by pixels)."""

from __future__ import annotations

import dataclasses
import itertools
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from matplotlib.colors import to_hex

from engine.results.mode_band import INACTIVE_COLOUR, PALETTE
from engine.results.plot import draw_overview
from engine.results.sampled_run import Event
from engine.results.trajectory import Trajectory


def run(scale: float = 1.0) -> Trajectory:
    times = np.linspace(0.0, 1.0, 11)
    return Trajectory(
        name="wave",
        times=times,
        signals={
            "p.T": scale * np.sin(times),
            "p.T_big": scale * 100.0 * np.cos(times),
            "p.w": np.full(11, np.nan),
            "p.count": np.arange(11),
            "p.mode": np.repeat([0, 1], [5, 6]),
        },
        units={"p.T": "N*m", "p.T_big": "N*m", "p.w": "rad/s", "p.count": "1", "p.mode": "1"},
        modes={"p.mode": {0: "gap", 1: "drive"}},
        events=(Event(0.45, 1, "p", "drive", "gap", "drive"),),
    )


def test_signals_share_an_axis_by_unit_and_size_and_every_axis_says_its_quantity() -> None:
    axes = draw_overview([run()]).figure.axes
    assert [axis.get_ylabel() for axis in axes[1:]] == [
        "torque [N*m]",
        "torque [N*m]",
        "angular speed [rad/s]",
        "number [1]",
    ]
    assert axes[-1].get_xlabel() == "time [s]"
    assert {text.get_text() for text in axes[0].texts} == {"gap", "drive"}


def test_mode_changes_are_marked_in_every_panel_and_named_in_its_legend() -> None:
    for axis in draw_overview([run()]).figure.axes[1:]:
        legend = axis.get_legend()
        assert legend and "mode changes" in [text.get_text() for text in legend.get_texts()]
        dotted = [line for line in axis.lines if line.get_linestyle() == ":"]
        assert [list(np.ravel(line.get_xdata())) for line in dotted] == [[0.45, 0.45]]


def test_what_fires_and_changes_no_mode_is_not_marked() -> None:
    stays = Event(0.7, 0, "p", "count", "drive", "drive")
    ranged = Event(0.8, 0, "p", "range T", "drive", "drive", kind="range", message="too large")
    shown = draw_overview([dataclasses.replace(run(), events=(*run().events, stays, ranged))])
    dotted = [line for line in shown.figure.axes[1].lines if line.get_linestyle() == ":"]
    assert [list(np.ravel(line.get_xdata())) for line in dotted] == [[0.45, 0.45]]


def test_a_region_without_a_mode_has_no_colour_of_a_mode() -> None:
    plain = run()
    rows = {**plain.signals, "p.mode": np.repeat([-1, 0, 1], [4, 3, 4])}
    modes = {"p.mode": {-1: "inactive", 0: "gap", 1: "drive"}}
    band = draw_overview([dataclasses.replace(plain, signals=rows, modes=modes)]).figure.axes[0]
    colours = [to_hex(patch.get_facecolor()) for patch in band.patches]
    assert colours == [INACTIVE_COLOUR, *PALETTE[:2]]


def test_the_second_run_is_dashed_in_the_colours_of_the_first() -> None:
    axis = draw_overview([run(), run(1.1)], ["p.T"]).figure.axes[-1]
    first, second = axis.lines[:2]
    assert (first.get_linestyle(), second.get_linestyle()) == ("-", "--")
    assert first.get_color() == second.get_color()
    assert (first.get_label(), second.get_label()) == ("p.T, A", "p.T, B")


def test_an_unknown_signal_names_the_nearest() -> None:
    with pytest.raises(ValueError, match=r"did you mean `p\.T_big`"):
        draw_overview([run()], ["p.T_bg"])


@pytest.mark.parametrize("span", [(1.5, np.inf), (-np.inf, -0.5), (0.51, 0.59)])
def test_a_window_without_samples_is_refused(span: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match=r"no sample lies in .*: they cover 0 s to 1 s"):
        draw_overview([run()], span=span)


def test_the_same_run_gives_the_same_svg_and_it_is_xml() -> None:
    first, second = draw_overview([run()]).data("svg"), draw_overview([run()]).data("svg")
    assert first == second
    assert ElementTree.fromstring(first).tag.endswith("svg")


def test_a_run_without_samples_has_a_picture() -> None:
    empty = Trajectory("none", np.zeros(0), {"a": np.zeros(0)}, {"a": "1"}, {}, ())
    assert draw_overview([empty]).data().startswith(b"\x89PNG")


def strip(modes: list[int], names: dict[int, str]) -> Trajectory:
    rows = {**run().signals, "p.mode": np.array(modes)}
    return dataclasses.replace(run(), signals=rows, modes={"p.mode": names})


def test_modes_that_follow_each_other_have_two_colours_and_a_border_however_many_there_are() -> (
    None
):
    names = {number: f"m{number}" for number in range(50)}
    band = draw_overview([strip([0, 7, 14, 21, 42, 0, 28, 49, 7, 35, 0], names)]).figure.axes[0]
    colours = [to_hex(patch.get_facecolor()) for patch in band.patches]
    assert all(one != other for one, other in itertools.pairwise(colours))
    assert colours[0] == colours[5] == colours[10]
    assert all(to_hex(patch.get_edgecolor()) == "#ffffff" for patch in band.patches)
    assert all(patch.get_linewidth() > 0.0 for patch in band.patches[:-1])  # the last is no time


def test_a_mode_is_named_where_its_name_fits_whole_else_in_the_legend() -> None:
    names = {0: "idle", 1: "session.charging.derated", 2: "session.charging.done_and_parked"}
    long = strip([0] * 4 + [2] * 1 + [1] * 6, names)
    picture = draw_overview([long])
    picture.data()
    axis = picture.figure.axes[0]
    legend = axis.get_legend()
    assert legend and [each.get_text() for each in legend.get_texts()] == [names[2]]
    assert [each.get_text() for each in axis.texts] == [names[0], names[1]]
    for text, patch in zip(axis.texts, (axis.patches[0], axis.patches[2]), strict=True):
        box, of = text.get_window_extent(), patch.get_window_extent()
        assert of.x0 < box.x0 < box.x1 < of.x1


def test_an_automaton_that_has_no_modes_has_no_band() -> None:
    assert len(draw_overview([strip([0] * 11, {0: "always"})]).figure.axes) == 4
    assert len(draw_overview([strip([0] * 11, {0: "gap"})]).figure.axes) == 5


@pytest.mark.parametrize(
    ("count", "stride", "label"),
    [
        (200, 1, "mode changes"),
        (201, 2, "mode changes, 1 of 2 (201)"),
        (500, 3, "mode changes, 1 of 3 (500)"),
    ],
)
def test_mode_changes_are_thinned_over_the_whole_time(count: int, stride: int, label: str) -> None:
    times = np.arange(1, count + 1) / count
    events = tuple(Event(float(t), 1, "p", "drive", "gap", "drive") for t in times)
    axis = draw_overview([dataclasses.replace(run(), events=events)]).figure.axes[1]
    dotted = [np.ravel(line.get_xdata())[0] for line in axis.lines if line.get_linestyle() == ":"]
    assert dotted == list(times[::stride])
    legend = axis.get_legend()
    assert legend and label in [text.get_text() for text in legend.get_texts()]


def test_piecewise_constant_signals_are_drawn_as_steps() -> None:
    wave = dataclasses.replace(run(), piecewise_constant=frozenset({"p.T"}))
    axes = draw_overview([wave, run()]).figure.axes
    styles = {line.get_label(): line.get_drawstyle() for axis in axes for line in axis.lines}
    assert styles["p.T, A"] == "steps-post"
    assert styles["p.T, B"] == styles["p.T_big, A"] == "default"
