"""Text recordings of many tools: one table, written in many dialects, gives the same values."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest

from engine.recordings.recording import Recording, read_recording
from language.loading.recording_map_reader import read_map
from language.overlays.expand_document import Project, read_document
from language.text.diagnostic import SpecError
from tests.engine.recording_files import render_problems

ReadText = Callable[..., Recording]
COLUMNS = "  a: {to: a, unit: N*m, blank: skip}\n  w: {to: w, unit: rad/s, blank: skip}\n"
TABLE = "t,a,w\n0.00,1.5,10\n0.01,-2.25,1200.5\n0.02,3,12\n"


@pytest.fixture
def read_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ReadText:
    """Return a function that reads a text or bytes by a map with the columns `a` and `w`."""
    monkeypatch.chdir(tmp_path)

    def reading(
        data: str | bytes, time: str = "unit: s", more: str = "", columns: str = COLUMNS
    ) -> Recording:
        head = f"language: 1\nmap: bench\ntime: {{column: t, {time}}}\n{more}columns:\n"
        (tmp_path / "map.yaml").write_text(head + columns, "utf-8")
        path = tmp_path / "run.csv"
        path.write_bytes(data.encode() if isinstance(data, str) else data)
        mapping = read_map(read_document(tmp_path / "map.yaml"), Project(tmp_path))
        return read_recording(path, mapping, list(mapping.columns))

    return reading


@pytest.fixture
def told_text(read_text: ReadText) -> Callable[..., str]:
    """Return a function that returns the problems of a text."""

    def telling(data: str | bytes, **more: str) -> str:
        with pytest.raises(SpecError) as caught:
            read_text(data, **more)
        return render_problems(caught.value.problems)

    return telling


COMMA = TABLE.replace(",", ";").replace(".", ",")
DIALECTS = {
    "semicolon": (TABLE.replace(",", ";"), {"separator"}),
    "semicolon, decimal comma": (COMMA, {"separator", "decimal sign"}),
    "tab": (TABLE.replace(",", "\t"), {"separator"}),
    "tab, decimal comma": (COMMA.replace(";", "\t"), {"separator", "decimal sign"}),
    "bar": (TABLE.replace(",", "|"), {"separator"}),
    "stated separator": ("sep=;\n" + TABLE.replace(",", ";"), {"separator"}),
    "stated comma": ("sep=,\n" + TABLE, set()),
    "line of units": (TABLE.replace("w\n", "w\ns,Nm,rad/s\n", 1), {"units"}),
    "units in brackets": (TABLE.replace("w\n", "w\n[s],[Nm],[rad/s]\n", 1), {"units"}),
    "units without time": (TABLE.replace("w\n", "w\n,N*m,rad/s\n", 1), {"units"}),
    "lines above": ("Logger, v2\nStart, 12:00\n\n" + TABLE, {"head line"}),
    "long lines above": ("a;b;c\nx: 1\n\n# a, b\n" + TABLE, {"head line"}),
    "comment": ("# by a logger\n" + TABLE, {"head line"}),
    "comments inside": (TABLE.replace("0.01", "# lost, 3\n0.01"), {"comments"}),
    "head in a comment": ("# a comment\n# " + TABLE, {"head line"}),
    "UTF-16": (TABLE.encode("utf-16"), {"encoding"}),
    "UTF-16, big end first": (b"\xfe\xff" + TABLE.encode("utf-16-be"), {"encoding"}),
    "cp1252": (TABLE.replace("w\n", "w,\N{DEGREE SIGN}\n", 1).encode("cp1252"), None),
    "line ends of old computers": (TABLE.replace("\n", "\r"), set()),
    "zero bytes behind": (TABLE.encode() + b"\0" * 90, {"end of the text"}),
    "separator ends the rows": (TABLE.replace("\n", ",\n").replace("w,", "w", 1), {"rows"}),
    "separator ends all lines": (TABLE.replace("\n", ",\n"), set()),
    "empty rows": (TABLE + ",,\n,,\n", {"rows"}),
    "all quoted": ("\n".join('"' + x.replace(",", '","') + '"' for x in TABLE.split()), set()),
    "quoted decimal commas": (
        "\n".join('"' + x.replace(";", '","') + '"' for x in COMMA.split()),
        {"decimal sign"},
    ),
    "last line cut off": (TABLE + "0.03,4", {"last line"}),
    "minus of typography": (TABLE.replace("-", "\N{MINUS SIGN}"), set()),
    "exponents of Fortran": (TABLE.replace("1200.5", "1.2005D+03"), set()),
}


@pytest.mark.parametrize("name", DIALECTS)
def test_the_same_table_in_another_dialect(read_text: ReadText, name: str) -> None:
    data, assumed = DIALECTS[name]
    if name == "cp1252":
        text = TABLE.replace("\n", ",1\n").replace(",1\n", ",\N{DEGREE SIGN}\n", 1)
        data, assumed = text.encode("cp1252"), {"encoding"}
    recording = read_text(data)
    assert recording.channels["a"].values == (1.5, -2.25, 3.0)
    assert recording.channels["w"].values == (10.0, 1200.5, 12.0)
    assert recording.channels["a"].times == (0, Fraction(1, 100), Fraction(2, 100))
    assert {item.subject for item in recording.assumptions} == assumed


def test_the_map_may_state_the_format(read_text: ReadText) -> None:
    text = "made by x\n" + COMMA.replace("w\n", "w\nSek;Newtonmeter;?\n", 1)
    more = "csv: {separator: semicolon, decimal: comma, encoding: utf-8, head: 2, units: 3}\n"
    columns = '  a: {to: a, unit: N*m, file_unit: Newtonmeter}\n  w: {to: w, file_unit: "?"}\n'
    recording = read_text(text, more=more, columns=columns)
    assert recording.channels["a"].values == (1.5, -2.25, 3.0)
    assert recording.assumptions == ()


class TestTwoReadings:
    def test_a_comma_that_may_be_of_thousands_is_refused(
        self, told_text: Callable[..., str]
    ) -> None:
        text = told_text("t;a;w\n0;1,250;1\n1;2,500;2\n")
        assert "`1,250` has two meanings" in text
        assert "csv: {decimal: comma}" in text

    def test_and_the_map_can_say_which(self, read_text: ReadText) -> None:
        recording = read_text("t;a;w\n0;1,250;1\n1;2,500;2\n", more="csv: {decimal: comma}\n")
        assert recording.channels["a"].values == (1.25, 2.5)

    def test_a_leading_zero_tells_a_decimal_comma(self, read_text: ReadText) -> None:
        recording = read_text("t;a;w\n0;1,250;1\n1;0,500;2\n")
        assert recording.channels["a"].values == (1.25, 0.5)

    def test_both_decimal_signs_in_one_file(self, told_text: Callable[..., str]) -> None:
        text = told_text("t;a;w\n0;1,25;1\n1;2.5;2\n")
        assert "`2.5` in column `a` is not a finite number" in text
        assert "the decimal sign of this file is the comma" in text

    def test_a_number_with_a_sign_of_thousands(self, told_text: Callable[..., str]) -> None:
        text = told_text('t,a,w\n0,"1,002.5",1\n1,2,2\n')
        assert "a number has no signs of thousands" in text


class TestAMissingValue:
    @pytest.mark.parametrize(
        "word", ["NaN", "nan", "#N/A", "-", "--", "null", "NULL", "None", "N/A", "1.#QNAN", ""]
    )
    def test_is_skipped(self, read_text: ReadText, word: str) -> None:
        recording = read_text(f"t,a,w\n0,1,1\n1,{word},2\n2,3,3\n")
        assert recording.channels["a"].values == (1.0, 3.0)

    @pytest.mark.parametrize("word", ["inf", "1.#INF", "-Infinity", "error", "?"])
    def test_is_not_one_of_other_words(self, told_text: Callable[..., str], word: str) -> None:
        text = told_text(f"t,a,w\n0,1,1\n1,{word},2\n2,3,3\n")
        assert f"`{word}` in column `a` is not a finite number" in text

    def test_is_refused_where_the_map_does_not_skip(self, told_text: Callable[..., str]) -> None:
        text = told_text("t,a\n0,1\n1,NaN\n", columns="  a: {to: a, unit: N*m}\n")
        assert "column `a` has no value here: `NaN`" in text
        assert "`blank: skip` in the map" in text


class TestATimeColumn:
    @pytest.mark.parametrize(
        ("stamps", "time", "first"),
        [
            (("1700000000.5", "1700000000.6"), "unit: s", Fraction(17000000005, 10)),
            (("1700000000500", "1700000000600"), "unit: ms", Fraction(17000000005, 10)),
            (("1700000000500000", "1700000000600000"), "unit: us", Fraction(17000000005, 10)),
            (("1700000000500000000", "1700000000600000000"), "unit: ns", Fraction(17000000005, 10)),
            (("0.5", "0.75"), "unit: d", Fraction(43200)),
            (("2026-01-01T00:00:00.5Z", "2026-01-01 00:00:01Z"), "unit: s", None),
            (("2026-01-01 01:00:00.5+01:00", "2026-01-01 00:00:01+0000"), "unit: s", None),
            (("20260101T000000.5Z", "20260101T000001Z"), "unit: s", None),
            (("01.01.2026 00:00:00.5", "01.01.2026 00:00:01"), "unit: s", None),
            (("2026/1/1 12:00:00.5 AM", "2026/1/1 12:00:01 AM"), "unit: ms", None),
            (("2026:001:00:00:00.500000000", "2026:001:00:00:01"), "unit: s", None),
            (("01/01/2026 00:00:00.5", "13/01/2026 00:00:01"), "unit: s", None),
            (("01/01/2026 00:00:00.5", "01/13/2026 00:00:01"), "unit: s", None),
            (("01/01/2026 00:00:00.5", "01/01/2026 01:00:00"), "unit: s, date_order: MDY", None),
            (("10:30:25.010", "10:30:25.020"), "unit: s", Fraction(37825010, 1000)),
            (("01:00:00 PM", "1:00:00.5 PM"), "unit: s", Fraction(46800)),
        ],
    )
    def test_is_read(
        self, read_text: ReadText, stamps: tuple[str, str], time: str, first: Fraction | None
    ) -> None:
        recording = read_text(f"t,a,w\n{stamps[0]},1,1\n{stamps[1]},2,2\n", time=time)
        expected = Fraction(1767225600 * 2 + 1, 2) if first is None else first
        assert recording.channels["a"].times[0] == expected

    def test_of_dates_is_told(self, read_text: ReadText) -> None:
        recording = read_text("t,a,w\n2026-01-01T00:00:00,1,1\n2026-01-01T00:00:01,2,2\n")
        (item,) = recording.assumptions
        assert item.subject == "time column `t`"
        assert "taken as UTC" in item.reason

    def test_of_times_of_day_passes_midnight(self, read_text: ReadText) -> None:
        recording = read_text("t,a,w\n23:59:59.5,1,1\n00:00:00.5,2,2\n00:00:01,3,3\n")
        times = recording.channels["a"].times
        assert times[1] - times[0] == 1
        assert times[2] - times[1] == Fraction(1, 2)
        assert "midnight is passed" in recording.assumptions[0].reason

    def test_with_two_readings_of_the_date_is_refused(self, told_text: Callable[..., str]) -> None:
        text = told_text("t,a,w\n03/04/2026 10:00:00,1,1\n03/04/2026 10:00:01,2,2\n")
        assert "`03/04/2026 10:00:00` has two meanings: day or month first" in text
        assert "date_order: DMY" in text

    @pytest.mark.parametrize(
        ("stamps", "reason"),
        [
            (("03/04/26 10:00:00", "03/04/26 10:00:01"), "no year of four digits"),
            (("10:30", "10:31"), "a time of day has hours, minutes and seconds"),
            (("10:30:25:010", "10:30:25:020"), "behind a point"),
            (("2026-01-01T00:00:00Z", "2026-01-01T00:00:01"), "have a time zone, others do not"),
            (("2026-01-01T00:00:00", "12.5"), "is not like the first"),
            (("10:30:26.000", "10:30:25.000"), "is not above the one before"),
            (("2026-02-30T00:00:00", "2026-03-01T00:00:00"), "is not like the first"),
            (("1700000000000", "1700000000010"), "an epoch of this century in ms"),
        ],
    )
    def test_that_is_not_understood_is_refused(
        self, told_text: Callable[..., str], stamps: tuple[str, str], reason: str
    ) -> None:
        assert reason in told_text(f"t,a,w\n{stamps[0]},1,1\n{stamps[1]},2,2\n")


class TestAUnitOfTheFile:
    @pytest.mark.parametrize(
        ("units", "told"),
        [
            ("s,kNm,rad/s", "the file gives `a` in `kNm` (kN*m), the map in `N*m`"),
            ("s,Nm,RPM", "the file gives `w` in `RPM` (rpm), the map in `rad/s`"),
            ("ms,Nm,rad/s", "the file gives the time `t` in `ms`, the map in `s`"),
            ("s,furlong,rad/s", "the unit `furlong` of `a` in the file is not understood"),
            ("s,lbft,rad/s", 'unit: N*m, scale: 1.3558179483314, file_unit: "lbft"'),
        ],
    )
    def test_is_never_ignored(self, told_text: Callable[..., str], units: str, told: str) -> None:
        assert told in told_text(TABLE.replace("w\n", f"w\n{units}\n", 1))

    def test_in_brackets_of_a_name_is_compared_too(self, told_text: Callable[..., str]) -> None:
        columns = '  "w [1/min]": {to: w, unit: rad/s}\n'
        text = told_text("t,w [1/min]\n0,1\n1,2\n", columns=columns)
        assert "the file gives `w [1/min]` in `1/min` (rpm), the map in `rad/s`" in text

    @pytest.mark.parametrize("unit", ["rpm", "min^-1, scale: 1 rev"])
    def test_of_turns_may_be_a_speed_or_a_frequency(self, read_text: ReadText, unit: str) -> None:
        columns = f'  "w [1/min]": {{to: w, unit: {unit}}}\n'
        recording = read_text("t,w [1/min]\n0,60\n1,60\n", columns=columns)
        assert recording.channels["w [1/min]"].values[0] == pytest.approx(6.283185307179586)

    def test_may_be_accepted_by_the_map(self, read_text: ReadText) -> None:
        columns = "  a: {to: a, unit: N*m, file_unit: kNm}\n"
        recording = read_text("t,a\ns,kNm\n0,1\n1,2\n", columns=columns)
        assert recording.channels["a"].values == (1.0, 2.0)

    def test_is_proposed_with_the_name(self, told_text: Callable[..., str]) -> None:
        text = told_text("t,a [Nm]\n0,1\n1,2\n", columns="  a: {to: a, unit: N*m}\n")
        assert "did you mean `a [Nm]`?" in text


def test_the_log_of_a_motor_controller_with_semicolons(read_text: ReadText) -> None:
    text = "t;input_voltage;erpm;a;w;\n36000000;48.1;0;0.10;1;\n36000050;48.0;1200;3.50;2;\n"
    recording = read_text(text, time="unit: ms")
    assert recording.channels["a"].times == (Fraction(36000), Fraction(3600005, 100))
    assert recording.channels["a"].values == (0.1, 3.5)


def test_a_line_of_units_may_have_dashes_and_texts_for_columns_that_are_not_read(
    read_text: ReadText,
) -> None:
    recording = read_text("t,a,w,x,y\ns,Nm,rad/s,--,furlong\n0,1,2,3,4\n1,2,3,4,5\n")
    assert recording.channels["a"].values == (1.0, 2.0)


def test_a_row_without_values_is_no_line_of_units(read_text: ReadText) -> None:
    recording = read_text("t,a,w\n0,-,-\n1,2,3\n2,3,4\n")
    assert recording.channels["a"].values == (2.0, 3.0)
    assert recording.assumptions == ()


def test_a_text_in_brackets_that_is_no_unit_is_told(read_text: ReadText) -> None:
    recording = read_text("t,a,w,x (left)\n0,1,2,3\n1,2,3,4\n")
    (item,) = recording.assumptions
    assert (item.subject, item.value) == ("brackets in names", "`left`")
