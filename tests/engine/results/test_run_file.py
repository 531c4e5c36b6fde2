"""Run files: what is written is read back bit for bit, damage is refused with its place."""

from __future__ import annotations

import os
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from engine.results.run_file import encode_run, read_run, side_path
from engine.results.sampled_run import Event
from engine.results.trajectory import Trajectory
from language.text.diagnostic import MissingToolError, SpecError

HARD = [0.1 + 0.2, -0.0, 5e-324, 2.2250738585072014e-308, np.inf, -np.inf, np.nan, 1e300, 1 / 3]


def run(count: int = len(HARD)) -> Trajectory:
    return Trajectory(
        name="sweep, 1",
        times=np.cumsum(np.full(count, 0.1)),
        signals={
            "plant.T_hs": np.array(HARD[:count], dtype=np.float64),
            "plant.mode": np.arange(count, dtype=np.int64) % 2,
            "plant.level": np.full(count, -(2**63), dtype=np.int64),
            "plant.whole real": np.full(count, 3.0),
        },
        units={
            "plant.T_hs": "N*m",
            "plant.mode": "1",
            "plant.level": "1",
            "plant.whole real": "rad/s",
        },
        modes={"plant.mode": {0: "gap", 1: "drive"}},
        events=(Event(0.1 + 0.2, 1, "plant", "drive", "gap", "drive"),),
        stopped="`gap`, at 0.3 s",
        faults=("est: range",),
        piecewise_constant=frozenset({"plant.T_hs", "plant.mode"}),
        fault_instants={"est: range": "t = 0.2 s, `est` in mode `gap`"},
    )


def save(trajectory: Trajectory, path: Path) -> Path:
    for name, data in encode_run(trajectory, path).items():
        name.write_bytes(data)
    return path


def assert_same_bits(first: Trajectory, second: Trajectory) -> None:
    for item in fields(Trajectory):
        a, b = getattr(first, item.name), getattr(second, item.name)
        if item.name == "times":
            assert a.tobytes() == b.tobytes()
        elif item.name == "signals":
            assert list(a) == list(b)
            for name in a:
                assert a[name].dtype == b[name].dtype
                assert a[name].tobytes() == b[name].tobytes(), name
        else:
            assert a == b, item.name


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize("count", [len(HARD), 1, 0])
def test_every_field_of_a_run_comes_back_bit_for_bit(
    ending: str, count: int, tmp_path: Path
) -> None:
    trajectory = run(count)
    assert_same_bits(trajectory, read_run(save(trajectory, tmp_path / f"run.{ending}")))


def test_a_csv_without_its_side_file_has_samples_and_units_but_no_events(tmp_path: Path) -> None:
    path = save(run(), tmp_path / "run.csv")
    side_path(path).unlink()
    read = read_run(path)
    assert read.signals["plant.T_hs"].tobytes() == run().signals["plant.T_hs"].tobytes()
    assert read.units == run().units
    assert read.signals["plant.mode"].dtype == np.int64
    assert (read.events, read.modes) == ((), {})


def refusal(path: Path) -> str:
    with pytest.raises(SpecError) as caught:
        read_run(path)
    return str(caught.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "not a run"),
        ("time,a [1]\n0,1\n", "not a run"),
        ("t [s],a [1]\n0.0,1.0\n0.1\n", "run.csv:3:1: this row has 1 cells, the head has 2"),
        ("t [s],a [1]\n0.0,x\n", "run.csv:2:1: `x` in column `a [1]` is not a number"),
        ("t [s],a [1],a [1]\n", "is there twice"),
        ("t [s],a\n", "`a` is not `name [unit]`"),
        ("t [s],a [1]\n0.1,1\n0.0,1\n", "run.csv:3:1: the time 0.0 s is before that of the row"),
        ("t [s],a [1]\n0.0,1\nnan,1\n", "run.csv:3:1: the time `nan` is not finite"),
    ],
)
def test_a_damaged_csv_is_refused_with_its_line(text: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text(text)
    assert told in refusal(path)


def test_a_side_file_of_another_run_is_refused(tmp_path: Path) -> None:
    path = save(run(), tmp_path / "run.csv")
    path.write_text(path.read_text().replace("plant.T_hs", "plant.T_em"))
    assert "belongs to another run" in refusal(path)


@pytest.mark.parametrize("text", ["", "[]", '{"modewright": 99}', "{"])
def test_a_damaged_side_file_is_refused(text: str, tmp_path: Path) -> None:
    path = save(run(), tmp_path / "run.csv")
    side_path(path).write_text(text)
    assert "side file" in refusal(path)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"time": 0.30000000000000004', '"time": "a"', "`events[0]` has a `time` that is not a"),
        ('"time": 0.30000000000000004', '"time": NaN', "`NaN` is not a finite number"),
        ('"time": 0.30000000000000004', '"time": 1e999', "`1e999` is not a finite number"),
        ('"micro_step": 1', '"micro_step": 1.5', "`events[0]` has a `micro_step`"),
        ('"source": "gap"', '"source": 3', "`events[0]` has a `source` that is not a text"),
        ('"source": "gap"', '"sauce": "gap"', "`events[0]` has an unknown key `sauce`"),
        ('"source": "gap",', "", "`events[0]` has no `source`"),
        ('"0": "gap"', '"x": "gap"', "`modes.plant.mode` is not a mapping"),
        ('"0": "gap"', '"0": 7', "`modes.plant.mode` is not a mapping"),
        ('"whole": [', '"whole": [1, ', "`whole` is not a list of texts"),
        ('"whole": [', '"whole": ["plant.T_hs", ', "`plant.T_hs` has samples that are not whole"),
        ('"name": "sweep, 1"', '"name": [1]', "`name` is not a text"),
        ('"stopped": "', '"stopped": false, "x": "', "`stopped` is neither a text nor null"),
        ('"faults": [', '"faults": [null, ', "`faults` is not a list of texts"),
    ],
)
def test_a_wrong_value_in_a_side_file_is_refused_with_its_key(
    old: str, new: str, told: str, tmp_path: Path
) -> None:
    path = save(run(), tmp_path / "run.csv")
    text = side_path(path).read_text()
    assert old in text
    side_path(path).write_text(text.replace(old, new, 1))
    message = refusal(path)
    assert told in message and message.startswith(str(side_path(path)))


def test_a_side_file_that_is_nested_too_deeply_is_refused(tmp_path: Path) -> None:
    path = save(run(), tmp_path / "run.csv")
    side_path(path).write_text("[" * 100_000)
    assert "nested too deeply" in refusal(path)


def test_what_is_no_parquet_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.parquet"
    path.write_bytes(b"PAR1 no")
    assert "not Parquet" in refusal(path)


def test_without_pyarrow_the_user_is_told_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingToolError, match=r"pip install 'modewright\[parquet\]'"):
        encode_run(run(), tmp_path / "run.parquet")
    assert encode_run(run(), tmp_path / "run.csv")


def test_a_frame_has_time_as_index_and_modes_by_name() -> None:
    frame = run(3).frame()
    assert list(frame["plant.mode"]) == ["gap", "drive", "gap"]
    assert list(frame.index) == run(3).times.tolist()
    assert frame.attrs["units"]["plant.T_hs"] == "N*m"


def test_a_frame_without_pandas_tells_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(MissingToolError, match="pandas"):
        run().frame()


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_run_that_is_a_pipe_a_device_or_a_folder_is_refused(ending: str, tmp_path: Path) -> None:
    pipe, device, folder = (tmp_path / f"{name}.{ending}" for name in ("pipe", "device", "folder"))
    os.mkfifo(pipe)
    device.symlink_to("/dev/zero")
    folder.mkdir()
    for path in (pipe, device, folder):
        with pytest.raises(SpecError, match="the run cannot be read: it is a folder, a pipe"):
            read_run(path)


def test_a_side_file_that_is_a_pipe_is_refused(tmp_path: Path) -> None:
    path = save(run(), tmp_path / "run.csv")
    side_path(path).unlink()
    os.mkfifo(side_path(path))
    with pytest.raises(SpecError, match="this side file cannot be read: it is a folder, a pipe"):
        read_run(path)


@pytest.mark.parametrize("opening", ["[", '{"a":', '[{"b":['])
def test_a_side_file_that_is_nested_deeply_is_refused(opening: str, tmp_path: Path) -> None:
    path = save(run(), tmp_path / "run.csv")
    side_path(path).write_text(opening * 100_000)
    with pytest.raises(SpecError, match="this side file is nested too deeply"):
        read_run(path)
