"""Values and time stamps of a recording: what is refused, and files that are not what they seem."""

from __future__ import annotations

import gzip
import math
from dataclasses import replace
from datetime import datetime
from decimal import Decimal
from pathlib import Path

import asammdf
import numpy as np
import pyarrow
import pyarrow.parquet
import pytest
from hypothesis import given, strategies as st

from engine.recordings.recording import read_recording
from language.loading.recording_map_columns import add_signal_types
from language.text.diagnostic import SpecError
from tests.engine.recording_files import (
    GOOD,
    HEAD,
    RenderProblems,
    only_channel,
    render_problems,
    write_map,
)


class TestAValue:
    @pytest.mark.parametrize("cell", ["1e999", "12x"])
    def test_that_is_not_a_finite_number(self, told: RenderProblems, cell: str) -> None:
        assert told(HEAD + f"0.01,92.5,2639\n0.02,{cell},2640\n") == (
            f"drive.csv:3:6: error: `{cell}` in column `torque_Nm` is not a finite number\n"
            f"  0.02,{cell},2640\n"
            f"       {'^' * len(cell)}"
        )

    @pytest.mark.parametrize(
        ("cell", "help"),
        [
            ("inf", "leave the cell blank, with `blank: skip` in the map"),
            ("-Infinity", "leave the cell blank, with `blank: skip` in the map"),
            ("0x1F", "hexadecimal numbers are not read"),
            ("TRUE", "the signal is a number; words are for signals of `type: bool`"),
            ('"1,002.5"', "a number has no signs of thousands"),
        ],
    )
    def test_that_is_no_number_is_told_with_what_helps(
        self, told: RenderProblems, cell: str, help: str
    ) -> None:
        assert told(HEAD + f"0.01,92.5,2639\n0.02,{cell},2640\n").endswith(f"help: {help}")

    def test_that_is_text_is_refused_even_where_blanks_are_skipped(
        self, told: RenderProblems
    ) -> None:
        assert told(HEAD + "0.01,92.5,fast\n") == (
            "drive.csv:2:11: error: `fast` in column `speed_rpm` is not a finite number\n"
            "  0.01,92.5,fast\n"
            "            ^^^^"
        )

    def test_that_is_blank_is_refused_by_default(self, told: RenderProblems) -> None:
        assert told(HEAD + "0.01,92.5,2639\n0.02,,2640\n") == (
            "drive.csv:3:6: error: column `torque_Nm` has no value here\n"
            "  0.02,,2640\n"
            "       ^\n"
            "help: `blank: skip` in the map leaves empty cells out"
        )

    def test_that_a_short_row_lacks_is_refused(self, told: RenderProblems) -> None:
        text = told(HEAD + "0.01,92.5,2639\n0.02\n")
        assert text.splitlines()[0] == (
            "drive.csv:3:1: error: this row has 1 cells, the head line has 3"
        )

    def test_that_is_never_there_is_refused_even_where_blanks_are_skipped(
        self, told: RenderProblems
    ) -> None:
        text = told(HEAD + "0.01,92.5,\n0.02,91,\n")
        assert text.splitlines()[0] == "drive.csv:1:1: error: column `speed_rpm` has no values"

    def test_of_a_column_read_twice_is_told_once(self, told: RenderProblems) -> None:
        columns = "  a: {to: T_em, unit: N*m}\n  b: {column: a, to: T_req, unit: N*m}\n"
        assert told("t_s,a\n1,x\n", columns).count("error") == 1

    def test_after_many_bad_ones_is_not_looked_at(self, told: RenderProblems) -> None:
        text = told(HEAD + "".join(f"{row},x,1\n" for row in range(1, 1000)))
        assert text.count("error") == 20

    def test_that_is_bad_is_told_together_with_all_others_in_order(
        self, told: RenderProblems
    ) -> None:
        text = told(HEAD + "1,x,1\n2,5,y\n2,6,7\n4,z,8\n")
        places = [line.split(": ")[0] for line in text.splitlines() if "error" in line]
        assert places == ["drive.csv:2:3", "drive.csv:3:5", "drive.csv:4:1", "drive.csv:5:3"]


class TestATimeStamp:
    def test_below_the_one_before(self, told: RenderProblems) -> None:
        assert told(HEAD + "0.02,1,1\n0.01,1,1\n") == (
            "drive.csv:3:1: error: the time stamp 0.01 is not above the one before, 0.02\n"
            "  0.01,1,1\n"
            "  ^^^^\n"
            "help: sort the recording; if its clock begins anew here, split it"
        )

    def test_that_is_repeated(self, told: RenderProblems) -> None:
        assert told(HEAD + "0.01,1,1\n0.010,1,1\n") == (
            "drive.csv:3:1: error: the time stamp 0.010 is not above the one before, 0.01\n"
            "  0.010,1,1\n"
            "  ^^^^^\n"
            "help: sort the recording, and remove repeated rows"
        )

    @pytest.mark.parametrize(
        ("stamps", "help"),
        [
            ("65534 65535 0", "sort the recording; if its clock begins anew here, split it"),
            ("1.70E+09 1.70E+09", "the stamps have only 3 digits: a spreadsheet writes what it s"),
            (
                "4.5E+04 4.5E+04",
                "the stamps have only 2 digits: a spreadsheet writes what it shows",
            ),
            ("1.7000000000E+09 1.7000000000E+09", "sort the recording, and remove repeated rows"),
            ("0.01 t_s", "the names of the columns stand here again: split recordings that follow"),
            ("0.01 T_S", "the names of the columns stand here again: split recordings that follow"),
        ],
    )
    def test_that_steps_back_is_told_with_its_likely_cause(
        self, told: RenderProblems, stamps: str, help: str
    ) -> None:
        assert f"help: {help}" in told(HEAD + "".join(f"{t},1,1\n" for t in stamps.split()))

    def test_that_is_missing(self, told: RenderProblems) -> None:
        assert told(HEAD + "0.01,1,1\n,1,1\n0.03,1,1\n") == (
            "drive.csv:3:1: error: no time stamp\n  ,1,1\n  ^"
        )

    @pytest.mark.parametrize(
        ("cell", "reason"),
        [
            *((cell, "is not a number") for cell in ("NaN", "12:30:01", "x", "1_0", "0x1F")),
            *((cell, "is not finite") for cell in ("inf", "-Infinity")),
            *(
                (cell, "is too large: its magnitude must be below 1e+12 s")
                for cell in ("1e13", "-1e12", "1e999", "10000000000000")
            ),
        ],
    )
    def test_that_is_no_time_says_why(self, told: RenderProblems, cell: str, reason: str) -> None:
        assert told(HEAD + f"0.01,1,1\n{cell},1,1\n") == (
            f"drive.csv:3:1: error: the time stamp `{cell}` {reason}\n"
            f"  {cell},1,1\n"
            f"  {'^' * len(cell)}"
        )

    def test_that_is_long_is_shortened(self, told: RenderProblems) -> None:
        text = told(HEAD + f"0.01,1,1\n0.{'1' * 60},1,1\n").splitlines()[0]
        assert text.endswith(f"the time stamp `0.{'1' * 38}...` has more than 40 characters")

    def test_of_a_channel_of_its_own_is_checked_too(self, told: RenderProblems) -> None:
        columns = "  w: {to: w, unit: rad/s, time: t_w, blank: skip}\n"
        text = told("t_s,w,t_w\n0.1,5,0.095\n0.2,,\n0.3,6,0.095\n", columns)
        assert text.splitlines()[0] == (
            "drive.csv:4:7: error: the time stamp 0.095 is not above the one before, 0.095"
        )


@given(
    st.one_of(
        st.binary(max_size=80), st.text("t_s,a\n\r 0123456789.+-\"'xn\0é\u2028").map(str.encode)
    )
)
def test_any_bytes_are_a_recording_or_a_problem(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    folder = tmp_path_factory.getbasetemp()
    path = folder / "any.csv"
    path.write_bytes(b"t_s,a\n0,1\n" + data)
    mapping = write_map(folder, "  a: {to: a, unit: A, blank: skip}\n")
    try:
        channel = read_recording(path, mapping, ["a"]).channels["a"]
    except SpecError as error:
        assert render_problems(error.problems)
    else:
        assert len(channel.times) == len(channel.values) > 0
        assert list(channel.times) == sorted(set(channel.times))
        assert all(math.isfinite(value) for value in channel.values)


class TestAFileThatIsNotWhatItSeems:
    """Bad files that a plain reader takes without a word."""

    def test_digits_with_an_underscore(self, told: RenderProblems) -> None:
        assert "`1_0` in column `torque_Nm`" in told(HEAD + "0.01,1_0,1\n")

    @pytest.mark.parametrize(
        ("columns", "text"),
        [
            ("  a: {to: a, unit: kN}\n", "t_s,a\n1,1e308\n"),
            ("  c: {mean: [a, b], to: a, unit: A}\n", "t_s,a,b\n1,1.7e308,1.7e308\n"),
            ("  a: {to: a, unit: A, scale: 1000}\n", "t_s,a\n1,1e308\n"),
        ],
        ids=["unit", "mean", "scale"],
    )
    def test_a_value_that_is_infinite_in_SI(
        self, told: RenderProblems, columns: str, text: str
    ) -> None:
        assert "drive.csv:2:" in told(text, columns)

    def test_a_quote_that_is_not_closed(self, told: RenderProblems) -> None:
        assert "drive.csv:2:" in told(HEAD + '0.01,"1,1\n' + "0.02,1.5,1\n" * 20_000)

    def test_a_row_longer_than_the_head_line_as_decimal_commas_make_it(
        self, told: RenderProblems
    ) -> None:
        assert "drive.csv:2:" in told("t_s,torque_Nm,speed_rpm\n0,01,92,5,2639\n1,02,91,0,2640\n")

    def test_a_value_without_its_own_time_stamp(self, told: RenderProblems) -> None:
        columns = "  w: {to: w, unit: rad/s, time: t_w, blank: skip}\n"
        assert "drive.csv:2:" in told("t_s,w,t_w\n0.1,5,\n0.2,6,0.195\n", columns)

    def test_a_packed_file_that_is_huge_unpacked(
        self, told: RenderProblems, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("engine.recordings.csv_reader.MAX_BYTES", 1000)
        packed = gzip.compress(GOOD.encode() + b"\n" * 50_000, mtime=0)
        assert len(packed) < 1000
        assert "larger than 1000 bytes" in told(packed, name="drive.csv.gz")

    def test_a_map_with_sign_0(self, told: RenderProblems) -> None:
        assert "sign" in told("t_s,a\n1,5\n", "  a: {to: a, unit: A, sign: 0}\n")


@pytest.mark.parametrize(
    "missing", [None, float("nan"), "NaN", "", " - ", "#N/A"], ids=["null", "nan", *"abcd"]
)
def test_a_missing_value_of_parquet_is_left_out(tmp_path: Path, missing: object) -> None:
    values = ["ON", missing, "OFF"] if isinstance(missing, str) else [1.0, missing, 0.0]
    path = tmp_path / "run.parquet"
    pyarrow.parquet.write_table(pyarrow.table({"t": [0.0, 0.1, 0.2], "u": values}), path)
    mapping = write_map(tmp_path, "  u: {to: u, unit: 1, blank: skip}\n")
    mapping = add_signal_types(replace(mapping, time="t"), {"u": "truth"}, {})
    channel = only_channel(read_recording(path, mapping, ["u"]))
    assert (channel.seconds.tolist(), channel.values) == ([0.0, 0.2], (1.0, 0.0))


def test_dates_and_decimals_of_parquet_are_read(tmp_path: Path) -> None:
    stamps = [datetime(2026, 1, 31, 10, 30, k, 500_000) for k in range(2)]
    path = tmp_path / "run.parquet"
    table = pyarrow.table({"t": stamps, "u": [Decimal("1.25"), Decimal("2.50")]})
    pyarrow.parquet.write_table(table, path)
    mapping = replace(write_map(tmp_path, "  u: {to: u, unit: 1}\n"), time="t")
    channel = only_channel(read_recording(path, mapping, ["u"]))
    assert channel.values == (1.25, 2.5)
    assert channel.times[1] - channel.times[0] == 1


def test_a_time_stamp_of_mf4_that_is_no_number_is_told(tmp_path: Path) -> None:
    stamps = np.array([0.0, 0.1, np.nan, 0.3])
    file = asammdf.MDF(version="4.10")
    file.append([asammdf.Signal(np.ones(4), stamps, name="u", unit="")])
    file.save(tmp_path / "run.mf4")
    mapping = write_map(tmp_path, "  u: {to: u, unit: 1}\n")
    with pytest.raises(SpecError, match=r"run.mf4:3:1: the time stamp `nan` is not a finite"):
        read_recording(tmp_path / "run.mf4", mapping, ["u"])


@pytest.mark.parametrize("rows", [2**40, 2**62])
def test_a_group_of_mf4_with_more_rows_than_its_file_is_refused(tmp_path: Path, rows: int) -> None:
    file = asammdf.MDF(version="4.10")
    file.append([asammdf.Signal(np.ones(4), 0.1 * np.arange(4), name="u", unit="")])
    file.save(tmp_path / "run.mf4")
    data = (tmp_path / "run.mf4").read_bytes()
    group = data.index(b"##CG")
    at = group + 24 + 8 * int.from_bytes(data[group + 16 : group + 24], "little") + 8
    assert int.from_bytes(data[at : at + 8], "little") == 4
    (tmp_path / "run.mf4").write_bytes(data[:at] + rows.to_bytes(8, "little") + data[at + 8 :])
    mapping = write_map(tmp_path, "  u: {to: u, unit: 1}\n")
    with pytest.raises(SpecError, match=f"its group states {rows} rows of 16 bytes"):
        read_recording(tmp_path / "run.mf4", mapping, ["u"])
