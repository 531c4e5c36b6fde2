"""A run that is written as MF4 is a recording: values, units, times and names of modes."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import asammdf
import numpy as np
import pytest

from engine.recordings.recording import read_recording
from engine.results.mdf_run import encode_mdf
from engine.results.trajectory import Trajectory
from language.loading.recording_map_reader import read_map
from language.overlays.expand_document import Project
from language.text.diagnostic import Source
from language.text.project_files import parse_document
from language.typecheck.types import EnumType

MAP = """\
language: 1
map: run
columns:
  plant.w: {to: w, unit: rad/s}
  plant.T: {to: T, unit: N*m, blank: skip}
  plant.mode: {to: mode, unit: 1}
"""


def run() -> Trajectory:
    times = np.array([0.0, 0.1, 0.1 + 0.2, 0.7])
    return Trajectory(
        name="plant",
        times=times,
        signals={
            "plant.w": np.array([1 / 3, -0.1, 5e-324, 1e300]),
            "plant.T": np.array([1.0, np.nan, 3.0, 4.0]),
            "plant.mode": np.array([0, 2, -1, 0], dtype=np.int64),
        },
        units={"plant.w": "rad/s", "plant.T": "N*m", "plant.mode": "1"},
        modes={"plant.mode": {-1: "coast", 0: "gap", 2: "drive"}},
        events=(),
        stopped="`T` is infinite",
    )


def test_a_run_is_read_back_by_the_reader_of_recordings(tmp_path: Path) -> None:
    (tmp_path / "run.mf4").write_bytes(encode_mdf(run()))
    document = parse_document(Source("map.yaml", tuple(MAP.splitlines())), MAP)
    mapping = read_map(document, Project(tmp_path))
    names = ("drive", "gap", "coast")
    mode = replace(mapping.columns["plant.mode"], signal_type=EnumType(names))
    mapping = replace(mapping, columns={**mapping.columns, "plant.mode": mode})
    recording = read_recording(tmp_path / "run.mf4", mapping, list(mapping.columns))
    expected = run()
    channels = recording.channels
    assert channels["plant.w"].seconds.tobytes() == expected.times.tobytes()
    assert channels["plant.w"].array.tobytes() == expected.signals["plant.w"].tobytes()
    assert channels["plant.T"].values == (1.0, 3.0, 4.0)
    assert [names[int(k)] for k in channels["plant.mode"].values] == [
        "gap",
        "drive",
        "coast",
        "gap",
    ]


def test_other_tools_find_units_names_and_the_reason_of_the_stop() -> None:
    with asammdf.MDF(io.BytesIO(encode_mdf(run()))) as file:
        mode = file.get("plant.mode")
        assert [bytes(text) for text in mode.samples] == [b"gap", b"drive", b"coast", b"gap"]
        assert file.get("plant.mode", raw=True).samples.tolist() == [0, 2, -1, 0]
        assert file.get("plant.w").unit == "rad/s"
        assert "stopped: `T` is infinite" in str(file.header.comment)


def test_of_rows_at_one_time_the_last_one_is_written() -> None:
    doubled = replace(run(), times=np.array([0.0, 0.1, 0.1, 0.2]))
    with asammdf.MDF(io.BytesIO(encode_mdf(doubled))) as file:
        assert file.get("plant.T").timestamps.tolist() == [0.0, 0.1, 0.2]
        assert file.get("plant.T").samples.tolist() == [1.0, 3.0, 4.0]


@pytest.mark.parametrize("count", [0, 1])
def test_a_run_of_few_samples_is_written(count: int) -> None:
    whole = run()
    short = replace(
        whole,
        times=whole.times[:count],
        signals={name: values[:count] for name, values in whole.signals.items()},
    )
    with asammdf.MDF(io.BytesIO(encode_mdf(short))) as file:
        assert len(file.get("plant.w").samples) == count
