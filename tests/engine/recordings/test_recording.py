"""Recording: what a file gives, and what each bad file is told."""

from __future__ import annotations

import gzip
import math
from fractions import Fraction
from pathlib import Path

import pytest

from tests.engine.recording_files import (
    GOOD,
    HEAD,
    Read,
    RenderProblems,
    only_channel,
    problems_of_file,
)


class TestAGoodFile:
    def test_it_gives_every_value_with_its_exact_time(self, read: Read) -> None:
        torque = read(GOOD).channels["torque_Nm"]
        assert torque.times == (Fraction(1, 100), Fraction(2, 100), Fraction(3, 100))
        assert torque.values == (92.5, 91.0, -1.5)

    def test_its_end_is_the_last_time_stamp(self, read: Read) -> None:
        assert read(GOOD).end == Fraction(3, 100)

    def test_it_is_known_by_its_file_name(self, read: Read) -> None:
        assert read(GOOD).name == "drive.csv"

    def test_blank_cells_are_left_out_where_the_map_skips_them(self, read: Read) -> None:
        assert read(GOOD).channels["speed_rpm"].times == (Fraction(1, 100), Fraction(3, 100))

    def test_columns_that_are_not_used_are_not_looked_at(self, read: Read) -> None:
        recording = read("note,t_s,a,note\nx,1,5,\ny,2,6,z\n", "  a: {to: T_em, unit: N*m}\n")
        assert only_channel(recording).values == (5.0, 6.0)

    def test_rpm_become_rad_per_second(self, read: Read) -> None:
        speed = read(GOOD).channels["speed_rpm"].values
        assert speed == pytest.approx((2639 * math.pi / 30, 2640 * math.pi / 30), rel=1e-15)

    def test_km_per_h_become_m_per_second(self, read: Read) -> None:
        channel = only_channel(read("t_s,v\n1,36\n", "  v: {to: v, unit: km/h}\n"))
        assert channel.values == pytest.approx((10.0,), rel=1e-15)

    def test_degrees_celsius_become_kelvin(self, read: Read) -> None:
        channel = only_channel(read("t_s,T\n1,-40\n", "  T: {to: T, unit: degC}\n"))
        assert channel.values == pytest.approx((233.15,), rel=1e-15)

    def test_time_stamps_in_ms_become_exact_seconds(self, read: Read) -> None:
        recording = read("t_s,a\n0.1,1\n2.5e1,2\n", "  a: {to: a, unit: A}\n", unit="ms")
        assert only_channel(recording).times == (Fraction(1, 10_000), Fraction(25, 1000))
        assert recording.end == Fraction(25, 1000)

    def test_sign_minus_one_turns_a_value_round(self, read: Read) -> None:
        assert only_channel(read("t_s,a\n1,5\n", "  a: {to: a, unit: A, sign: -1}\n")).values == (
            -5.0,
        )

    def test_scale_is_a_factor_that_may_have_a_unit(self, read: Read) -> None:
        columns = "  v: {to: w, unit: km/h, scale: 1 rad / 0.25 m}\n"
        assert only_channel(read("t_s,v\n1,36\n", columns)).values == pytest.approx(
            (40.0,), rel=1e-15
        )

    def test_delay_is_added_to_the_time_stamps_exactly(self, read: Read) -> None:
        channel = only_channel(
            read("t_s,a\n0.1,5\n0.2,6\n", "  a: {to: a, unit: A, delay: 7 ms}\n")
        )
        assert channel.times == (Fraction(107, 1000), Fraction(207, 1000))

    def test_mean_of_two_columns_has_a_value_where_both_have(self, read: Read) -> None:
        columns = "  w: {mean: [a, b], to: w, unit: rad/s, blank: skip}\n"
        channel = only_channel(read("t_s,a,b\n1,10,11\n2,,9\n3,8,\n4,7,8\n", columns))
        assert channel.values == (10.5, 7.5)
        assert channel.times == (Fraction(1), Fraction(4))

    def test_a_column_may_have_its_own_time_stamps(self, read: Read) -> None:
        columns = "  w: {to: w, unit: rad/s, time: t_w, blank: skip}\n"
        channel = only_channel(read("t_s,w,t_w\n0.1,,\n0.2,5,0.195\n0.3,,\n0.4,6,0.393\n", columns))
        assert channel.times == (Fraction(195, 1000), Fraction(393, 1000))
        assert channel.values == (5.0, 6.0)

    def test_columns_are_found_by_name_in_any_order(self, read: Read) -> None:
        shuffled = "speed_rpm,t_s,torque_Nm\n2639,0.01,92.5\n,0.02,91.0\n2640,0.03,-1.5\n"
        assert read(shuffled).channels == read(GOOD).channels

    @pytest.mark.parametrize(
        ("name", "data"),
        [
            ("drive.csv.gz", gzip.compress(GOOD.encode(), mtime=0)),
            ("bom.csv", b"\xef\xbb\xbf" + GOOD.encode()),
            ("crlf.csv", GOOD.replace("\n", "\r\n").encode()),
            ("bom.csv.gz", gzip.compress(b"\xef\xbb\xbf" + GOOD.encode(), mtime=0)),
            ("no_last_line_end.csv", GOOD.rstrip("\n").encode()),
            ("spaces.csv", GOOD.replace(",", " , ").encode()),
            ("empty_lines.csv", GOOD.replace("\n", "\n\n").encode()),
            ("quoted.csv", GOOD.replace("92.5", '"92.5"').replace("t_s", '"t_s"').encode()),
        ],
    )
    def test_the_same_file_in_another_form_gives_the_same_channels(
        self, read: Read, name: str, data: bytes
    ) -> None:
        assert read(data, name=name).channels == read(GOOD).channels


class TestAFileThatCannotBeRead:
    def test_missing(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(tmp_path)
        assert problems_of_file(tmp_path / "drive.csv", tmp_path) == (
            "drive.csv:1:1: error: the recording cannot be read: No such file or directory"
        )

    def test_directory(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.chdir(tmp_path)
        (tmp_path / "drives").mkdir()
        assert problems_of_file(tmp_path / "drives", tmp_path) == (
            "drives:1:1: error: the recording cannot be read: it is a folder, a pipe or a device\n"
            "help: write its content into a file first"
        )

    @pytest.mark.parametrize("data", [b"", b"\n", b"  \r\n\n", b"\xef\xbb\xbf"])
    def test_empty(self, told: RenderProblems, data: bytes) -> None:
        assert told(data) == "drive.csv:1:1: error: the recording is empty"

    def test_empty_and_packed(self, told: RenderProblems) -> None:
        text = told(gzip.compress(b"", mtime=0), name="drive.csv.gz")
        assert text == "drive.csv.gz:1:1: error: the recording is empty"

    @pytest.mark.parametrize(
        "data", [b"\x89PNG\r\n\x1a\n\0\0", b"t_s,a\n1,\0\n", GOOD.encode("utf-16-le"), b"\x81C,1\n"]
    )
    def test_binary(self, told: RenderProblems, data: bytes) -> None:
        assert told(data) == (
            "drive.csv:1:1: error: this is not a text file\nhelp: a recording is CSV, or CSV.gz"
        )

    def test_named_gz_and_not_packed(self, told: RenderProblems) -> None:
        assert told(GOOD, name="drive.csv.gz").startswith(
            "drive.csv.gz:1:1: error: the recording cannot be read: Not a gzipped file"
        )

    def test_packed_and_cut_off(self, told: RenderProblems) -> None:
        packed = gzip.compress(GOOD.encode(), mtime=0)
        for length in range(1, len(packed)):
            text = told(packed[:length], name="drive.csv.gz")
            assert text.startswith("drive.csv.gz:1:1: error: the recording cannot be "), length
            assert "\n" not in text

    def test_packed_and_damaged(self, told: RenderProblems) -> None:
        packed = bytearray(gzip.compress(GOOD.encode(), mtime=0))
        packed[len(packed) // 2] ^= 0xFF
        text = told(bytes(packed), name="drive.csv.gz")
        assert text.startswith("drive.csv.gz:1:1: error: the recording cannot be ")


class TestAHeadLine:
    def test_alone(self, told: RenderProblems) -> None:
        assert told(HEAD) == (
            "drive.csv:1:1: error: the recording has a head line and no values\n"
            "  t_s,torque_Nm,speed_rpm\n"
            "  ^^^^^^^^^^^^^^^^^^^^^^^"
        )

    def test_with_a_column_missing_proposes_the_nearest(self, told: RenderProblems) -> None:
        assert told(GOOD.replace("torque_Nm", "torqe_Nm")) == (
            "drive.csv:1:1: error: there is no column `torque_Nm`, which map `bench` reads\n"
            "  t_s,torqe_Nm,speed_rpm\n"
            "  ^^^^^^^^^^^^^^^^^^^^^^\n"
            "help: did you mean `torqe_Nm`?"
        )

    def test_with_several_columns_missing_tells_all_of_them(self, told: RenderProblems) -> None:
        text = told("when,what\n1,2\n")
        for name in ("t_s", "torque_Nm", "speed_rpm"):
            assert f"error: there is no column `{name}`, which map `bench` reads" in text

    def test_with_the_time_column_of_a_channel_missing(self, told: RenderProblems) -> None:
        text = told("t_s,w\n1,2\n", "  w: {to: w, unit: rad/s, time: t_w}\n")
        assert text.splitlines()[0] == (
            "drive.csv:1:1: error: there is no column `t_w`, which map `bench` reads"
        )

    def test_with_a_column_twice(self, told: RenderProblems) -> None:
        assert told("t_s,torque_Nm,speed_rpm,torque_Nm\n1,2,3,4\n") == (
            "drive.csv:1:1: error: there are two columns `torque_Nm`\n"
            "  t_s,torque_Nm,speed_rpm,torque_Nm\n"
            "  ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^\n"
            "help: rename one of them in the file"
        )
