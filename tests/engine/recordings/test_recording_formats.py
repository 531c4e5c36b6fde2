"""Formats: the same drive as Parquet, MF4 and logs of CAN frames, and what is told of bad ones."""

from __future__ import annotations

import builtins
import math
import struct
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from engine.recordings.recording import Recording, read_recording
from language.loading.recording_map_reader import read_map
from language.overlays.expand_document import Project, read_document
from language.text.diagnostic import MissingToolError, SpecError
from tests.engine.recording_files import render_problems

DBC = """\
VERSION ""
NS_ :
BS_:
BU_: ECU
BO_ 256 Motor: 4 ECU
 SG_ T_em : 0|16@1- (0.25,0) [0|0] "Nm" ECU
 SG_ n_em : 16|16@1- (1,0) [0|0] "rpm" ECU
BO_ 512 Wheels: 2 ECU
 SG_ v_wheel : 0|16@1+ (0.005,0) [0|0] "km/h" ECU
BO_ 768 Battery: 2 ECU
 SG_ U_batt : 0|16@1+ (0.1,0) [0|0] "V" ECU
"""
HEAD = "language: 1\nmap: bench\n"
COLUMNS = """\
columns:
  T_em:    {to: T_em, unit: N*m}
  n_em:    {compare: w_em, unit: rpm}
  v_wheel: {to: v, unit: km/h}
"""
CAN_ENDINGS = ["asc", "blf", "log"]
TORQUE, SPEED, WHEEL = [12.5, -3.25, 0.0], [1000, 1001, 999], [36.0, 36.005]


def read(path: Path, text: str, *names: str) -> Recording:
    (path.parent / "map.yaml").write_text(HEAD + text, "utf-8")
    mapping = read_map(read_document(path.parent / "map.yaml"), Project(path.parent))
    return read_recording(path, mapping, names or list(mapping.columns))


def told(path: Path, text: str, *names: str) -> str:
    with pytest.raises(SpecError) as caught:
        read(path, text, *names)
    return render_problems(caught.value.problems)


def write_parquet(path: Path, **columns: list[Any]) -> None:
    import pyarrow
    import pyarrow.parquet

    pyarrow.parquet.write_table(pyarrow.table(columns), path)


def write_mf4(path: Path, motor_unit: str = "rpm", wheel: list[float] | None = None) -> None:
    from asammdf import MDF, Signal

    fast, slow = np.array([0.01, 0.02, 0.03]), np.array([0.015, 0.035])
    with MDF(version="4.10") as mdf:
        mdf.append(
            [
                Signal(np.array(TORQUE), fast, name="T_em", unit="Nm"),
                Signal(np.array(SPEED), fast, name="n_em", unit=motor_unit),
            ]
        )
        mdf.append([Signal(np.array(wheel or WHEEL), slow, name="v_wheel", unit="km/h")])
        mdf.save(path, overwrite=True)


def write_can(path: Path, length: int = 4) -> None:
    import can

    (path.parent / "car.dbc").write_text(DBC, "utf-8")
    frames = [
        (0.01 * (k + 1), 256, struct.pack("<hh", round(4 * T), n)[:length])
        for k, (T, n) in enumerate(zip(TORQUE, SPEED, strict=True))
    ]
    stamps = zip((0.015, 0.035), WHEEL, strict=True)
    frames += [(t, 512, struct.pack("<H", round(v / 0.005))) for t, v in stamps]
    with can.Logger(str(path)) as log:
        for time, number, data in sorted(frames):
            log.on_message_received(
                can.Message(
                    timestamp=time,
                    arbitration_id=number,
                    data=data,
                    is_extended_id=False,
                    channel=1,
                )
            )


def expect_the_drive(recording: Recording) -> None:
    torque, speed, wheel = (recording.channels[name] for name in ("T_em", "n_em", "v_wheel"))
    assert torque.values == tuple(TORQUE)
    assert speed.values == pytest.approx([n * math.pi / 30 for n in SPEED], rel=1e-15)
    assert wheel.values == pytest.approx([v / 3.6 for v in WHEEL], rel=1e-12)
    assert [round(float(t - torque.times[0]), 6) for t in torque.times] == [0.0, 0.01, 0.02]
    assert [round(float(t - torque.times[0]), 6) for t in wheel.times] == [0.005, 0.025]


class TestParquet:
    TIME = "time: {column: t_s, unit: s}\n"

    def test_a_table_is_read_with_exact_times_and_blanks(self, tmp_path: Path) -> None:
        path = tmp_path / "drive.parquet"
        wheel, t_wheel = [None, 36.0, 36.005, None], [None, 0.015, 0.035, None]
        write_parquet(
            path, t_s=[0.01, 0.02, 0.03, 0.04], T_em=[*TORQUE, 1.0], v_wheel=wheel, t_w=t_wheel
        )
        text = COLUMNS.replace("unit: km/h", "unit: km/h, time: t_w, blank: skip")
        found = read(path, self.TIME + text, "T_em", "v_wheel")
        assert found.channels["T_em"].times[:3] == tuple(Fraction(k, 100) for k in (1, 2, 3))
        assert found.channels["v_wheel"].times == (Fraction(15, 1000), Fraction(35, 1000))

    def test_what_is_no_number_is_told_with_its_row(self, tmp_path: Path) -> None:
        path = tmp_path / "drive.parquet"
        write_parquet(path, t_s=[0.01, 0.02, 0.02], T_em=[1.0, math.nan, 2.0])
        lines = told(path, self.TIME + COLUMNS, "T_em").splitlines()
        assert [line.split("drive.parquet:")[1] for line in lines if "error" in line] == [
            "2:1: error: column `T_em` has no value here: `nan`",
            "3:1: error: the time stamp 0.02 is not above the one before, 0.02",
        ]

    @pytest.mark.parametrize("cell", ["2.5", " 2.5 ", "+2.50", "25e-1"])
    def test_numbers_that_are_texts_are_read_and_told(self, tmp_path: Path, cell: str) -> None:
        path = tmp_path / "drive.parquet"
        write_parquet(path, t_s=["0.01", "0.02"], T_em=["1.0", cell])
        found = read(path, f"time: {{column: t_s, unit: s}}\n{COLUMNS}", "T_em")
        assert found.channels["T_em"].values == (1.0, 2.5)
        assert "column `T_em`: 2 numbers (the table has them as texts)" in [
            f"{item.subject}: {item.value} ({item.reason})" for item in found.assumptions
        ]

    @pytest.mark.parametrize("cell", ["2,5", "0x10", "2.5 Nm"])
    def test_texts_that_are_no_numbers_are_told(self, tmp_path: Path, cell: str) -> None:
        path = tmp_path / "drive.parquet"
        write_parquet(path, t_s=[0.01, 0.02], T_em=["1.0", cell])
        text = told(path, f"time: {{column: t_s, unit: s}}\n{COLUMNS}", "T_em")
        assert f"`{cell}` in column `T_em` is not a finite number" in text

    def test_the_columns_of_the_file_are_named(self, tmp_path: Path) -> None:
        path = tmp_path / "drive.parquet"
        write_parquet(path, __index_level_0__=[0.01, 0.02], T_em=[1.0, 2.0])
        text = told(path, f"time: {{column: t_s, unit: s}}\n{COLUMNS}", "T_em")
        assert "help: the file has `__index_level_0__`, `T_em`" in text

    def test_junk_and_a_cut_off_file_are_told(self, tmp_path: Path) -> None:
        path = tmp_path / "drive.parquet"
        write_parquet(path, t_s=[0.01, 0.02], T_em=[1.0, 2.0])
        whole = path.read_bytes()
        for data in (b"junk" * 10, whole[: len(whole) // 2], whole[:-1]):
            path.write_bytes(data)
            text = told(path, self.TIME + COLUMNS, "T_em")
            assert "error: the recording cannot be understood as Parquet" in text

    def test_a_map_without_a_column_of_time_is_told(self, tmp_path: Path) -> None:
        path = tmp_path / "drive.parquet"
        write_parquet(path, T_em=[1.0, 2.0])
        assert "names no column of time, which this file needs" in told(path, COLUMNS, "T_em")


class TestMf4:
    def test_channels_of_two_groups_keep_their_own_time(self, tmp_path: Path) -> None:
        write_mf4(tmp_path / "drive.mf4")
        expect_the_drive(read(tmp_path / "drive.mf4", COLUMNS))

    def test_a_dat_file_is_mdf_or_csv_as_it_starts(self, tmp_path: Path) -> None:
        write_mf4(tmp_path / "drive.mf4")
        (tmp_path / "drive.mf4").rename(tmp_path / "mdf.dat")
        expect_the_drive(read(tmp_path / "mdf.dat", COLUMNS))
        (tmp_path / "text.dat").write_text("t_s,T_em\n0.01,5\n", "utf-8")
        text = "time: {column: t_s, unit: s}\n" + COLUMNS
        assert read(tmp_path / "text.dat", text, "T_em").channels["T_em"].values == (5.0,)

    def test_an_unknown_channel_gets_the_nearest_name(self, tmp_path: Path) -> None:
        write_mf4(tmp_path / "drive.mf4")
        text = told(tmp_path / "drive.mf4", "columns: {T_am: {to: T_em, unit: N*m}}\n")
        assert "error: there is no channel `T_am`, which map `bench` reads" in text
        assert "help: did you mean `T_em`?" in text

    def test_a_unit_other_than_that_of_the_file_is_told(self, tmp_path: Path) -> None:
        write_mf4(tmp_path / "drive.mf4", motor_unit="rad/s")
        text = told(tmp_path / "drive.mf4", COLUMNS)
        assert "error: the file gives `n_em` in `rad/s`, the map in `rpm`" in text

    def test_a_value_that_is_no_number_is_told(self, tmp_path: Path) -> None:
        write_mf4(tmp_path / "drive.mf4", wheel=[36.0, math.nan])
        text = told(tmp_path / "drive.mf4", COLUMNS)
        assert "drive.mf4:2:1: error: channel `v_wheel` has no value here: `nan`" in text

    def test_junk_and_a_cut_off_file_are_told(self, tmp_path: Path) -> None:
        path = tmp_path / "drive.mf4"
        write_mf4(path)
        whole = path.read_bytes()
        for data in (b"junk" * 30, whole[:40], whole[:170], whole[: len(whole) // 3]):
            path.write_bytes(data)
            assert "error: the recording cannot be understood" in told(path, COLUMNS)


@pytest.mark.parametrize("ending", CAN_ENDINGS)
class TestCan:
    DBC = "dbc: car.dbc\n"

    def test_signals_are_decoded_with_the_time_of_their_frames(
        self, tmp_path: Path, ending: str
    ) -> None:
        write_can(tmp_path / f"drive.{ending}")
        expect_the_drive(read(tmp_path / f"drive.{ending}", self.DBC + COLUMNS))

    def test_a_signal_may_be_named_with_its_message(self, tmp_path: Path, ending: str) -> None:
        write_can(tmp_path / f"drive.{ending}")
        columns = "columns: {torque: {column: Motor.T_em, to: T_em, unit: N*m}}\n"
        found = read(tmp_path / f"drive.{ending}", self.DBC + columns)
        assert found.channels["torque"].values == tuple(TORQUE)

    def test_a_message_that_is_not_in_the_log_is_told(self, tmp_path: Path, ending: str) -> None:
        write_can(tmp_path / f"drive.{ending}")
        columns = "columns: {U_batt: {to: u, unit: V}}\n"
        text = told(tmp_path / f"drive.{ending}", self.DBC + columns)
        assert "error: there is no signal `U_batt`, which map `bench` reads" in text
        assert "help: its message `Battery` (0x300) is not in the log" in text

    def test_a_frame_that_is_too_short_is_told(self, tmp_path: Path, ending: str) -> None:
        write_can(tmp_path / f"drive.{ending}", length=2)
        text = told(tmp_path / f"drive.{ending}", self.DBC + COLUMNS)
        assert "error: message `Motor` has no whole frame: the one at " in text
        assert "has 2 bytes, the DBC says 4" in text

    def test_without_a_dbc_nothing_is_decoded(self, tmp_path: Path, ending: str) -> None:
        write_can(tmp_path / f"drive.{ending}")
        text = told(tmp_path / f"drive.{ending}", COLUMNS)
        assert "names no DBC, which a log of CAN frames needs" in text

    def test_a_dbc_that_is_not_there_and_one_that_is_junk_are_told(
        self, tmp_path: Path, ending: str
    ) -> None:
        path = tmp_path / f"drive.{ending}"
        write_can(path)
        (tmp_path / "junk.dbc").write_text("this is no DBC", "utf-8")
        (tmp_path / "list.csv").write_text("a,b", "utf-8")
        text = told(path, "dbc: [cat.dbc, junk.dbc, list.csv]\n" + COLUMNS)
        assert "error: `list.csv` is not a DBC file by its name" in text
        assert "error: there is no file `cat.dbc`" in text
        assert "error: `junk.dbc` cannot be understood" in text

    def test_junk_is_told(self, tmp_path: Path, ending: str) -> None:
        path = tmp_path / f"drive.{ending}"
        write_can(path)
        path.write_bytes(bytes(range(256)) * 3)
        assert "log of CAN frames" in told(path, self.DBC + COLUMNS)


@pytest.mark.parametrize(
    ("name", "package", "line"),
    [
        ("drive.mf4", "asammdf", "pip install 'modewright[mdf]'"),
        ("drive.blf", "can", "pip install 'modewright[can]'"),
        ("drive.parquet", "pyarrow", "pip install 'modewright[parquet]'"),
    ],
)
def test_a_format_whose_package_is_absent_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, package: str, line: str
) -> None:
    (tmp_path / name).write_bytes(b"x")
    plain = builtins.__import__

    def without(wanted: str, *rest: Any) -> Any:
        if wanted.partition(".")[0] == package:
            raise ImportError(wanted)
        return plain(wanted, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(MissingToolError, match=line.replace("[", r"\[")):
        read(tmp_path / name, COLUMNS)
