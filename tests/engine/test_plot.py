"""Pictures: what stands on the axes, by what the figure holds (not by pixels)."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from matplotlib.colors import to_hex

from engine.band import INACTIVE_COLOUR, PALETTE
from engine.plot import overview
from engine.trajectory import Event, Trajectory


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
    axes = overview([run()]).figure.axes
    assert [axis.get_ylabel() for axis in axes[1:]] == [
        "torque [N*m]",
        "torque [N*m]",
        "angular speed [rad/s]",
        "number [1]",
    ]
    assert axes[-1].get_xlabel() == "time [s]"
    assert {text.get_text() for text in axes[0].texts} == {"gap", "drive"}


def test_mode_changes_are_marked_in_every_panel_and_named_in_its_legend() -> None:
    for axis in overview([run()]).figure.axes[1:]:
        legend = axis.get_legend()
        assert legend and "mode changes" in [text.get_text() for text in legend.get_texts()]
        dotted = [line for line in axis.lines if line.get_linestyle() == ":"]
        assert [list(np.ravel(line.get_xdata())) for line in dotted] == [[0.45, 0.45]]


def test_what_fires_and_changes_no_mode_is_not_marked() -> None:
    stays = Event(0.7, 0, "p", "count", "drive", "drive")
    ranged = Event(0.8, 0, "p", "range T", "drive", "drive", kind="range", message="too large")
    shown = overview([dataclasses.replace(run(), events=(*run().events, stays, ranged))])
    dotted = [line for line in shown.figure.axes[1].lines if line.get_linestyle() == ":"]
    assert [list(np.ravel(line.get_xdata())) for line in dotted] == [[0.45, 0.45]]


def test_a_region_without_a_mode_has_no_colour_of_a_mode() -> None:
    plain = run()
    rows = {**plain.signals, "p.mode": np.repeat([-1, 0, 1], [4, 3, 4])}
    modes = {"p.mode": {-1: "inactive", 0: "gap", 1: "drive"}}
    band = overview([dataclasses.replace(plain, signals=rows, modes=modes)]).figure.axes[0]
    colours = [to_hex(patch.get_facecolor()) for patch in band.patches]
    assert colours == [INACTIVE_COLOUR, *PALETTE[:2]]


def test_the_second_run_is_dashed_in_the_colours_of_the_first() -> None:
    axis = overview([run(), run(1.1)], ["p.T"]).figure.axes[-1]
    first, second = axis.lines[:2]
    assert (first.get_linestyle(), second.get_linestyle()) == ("-", "--")
    assert first.get_color() == second.get_color()
    assert (first.get_label(), second.get_label()) == ("p.T, A", "p.T, B")


def test_an_unknown_signal_names_the_nearest() -> None:
    with pytest.raises(ValueError, match=r"did you mean `p\.T_big`"):
        overview([run()], ["p.T_bg"])


def test_the_same_run_gives_the_same_svg_and_it_is_xml() -> None:
    first, second = overview([run()]).data("svg"), overview([run()]).data("svg")
    assert first == second
    assert ElementTree.fromstring(first).tag.endswith("svg")


def test_a_run_without_samples_has_a_picture() -> None:
    empty = Trajectory("none", np.zeros(0), {"a": np.zeros(0)}, {"a": "1"}, {}, ())
    assert overview([empty]).data().startswith(b"\x89PNG")
