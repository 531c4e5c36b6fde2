"""CAN frames in tables and in text logs that python-can does not read."""

from __future__ import annotations

import base64
from pathlib import Path

import pytest

from tests.engine.recordings.test_can_logs import (
    MAP,
    MOTOR,
    TORQUES,
    frame,
    motor_lines,
    notes_of,
    values_of,
    write,
)
from tests.engine.recordings.test_recording_formats import read, told

SAVVY = "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8"
"""Head line of the tables of SavvyCAN."""
COLUMNS = MAP.removeprefix("dbc: car.dbc\n")


def rows(form: str, gap: float = 0.01, start: float = 1.0, stamp: str = "{:.6f}") -> str:
    """Return a line for each torque; `form` has the fields `t`, `hex`, `cells`, `plain`."""
    lines = []
    for k, torque in enumerate(TORQUES):
        data = frame(torque)
        fields = {
            "t": stamp.format(start + gap * k),
            "hex": data.hex(" ").upper(),
            "cells": ",".join(f"{byte:02X}" for byte in data),
            "low": ",".join(f"{byte:x}" for byte in data),
            "plain": data.hex(),
            "base64": base64.b64encode(data).decode(),
            "semicolons": ";".join(f"0x{byte:02X}" for byte in data),
            "tabs": "\t".join(f"{byte:02X}" for byte in data),
        }
        lines.append(form.format(**fields))
    return "\n".join(lines) + "\n"


def times_of(path: Path, text: str = MAP) -> list[float]:
    return [float(time) for time in read(path, text).channels["T_em"].times]


class TestTables:
    @pytest.mark.parametrize(
        ("head", "form"),
        [
            (SAVVY, "{t},00000100,false,Rx,0,4,{cells},,,,,"),
            (SAVVY.replace("Dir,", ""), "{t},100,FALSE,1,4,{cells},00,00,00,00"),
            (SAVVY.replace("LEN", "DLC").replace("Dir,", ""), "{t},100,0,1,4,{low},0,0,0,0"),
        ],
    )
    def test_savvycan_writes_microseconds(self, tmp_path: Path, head: str, form: str) -> None:
        text = head + "\n" + rows(form, 10000, 1000000, "{:.0f}")
        path = write(tmp_path, "a.csv", text)
        found = read(path, MAP)
        assert values_of(found) == TORQUES
        assert times_of(path) == [1.0, 1.01, 1.02]
        assert "unit of `Time Stamp`: us (SavvyCAN writes such tables)" in notes_of(found)

    @pytest.mark.parametrize(
        ("head", "form"),
        [
            (
                "TimestampEpoch;BusChannel;ID;IDE;DLC;DataLength;Dir;EDL;BRS;DataBytes",
                "{t};1;100;0;4;4;0;0;0;{plain}",
            ),
            (
                "timestamp,arbitration_id,extended,remote,error,dlc,data",
                "{t},0x100,0,0,0,4,{base64}",
            ),
            ("Time [s]\tCAN ID\tLen\tData", "{t}\t0x00000100\t4\t0x{hex}"),
            ("# a comment\nt_s;Channel;Identifier;Data", "{t};can0;100h;{hex}"),
            ("Time,ID,B0,B1,B2,B3", "{t},100,{cells}"),
        ],
    )
    def test_columns_are_known_by_their_names(self, tmp_path: Path, head: str, form: str) -> None:
        for name in ("a.csv", "a.log", "a.txt"):
            path = write(tmp_path, name, head + "\n" + rows(form))
            assert values_of(read(path, MAP)) == TORQUES
            assert times_of(path) == [1.0, 1.01, 1.02]

    def test_stamps_may_be_dates(self, tmp_path: Path) -> None:
        text = "Time;ID;Data\n" + rows("2024-05-01T10:00:0{t};100;{hex}")
        times = times_of(write(tmp_path, "a.csv", text))
        assert [time - times[0] for time in times] == pytest.approx([0.0, 0.01, 0.02])

    @pytest.mark.parametrize("name", ["Time", "Time Stamp"])
    def test_the_unit_of_whole_stamps_is_stated_by_the_map(self, tmp_path: Path, name: str) -> None:
        head = f"ParserFlags\tCh\t{name}\tCAN ID\tLen\tData\n"
        text = head + rows("1\t0\t{t}\t0x00000100\t4\t0x{hex}", 10, 1000, "{:.0f}")
        path = write(tmp_path, "a.log", text)
        message = told(path, MAP)
        assert f"a.log:1:1: error: the unit of the time `{name}` is not known" in message
        stated = f"time: {{column: {name}, unit: ms}}"
        assert f"help: `{stated}` in the map states it" in message
        assert times_of(path, MAP + stated + "\n") == [1.0, 1.01, 1.02]

    def test_a_rate_that_no_bus_carries_is_not_believed(self, tmp_path: Path) -> None:
        body = "".join(f"{k},100,false,Rx,0,2,08,00\n" for k in range(1000))
        text = told(write(tmp_path, "a.csv", SAVVY + "\n" + body), MAP)
        assert "1000 frames of a bus in 999 us are more than a bus carries" in text

    def test_rows_that_are_no_frames_are_told(self, tmp_path: Path) -> None:
        bad = "5,XYZ,false,Rx,0,4,1,2,3,4\n6,100,false,Rx,0,4,1,2\n8,1\n"
        text = SAVVY + "\n" + rows("{t},100,false,Rx,0,4,{cells}", 1, 1, "{:.0f}000000") + bad
        found = read(write(tmp_path, "a.csv", text), MAP)
        assert values_of(found) == TORQUES
        assert any(note.startswith("lines: 3 left out (line 5 ") for note in notes_of(found))

    def test_without_a_database_the_columns_are_numbers(self, tmp_path: Path) -> None:
        text = "Time,ID,D1\n" + "".join(f"{k},10,{k}\n" for k in range(4))
        path = write(tmp_path, "a.csv", text)
        map_text = "time: {column: Time, unit: s}\ncolumns: {D1: {to: u, unit: 1}}\n"
        assert values_of(read(path, map_text), "D1") == (0.0, 1.0, 2.0, 3.0)

    def test_without_a_database_the_hint_names_it(self, tmp_path: Path) -> None:
        path = write(tmp_path, "a.csv", "Time,ID,D1\n" + "0.5,10,1\n" * 3)
        text = told(path, "time: {column: Time, unit: s}\n" + COLUMNS)
        assert "help: the rows are CAN frames: `dbc: vehicle.dbc` in the map decodes them" in text

    def test_a_table_of_other_columns_is_not_one_of_frames(self, tmp_path: Path) -> None:
        text = "t_s,T_em\n" + "".join(f"{k},{k}\n" for k in range(4))
        path = write(tmp_path, "a.csv", text)
        found = read(path, "dbc: car.dbc\ntime: {column: t_s, unit: s}\n" + COLUMNS)
        assert values_of(found) == (0.0, 1.0, 2.0, 3.0)


BUSMASTER = """\
***BUSMASTER Ver 3.2.2***
***PROTOCOL CAN***
***START DATE AND TIME 5:3:2024 10:30:25:000***
***HEX***
***SYSTEM MODE***
***<Time><Tx/Rx><Channel><CAN ID><Type><DLC><DataBytes>***
"""
MICROCHIP = "//----\nMicrochip Technology Inc.\nCAN BUS Analyzer\n//----\n"
CANHACKER = "@ TEXT @ 3 @ 64 @ 0 @ 3 @ 20 @ 00:00:00.020 @\n# $LocalTime=10:51:34.569\n"
PP2CAN = "PP2CAN log file\nCAN speed 1: 500k CAN speed 2: 500k\n\t\n"
LOGS = {
    "busmaster": ("a.log", BUSMASTER, "00:00:01:{t} Rx 1 0x100 s 4 {hex} ", "{:04.0f}", 0, 100),
    "microchip": ("a.log", MICROCHIP, "{t};RX;0x00000100;4;{semicolons};", "{:.0f}", 1000, 10),
    "canhacker": ("a.trc", CANHACKER, "1,{t}\t1\t00000004\t100\t4\t{hex}\t00000000\tAB\t0,01",
                  "{:06.0f}", 0, 10000),
    "pp2can": ("a.log", PP2CAN, ">\t0\t   0:0:1.{t}:0.00\tSt\t0x100\t0\t4\t{tabs}\t \t \t \t \tp:1",
               "{:.0f}", 0, 10),
    "candump": ("a.log", "=~=~ PuTTY log =~=~\n00 10\n", "({t}) RX0 100 [4] {hex}", "{:.2f}", 1,
                0.01),
    "candump -x": ("a.log", "", " ({t})  can0  RX - -  100   [4]  {hex}", "{:.6f}", 1, 0.01),
    "candump -a": ("a.log", "", " (1970-01-01 00:00:0{t})  can0  100   [4]  {hex}   'd..A'",
                   "{:.6f}", 1, 0.01),
}  # fmt: skip
"""Logs: name, head, line, format, first value and step of the stamp."""


class TestLines:
    @pytest.mark.parametrize("kind", LOGS)
    def test_a_log_is_read(self, tmp_path: Path, kind: str) -> None:
        name, head, form, stamp, start, gap = LOGS[kind]
        path = write(tmp_path, name, head + rows(form, gap, start, stamp))
        assert values_of(read(path, MAP)) == TORQUES
        assert times_of(path) == pytest.approx([1.0, 1.01, 1.02])

    @pytest.mark.parametrize("kind", LOGS)
    def test_a_cut_line_is_left_out_and_told(self, tmp_path: Path, kind: str) -> None:
        name, head, form, stamp, start, gap = LOGS[kind]
        text = head + rows(form, gap, start, stamp)
        last = text.rstrip("\n").splitlines()[-1]
        first_byte = last.rindex("A0") if "A0" in last else len(last) // 2
        found = read(write(tmp_path, name, text + last[: first_byte + 2] + "\n"), MAP)
        assert values_of(found) == TORQUES
        assert any(note.startswith("lines: 1 left out") for note in notes_of(found))

    def test_extended_identifiers(self, tmp_path: Path) -> None:
        dbc = MOTOR.replace("BO_ 256", "BO_ 2147483904")
        for kind, old, new in (
            ("busmaster", "0x100 s", "0x100 x"), ("pp2can", "\tSt\t", "\tEx\t"),
            ("canhacker", "\t100\t", "\t00000100\t"), ("candump", " 100 ", " 00000100 "),
        ):  # fmt: skip
            name, head, form, stamp, start, gap = LOGS[kind]
            text = head + rows(form.replace(old, new), gap, start, stamp)
            assert values_of(read(write(tmp_path, name, text, dbc), MAP)) == TORQUES

    def test_decimal_numbers_of_busmaster(self, tmp_path: Path) -> None:
        body = "00:00:01:0000 Rx 1 256 s 4 8 0 100 0\n00:00:01:0100 Rx 1 256 s 4 251 255 100 0\n"
        text = BUSMASTER.replace("HEX", "DEC") + body
        assert values_of(read(write(tmp_path, "a.log", text), MAP)) == TORQUES[:2]

    def test_relative_stamps_are_refused(self, tmp_path: Path) -> None:
        name, head, form, stamp, start, gap = LOGS["busmaster"]
        text = head.replace("SYSTEM", "RELATIVE") + rows(form, gap, start, stamp)
        message = told(write(tmp_path, name, text), MAP)
        assert "a.log:5:1: error: the time stamps of this log are differences" in message
        lines = "".join(f" (000.0{k % 3 + 1}) can0 100 [2] 08 00\n" for k in range(12))
        message = told(write(tmp_path, "b.log", lines), MAP)
        assert "the time stamps decrease" in message
        assert "`candump -ta` on the screen" in message

    def test_frames_without_stamps_are_refused(self, tmp_path: Path) -> None:
        text = told(write(tmp_path, "a.log", " can0  100   [2]  08 00\n" * 4), MAP)
        assert "error: the frames have no time stamps" in text

    def test_many_lines_that_are_no_frames_end_soon(self, tmp_path: Path) -> None:
        lines = "".join(f"{k}\t 00.1\tno frame\n" for k in range(20000))
        for name in ("a.trc", "a.asc", "a.log"):
            assert "this is no log of CAN frames" in told(write(tmp_path, name, lines), MAP)


@pytest.mark.parametrize("line", ["100#R4", "20000080#0000000000000000"])
def test_a_log_without_data_frames_is_told(tmp_path: Path, line: str) -> None:
    text = told(write(tmp_path, "a.log", f"(1.000000) can0 {line}\n"), MAP)
    assert "data frame" in text


def test_frames_in_a_text_file_need_no_suffix_of_a_log(tmp_path: Path) -> None:
    assert values_of(read(write(tmp_path, "a.txt", motor_lines()), MAP)) == TORQUES
