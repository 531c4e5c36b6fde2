"""Stimulus: inputs of a scenario that come from a recording."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from tests.language.spec_builders import problem_lines, project_of

CART = """language: 1
automaton: cart
step: 7 ms
inputs: {u: {unit: m/s}, hill: {default: 0}}
states: {x: {unit: m, initial: 0 m}, top: {unit: m/s, initial: u}}
flow: {x: der(x) = u, top: der(top) = 0}
initial: only
modes: {only: {number: 0}}
outputs: [x, top]
"""
RUN = """language: 1
scenario: run
of: cart
horizon: {horizon}
recording:
  file: drive.csv
  time: {{column: t, unit: ms}}
  columns:
    speed: {{to: u, unit: km/h, hold: {hold}}}
    way: {{compare: x, unit: m}}
initial: {{x: column(way)}}
record: {{every: 0.25 s, signals: [x, u, top]}}
"""
DRIVE = "t,speed,way\n1000,3.6,5\n2000,10.8,6\n2500,10.8,7\n"
"""1 m/s at 1 s, 3 m/s at 2 s and at 2.5 s."""


def run(folder: Path, hold: str, horizon: str = "recording", drive: str = DRIVE) -> mw.Trajectory:
    project_of(folder, cart=CART, run=RUN.format(hold=hold, horizon=horizon))
    (folder / "spec" / "drive.csv").write_text(drive)
    return mw.simulate("cart", "run", root=folder)


def test_a_recording_is_an_input_that_is_linear_between_its_stamps(tmp_path: Path) -> None:
    found = run(tmp_path, "linear")
    assert found.times.tolist() == [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5]
    assert found.signals["u"] == pytest.approx([1.0, 1.5, 2.0, 2.5, 3.0, 3.0, 3.0])
    assert found.signals["cart.x"][[0, 4, 6]] == pytest.approx([5.0, 7.0, 8.5], abs=1e-13)
    assert found.signals["cart.top"][0] == 1.0


def test_a_recording_is_an_input_that_is_held(tmp_path: Path) -> None:
    found = run(tmp_path, "previous")
    assert found.signals["u"] == pytest.approx([1.0, 1.0, 1.0, 1.0, 3.0, 3.0, 3.0])
    assert found.signals["cart.x"][[4, 6]] == pytest.approx([6.0, 7.5], abs=1e-13)


def test_after_the_end_of_a_recording_its_last_value_is_held(tmp_path: Path) -> None:
    found = run(tmp_path, "linear", "2 s")
    assert found.signals["u"][-1] == pytest.approx(3.0)
    assert found.signals["cart.x"][-1] == pytest.approx(10.0, abs=1e-13)


def test_what_is_wrong_with_a_recording_is_told_with_its_place(tmp_path: Path) -> None:
    broken = DRIVE.replace("10.8,6", "fast,6")
    (line,) = problem_lines(lambda: run(tmp_path, "linear", drive=broken))
    assert line == "3:6 `fast` in column `speed` is not a finite number"
    (tmp_path / "spec" / "drive.csv").unlink()
    (line,) = problem_lines(lambda: mw.simulate("cart", "run", root=tmp_path))
    assert "the recording cannot be read" in line


def test_a_recording_is_found_in_the_folder_of_recordings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = run(tmp_path, "linear")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (tmp_path / "spec" / "drive.csv").rename(elsewhere / "drive.csv")
    monkeypatch.setenv("MODEWRIGHT_RECORDINGS", str(elsewhere))
    assert mw.simulate("cart", "run", root=tmp_path).csv() == found.csv()


WINDOW = 18.5
"""Start of the window that the map of the recording selects [s]."""


@pytest.mark.recordings
def test_the_motor_of_a_leaf_follows_its_recorded_wheels(
    recordings: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between wheel and motor are the ratio, a tyre that wears, and stamps of two CAN frames."""
    monkeypatch.setenv("MODEWRIGHT_RECORDINGS", str(recordings))
    found = mw.simulate("leaf_motor_side", "leaf_drive_eco")
    assert found.stopped is None and found.times[-1] > 11.9
    speed = found.signals["leaf_motor_side.w_em"]
    with (recordings / "nissan_leaf" / "drive_eco.csv").open() as file:
        table = list(csv.DictReader(file))
    rows = [(float(row["t_s"]), float(row["em_speed_rpm"])) for row in table]
    wheel = [float(row["t_wheel_s"]) for row in table if row["wheel_a_kmh"]]
    start = max(next(t for t, _ in rows if t >= WINDOW), next(t for t in wheel if t >= WINDOW))
    measured = np.interp(found.times + start, *np.array(rows).T) * 2 * np.pi / 60
    moving = measured > 100.0
    assert moving.sum() > 10_000
    off = np.abs(speed[moving] / measured[moving] - 1.0)
    assert np.median(off) < 0.01 and off.max() < 0.05, (np.median(off), off.max())


def test_columns_of_a_recording_fit_the_inputs(tmp_path: Path) -> None:
    text = RUN.format(hold="linear", horizon="recording")
    wrong = text.replace("unit: km/h", "unit: km").replace("column(way)", "column(wey)")
    project_of(tmp_path, cart=CART, run=wrong)
    found = [f"{p.label} {p.help}" for p in mw.check("run", tmp_path)]
    assert found == [
        "`wey` is not a column of the scenario's recording did you mean `way`?",
        "column `speed` is in `m`, input `u` is in `m/s` ",
    ]


NAMED_MAP = """language: 1
map: columns_of_the_drive
time: {column: t, unit: ms}
columns: {speed: {to: u, unit: km/h}, way: {compare: x, unit: m}}
"""


@pytest.mark.parametrize(
    "beside", ["windows: [[1 s, 2 s]]", "dbc: bus.dbc", "constants: {hill: 0}", "time: {column: t}"]
)
def test_beside_the_name_of_a_map_only_the_file_is_given(tmp_path: Path, beside: str) -> None:
    named = f"recording: {{file: drive.csv, map: columns_of_the_drive, {beside}}}\n"
    text = RUN.format(hold="linear", horizon="recording")
    head, _, rest = text.partition("recording:\n")
    project_of(
        tmp_path,
        cart=CART,
        drive=NAMED_MAP,
        run=head + named + "initial" + rest.partition("initial")[2],
    )
    (tmp_path / "spec" / "drive.csv").write_text(DRIVE)
    (problem,) = mw.check("run", tmp_path)
    assert (
        problem.label == f"`{beside.partition(':')[0]}` is given by the map `columns_of_the_drive`"
    )
    assert problem.help == "write it in the map, or write the whole map here without `map`"


def test_the_map_of_a_recording_is_given_by_its_name(tmp_path: Path) -> None:
    text = RUN.format(hold="linear", horizon="recording")
    project_of(tmp_path, cart=CART, run=text.replace("  file:", "  map: {time: t}\n  file:"))
    assert "`map` is a single value" in [problem.label for problem in mw.check("run", tmp_path)]


STEEP = {
    "ramp": "{start: 0, ramp: {from: 5 ms, to: 0.005000001 s, value: 1.0e+300}}",
    "falling ramp": "{start: 1.7e+308, ramp: {from: 5 ms, to: 10 ms, value: 0}}",
    "table": "{table: {0 s: 0, 5 ms: 1, 0.005000001 s: -1.0e+300}}",
    "chirp": "{start: 0, chirp: {from: 0 s, to: 1.0e-9 s, amplitude: 1, "
    "frequency: [0 Hz, 1.0e+300 Hz]}}",
}
"""Inputs with a slope that no float64 holds."""
SHORT_RUN = "language: 1\nscenario: run\nof: cart\nhorizon: 20 ms\n"


@pytest.mark.parametrize("form", STEEP)
def test_an_input_steeper_than_a_number_is_refused(form: str, tmp_path: Path) -> None:
    project_of(tmp_path, cart=CART, run=f"{SHORT_RUN}inputs: {{u: {STEEP[form]}}}\n")
    (line,) = problem_lines(lambda: mw.simulate("cart", "run", root=tmp_path))
    assert "than 1.8e+308" in line


@pytest.mark.parametrize("back_end", ["interpreted", "compiled"])
def test_a_recording_that_is_too_steep_stops_the_run(back_end: str, tmp_path: Path) -> None:
    drive = "t,speed,way\n1000,3.6,5\n1005,3.6,5\n1005.000000001,3.6e300,6\n1100,0,7\n"
    project_of(tmp_path, cart=CART, run=RUN.format(hold="linear", horizon="20 ms"))
    (tmp_path / "spec" / "drive.csv").write_text(drive)
    found = mw.simulate("cart", "run", root=tmp_path, compiled=back_end == "compiled")
    assert found.stopped is not None
    change = "input `u` changes from 1 to 1e+300 in 1e-12 s: float64 has no such slope"
    assert change in found.stopped


def test_a_slope_that_is_no_float32_stops_the_run(tmp_path: Path) -> None:
    cart = CART.replace("step: 7 ms", "step: 7 ms\nnumbers: float32")
    steep = "{start: 0, ramp: {from: 5 ms, to: 0.005000001 s, value: 1.0e+30}}"
    project_of(tmp_path, cart=cart, run=f"{SHORT_RUN}inputs: {{u: {steep}}}\n")
    found = mw.simulate("cart", "run", root=tmp_path)
    assert found.stopped and "float32 has no such slope" in found.stopped


@pytest.mark.parametrize("value", ["1.0e+290", "1.7e+305"])
def test_a_ramp_as_steep_as_a_number_may_be_has_the_same_values_in_c(
    value: str, tmp_path: Path
) -> None:
    steep = f"{{start: 0, ramp: {{from: 5 ms, to: 6 ms, value: {value}}}}}"
    project_of(tmp_path, cart=CART, run=f"{SHORT_RUN}inputs: {{u: {steep}}}\n")
    interpreted, compiled = (
        mw.simulate("cart", "run", root=tmp_path, compiled=compiled) for compiled in (False, True)
    )
    assert interpreted.stopped is None
    assert compiled.signals["cart.x"].tobytes() == interpreted.signals["cart.x"].tobytes()
    assert interpreted.signals["cart.x"][-1] == pytest.approx(0.0145 * float(value), rel=1e-12)
