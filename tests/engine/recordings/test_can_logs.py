"""CAN logs: what is left out, assumed or refused, and that it is told once, with what helps."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import pytest

from engine.recordings.recording import Recording
from tests.engine.recordings.test_recording_formats import read, told

HEADER = 'VERSION ""\nNS_ :\nBS_:\nBU_: ECU\n'
MOTOR = """\
BO_ 256 Motor: 4 ECU
 SG_ T_em : 0|16@1- (0.25,0) [0|0] "Nm" ECU
 SG_ n_em : 16|16@1- (1,0) [0|0] "rpm" ECU
"""
MAP = "dbc: car.dbc\ncolumns: {T_em: {to: T_em, unit: N*m}}\n"
ASC = """\
date Fri Mar 5 10:30:25.000 am 2024
base hex  timestamps absolute
no internal events logged
"""
TORQUES = (2.0, -1.25, 40.0)


def frame(torque: float, speed: int = 100) -> bytes:
    return struct.pack("<hh", round(4 * torque), speed)


def candump(*rows: tuple[float, str, str]) -> str:
    return "".join(f"({time:017.6f}) {bus} {data}\n" for time, bus, data in rows)


def motor_lines(bus: str = "can0", shift: float = 0.0, identifier: str = "100") -> str:
    return candump(
        *(
            (1.0 + 0.01 * k + shift, bus, f"{identifier}#{frame(T).hex().upper()}")
            for k, T in enumerate(TORQUES)
        )
    )


def write(folder: Path, name: str, text: str | bytes, dbc: str = MOTOR) -> Path:
    (folder / "car.dbc").write_bytes((HEADER + dbc).encode("utf-8"))
    data = text if isinstance(text, bytes) else text.encode("utf-8")
    (folder / name).write_bytes(data)
    return folder / name


def notes_of(recording: Recording) -> list[str]:
    return [f"{item.subject}: {item.value} ({item.reason})" for item in recording.assumptions]


def values_of(recording: Recording, name: str = "T_em") -> Sequence[float]:
    return recording.channels[name].values


class TestBuses:
    def test_one_identifier_on_two_buses_is_not_merged(self, tmp_path: Path) -> None:
        path = write(tmp_path, "a.log", motor_lines() + motor_lines("can1", 0.003))
        text = told(path, MAP)
        assert "error: there are two signals `T_em`" in text
        assert "names one of them: `can0.Motor.T_em`, `can1.Motor.T_em`" in text

    @pytest.mark.parametrize(("bus", "first"), [("can0", 1.0), ("can1", 1.003)])
    def test_the_map_selects_a_bus(self, tmp_path: Path, bus: str, first: float) -> None:
        path = write(tmp_path, "a.log", motor_lines() + motor_lines("can1", 0.003))
        found = read(path, MAP.replace("{to", f"{{column: {bus}.Motor.T_em, to"))
        assert values_of(found) == TORQUES
        assert found.channels["T_em"].times[0] == pytest.approx(first)

    def test_numbered_buses_have_the_numbers_of_the_log(self, tmp_path: Path) -> None:
        lines = [
            f"   {0.01 * k:.6f} {bus}  100  Rx   d 4 08 00 64 00" for k, bus in ((0, 1), (1, 2))
        ]
        path = write(tmp_path, "a.asc", ASC + "\n".join(lines) + "\n")
        assert "`CAN1.Motor.T_em`, `CAN2.Motor.T_em`" in told(path, MAP)

    def test_two_definitions_of_one_message_are_not_merged(self, tmp_path: Path) -> None:
        path = write(tmp_path, "a.log", motor_lines())
        (tmp_path / "other.dbc").write_text(HEADER + MOTOR.replace("0.25", "0.5"), "utf-8")
        text = told(path, MAP.replace("car.dbc", "[car.dbc, other.dbc]"))
        assert "help: the DBC files define `Motor.T_em` several times" in text
        same = MAP.replace("car.dbc", "[car.dbc, ./car.dbc]")
        assert values_of(read(path, same)) == TORQUES

    def test_sent_and_received_copies_of_a_frame_count_once(self, tmp_path: Path) -> None:
        line = motor_lines().splitlines()
        path = write(tmp_path, "a.log", "".join(f"{one} T\n{one} R\n" for one in line))
        found = read(path, MAP)
        assert values_of(found) == TORQUES
        assert notes_of(found)[0].startswith("frames: 3 of 6 left out (they repeat the time stamp")


class TestBadItems:
    @pytest.mark.parametrize("data", ["100#0800", "100#", "100#080064"])
    def test_a_short_frame_is_left_out_and_told(self, tmp_path: Path, data: str) -> None:
        path = write(tmp_path, "a.log", motor_lines() + candump((2.0, "can0", data)))
        found = read(path, MAP)
        assert values_of(found) == TORQUES
        (note,) = notes_of(found)
        assert note.startswith("frames of message `Motor`: 1 of 4 left out (the one at 2.0 s has")

    @pytest.mark.parametrize(
        "line", ["(2.0) can0 100#0800640", "(2.0) can", "junk", "(2.0) can0 100"]
    )
    def test_a_cut_line_is_left_out_and_told(self, tmp_path: Path, line: str) -> None:
        found = read(write(tmp_path, "a.log", motor_lines() + line), MAP)
        assert values_of(found) == TORQUES
        assert notes_of(found) == [f"lines: 1 left out (line 4 is no complete frame: `{line}`)"]

    @pytest.mark.parametrize("digits", [310, 1000, 4000])
    @pytest.mark.parametrize("name", ["a.log", "a.asc", "a.csv"])
    def test_a_frame_without_a_finite_time_is_left_out_and_told(
        self, tmp_path: Path, name: str, digits: int
    ) -> None:
        stamps = [f"{0.01 * k:.6f}" for k in range(3)] + ["9" * digits + ".0"]
        form = {
            "a.log": "({}) can0 100#08006400",
            "a.asc": "   {} 1  100             Rx   d 4 08 00 64 00",
            "a.csv": "{},0x100,08 00 64 00",
        }[name]
        head = {"a.log": "", "a.asc": ASC, "a.csv": "time,id,data\n"}[name]
        text = head + "".join(form.format(stamp) + "\n" for stamp in stamps)
        found = read(write(tmp_path, name, text), MAP)
        assert values_of(found) == (2.0, 2.0, 2.0)
        assert any("left out" in note for note in notes_of(found))

    @pytest.mark.parametrize("name", ["a.csv", "a.txt", "a.log"])
    @pytest.mark.parametrize(
        "row", ["0.0,0x100,08 0G", "0.0,junk,08 00", "1e999999999,0x100,08 00"]
    )
    def test_a_table_without_a_frame_is_told(self, tmp_path: Path, name: str, row: str) -> None:
        text = "time,id,data\n" + f"{row}\n" * 3
        assert "error: this is no log of CAN frames" in told(write(tmp_path, name, text), MAP)

    @pytest.mark.parametrize(
        "line",
        [
            "1  100             Rx   d 4 08 0 64 00", "1  100             Rx   d 4 08 001 64 00",
            "1  100             Rx   d 4 08 00 64", "1  100             Rx   d 4 08 00 64 00 11",
            "1  100             Rx:  d 4 08 00 64 00", "1  100             Rx   ` 4 08 00 64 00",
            "1  ff100           Rx   d 4 08 00 64 00", "1  100             Rx   d 1f 08 00 64 00",
        ],
    )  # fmt: skip
    def test_a_damaged_frame_of_asc_is_left_out_and_told(self, tmp_path: Path, line: str) -> None:
        rows = ["1  100             Rx   d 4 08 00 64 00"] * 3 + [line]
        text = ASC + "".join(f"   {0.01 * k:.6f} {row}\n" for k, row in enumerate(rows))
        found = read(write(tmp_path, "a.asc", text), MAP)
        assert values_of(found) == (2.0, 2.0, 2.0)
        assert [note.split(":")[0] for note in notes_of(found)] == ["lines"]

    @pytest.mark.parametrize(
        "line",
        ["V9 13 25 0 0 620 x 4", "PktEth: Tx 01020304", "junk"],
    )
    def test_other_lines_of_asc_are_told(self, tmp_path: Path, line: str) -> None:
        rows = ["1  100             Rx   d 4 08 00 64 00"] * 3 + [line]
        text = ASC + "".join(f"   {0.01 * k:.6f} {row}\n" for k, row in enumerate(rows))
        found = read(write(tmp_path, "a.asc", text), MAP)
        assert values_of(found) == (2.0, 2.0, 2.0)
        (note,) = notes_of(found)
        assert note.startswith(
            "other lines: 1 left out (they are no frames of a CAN bus; line 7: `"
        )

    @pytest.mark.parametrize(
        "line",
        [
            "1  Statistic: D 0 R 0 XD 0", "Start of measurement", "log trigger event",
            "1  100  Rx d 4 08 00 64 00  Length = 1 BitCount = 2",
        ],
    )  # fmt: skip
    def test_events_of_asc_are_not_told(self, tmp_path: Path, line: str) -> None:
        rows = [line] + ["1  100             Rx   d 4 08 00 64 00"] * 3
        text = ASC + "".join(f"   {0.01 * k:.6f} {row}\n" for k, row in enumerate(rows))
        assert notes_of(read(write(tmp_path, "a.asc", text), MAP)) == []

    @pytest.mark.parametrize("header", ["base hex", "base hex timestamp absolute", "base dec time"])
    def test_stamps_that_the_head_does_not_explain_are_told(
        self, tmp_path: Path, header: str
    ) -> None:
        text = ASC.replace("base hex  timestamps absolute", header)
        text += "".join(f"   {0.01 * k:.6f} 1  100  Rx   d 1 08\n" for k in range(3))
        dbc = MOTOR.replace("Motor: 4", "Motor: 1").replace("0|16", "0|8")
        text = text.replace(" 100 ", " 256 ") if "dec" in header else text
        (note,) = notes_of(read(write(tmp_path, "a.asc", text, dbc), MAP))
        assert note.startswith("time stamps: absolute (the header does not state whether")

    @pytest.mark.parametrize("data", ["100#" + "00" * 9, "100##1" + "00" * 65, "100#" + "11" * 40])
    def test_a_frame_of_too_many_bytes_is_left_out(self, tmp_path: Path, data: str) -> None:
        path = write(tmp_path, "a.log", motor_lines() + candump((2.0, "can0", data)))
        found = read(path, MAP)
        assert values_of(found) == TORQUES
        assert notes_of(found)[0].startswith("lines: 1 left out (line 4 is no complete frame")

    def test_a_cut_line_of_asc_is_left_out_and_told(self, tmp_path: Path) -> None:
        line = "   {:.6f} 1  100             Rx   d 4 08 00 64 00"
        text = "\n".join(line.format(0.01 * k) for k in range(3))
        found = read(write(tmp_path, "a.asc", ASC + text[:-1]), MAP)
        assert values_of(found) == (2.0, 2.0)
        (note,) = notes_of(found)
        assert note.startswith(
            "lines: 1 left out (line 6 may be cut, because it has no line break: `0.02"
        )

    def test_a_line_that_the_library_refuses_is_left_out(self, tmp_path: Path) -> None:
        line = "   {:.6f} 1  100             Rx   d 4 {} 00 64 00"
        rows = [line.format(0.01 * k, "0G" if k == 2 else "08") for k in range(6)]
        found = read(write(tmp_path, "a.asc", ASC + "\n".join(rows) + "\n"), MAP)
        assert len(values_of(found)) == 5
        assert notes_of(found)[0].startswith(
            "lines: 1 left out (line 6 is no complete frame: `0.02"
        )

    def test_error_frames_are_no_data(self, tmp_path: Path) -> None:
        rows = candump((1.5, "can0", "20000004#0008000000000000"), (1.6, "can0", "100#R"))
        found = read(write(tmp_path, "a.log", motor_lines() + rows), MAP)
        assert values_of(found) == TORQUES and not found.assumptions

    def test_the_rest_of_a_damaged_blf_is_left_out(self, tmp_path: Path) -> None:
        import can

        path = write(tmp_path, "a.blf", b"")
        with can.BLFWriter(str(path), max_container_size=4096) as log:
            for k in range(600):
                log.on_message_received(
                    can.Message(
                        timestamp=0.01 * k,
                        arbitration_id=256,
                        data=frame(2.0),
                        is_extended_id=False,
                    )
                )
        data = path.read_bytes()
        half = len(data) // 2
        path.write_bytes(data[:half])
        found = read(path, MAP)
        assert 0 < len(values_of(found)) < 600
        assert notes_of(found) == [
            f"end of the log: left out (the log has {half} of {len(data)} bytes)"
        ]
        path.write_bytes(data[:half] + bytes([data[half] ^ 255]) + data[half + 1 :])
        found = read(path, MAP)
        assert 0 < len(values_of(found)) < 600
        assert notes_of(found)[0].startswith("frames: all behind frame ")


class TestDatabases:
    def test_overlapping_signals_do_not_hide_the_others(self, tmp_path: Path) -> None:
        dbc = MOTOR + ' SG_ low : 8|16@1- (1,0) [0|0] "" ECU\n'
        found = read(write(tmp_path, "a.log", motor_lines(), dbc), MAP)
        assert values_of(found) == TORQUES
        assert notes_of(found) == [
            "signal `T_em`: read as the DBC states "
            "(the DBC lets it overlap with `low` in message `Motor`)"
        ]

    @pytest.mark.parametrize(
        "stray",
        [
            'VAL_ 256 absent 0 "a;b" 1 "c" ;',
            'VAL_ 999 absent 0 "a" ;',
            "SIG_VALTYPE_ 256 absent : 1;",
            'VAL_ 256 T_em 1 "x"y" ;',
            'BO_ 300 A B: 4 ECU\n SG_ T_em : 0|8@1+ (1,0) [0|0] "" ECU',
            'BO_ 1073741924 Wide: 4 ECU\n SG_ q : 0|8@1+ (1,0) [0|0] "" ECU',
        ],
    )
    def test_a_stray_statement_is_left_out_and_told(self, tmp_path: Path, stray: str) -> None:
        found = read(write(tmp_path, "a.log", motor_lines(), f"{MOTOR}\n{stray}\n"), MAP)
        assert values_of(found) == TORQUES
        (note,) = notes_of(found)
        assert note.startswith("`car.dbc`: 1 statements left out (line 9 (`")

    def test_two_stray_tables_of_values_are_both_left_out(self, tmp_path: Path) -> None:
        dbc = MOTOR + '\nVAL_ 256 x 0 "a" ;\nVAL_ 256 T_em 1 "one" ;\nVAL_ 256 y 0 "a" ;\n'
        found = read(write(tmp_path, "a.log", motor_lines(), dbc), MAP)
        assert "2 statements left out" in notes_of(found)[0]

    @pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
    def test_a_degree_sign_is_read_in_both_encodings(self, tmp_path: Path, encoding: str) -> None:
        path = write(tmp_path, "a.log", motor_lines())
        dbc = HEADER + MOTOR.replace('"Nm"', '"\N{DEGREE SIGN}C"')
        (tmp_path / "car.dbc").write_bytes(dbc.encode(encoding))
        text = MAP.replace("N*m", "degC")
        assert values_of(read(path, text))[0] == 2.0 + 273.15

    def test_a_word_for_a_missing_value_gives_no_value(self, tmp_path: Path) -> None:
        dbc = MOTOR + '\nVAL_ 256 T_em 8 "SNA" -5 "standstill" ;\n'
        path = write(tmp_path, "a.log", motor_lines(), dbc)
        found = read(path, MAP.replace("unit: N*m", "unit: N*m, blank: skip"))
        assert values_of(found) == TORQUES[1:]
        assert notes_of(found) == [
            "signal `T_em`: 1 of 3 samples have no value (the DBC calls them `SNA`)"
        ]


class TestUnits:
    @pytest.mark.parametrize("unit", ["Furlong", "Nm/K^2?", "%Q"])
    def test_an_unknown_unit_is_refused_unless_the_map_accepts_it(
        self, tmp_path: Path, unit: str
    ) -> None:
        path = write(tmp_path, "a.log", motor_lines(), MOTOR.replace('"Nm"', f'"{unit}"'))
        text = told(path, MAP)
        assert f"error: the unit `{unit}` of `T_em` in the file is not understood" in text
        assert f'help: `file_unit: "{unit}"` in the map' in text
        accepted = MAP.replace("unit: N*m", f"unit: N*m, file_unit: '{unit}'")
        assert values_of(read(path, accepted)) == TORQUES

    def test_a_wrong_unit_of_the_file_can_be_accepted(self, tmp_path: Path) -> None:
        path = write(tmp_path, "a.log", motor_lines(), MOTOR.replace('"Nm"', '"rpm"'))
        assert "error: the file gives `T_em` in `rpm`, the map in `N*m`" in told(path, MAP)
        accepted = MAP.replace("unit: N*m", "unit: N*m, file_unit: rpm")
        assert values_of(read(path, accepted)) == TORQUES

    @pytest.mark.parametrize("unit", ["", " Nm ", "N.m"])
    def test_no_unit_and_other_spellings_are_accepted(self, tmp_path: Path, unit: str) -> None:
        path = write(tmp_path, "a.log", motor_lines(), MOTOR.replace('"Nm"', f'"{unit}"'))
        assert values_of(read(path, MAP)) == TORQUES


class TestMultiplexers:
    DBC = """\
BO_ 512 Muxed: 4 ECU
 SG_ sel M : 0|8@1+ (1,0) [0|0] "" ECU
 SG_ T_em m0 : 8|8@1+ (1,0) [0|0] "Nm" ECU
 SG_ n_em m1 : 8|8@1+ (1,0) [0|0] "rpm" ECU
 SG_ base : 24|8@1+ (1,0) [0|0] "Nm" ECU
"""

    def test_unknown_values_of_a_multiplexer_are_left_out_and_told(self, tmp_path: Path) -> None:
        rows = [(1.0, "00050007"), (1.1, "01090007"), (1.2, "07FF0007"), (1.3, "00060008")]
        text = candump(*((time, "can0", f"200#{data}") for time, data in rows))
        path = write(tmp_path, "a.log", text, self.DBC)
        found = read(path, MAP)
        assert values_of(found) == (5.0, 6.0)
        (note,) = notes_of(found)
        assert note.startswith("frames of message `Muxed`: 1 of 4 left out")
        assert "the value 7 of the multiplexer `sel`" in note
        every = read(path, MAP.replace("T_em: {", "base: {"))
        assert values_of(every, "base") == (7.0, 7.0, 7.0, 8.0) and not every.assumptions


class TestJ1939:
    DBC = """\
BO_ 2565866750 EEC1: 4 ECU
 SG_ T_em : 0|16@1- (0.25,0) [0|0] "Nm" ECU
"""

    def test_a_message_is_found_by_its_parameter_group(self, tmp_path: Path) -> None:
        path = write(tmp_path, "a.log", motor_lines(identifier="0CF00421"), self.DBC)
        found = read(path, MAP)
        assert values_of(found) == TORQUES
        (note,) = notes_of(found)
        assert note.startswith("message `EEC1`: 0xcf00421 (it has the same parameter group")
        assert "(PGN 61444) as 0x18f004fe in the DBC" in note

    def test_two_sources_of_a_parameter_group_are_not_merged(self, tmp_path: Path) -> None:
        text = motor_lines(identifier="18F00400") + motor_lines(identifier="18F00421", shift=0.001)
        path = write(tmp_path, "a.log", text, self.DBC)
        assert "`0x18f00400.EEC1.T_em`, `0x18f00421.EEC1.T_em`" in told(path, MAP)
        chosen = MAP.replace("{to", "{column: 0x18f00421.EEC1.T_em, to")
        assert values_of(read(path, chosen)) == TORQUES

    def test_a_stated_source_is_taken_if_the_log_has_it(self, tmp_path: Path) -> None:
        text = motor_lines(identifier="18F00400") + motor_lines(identifier="18F004FE", shift=0.001)
        found = read(write(tmp_path, "a.log", text, self.DBC), MAP)
        assert values_of(found) == TORQUES and not found.assumptions

    @pytest.mark.parametrize(
        ("number", "identifier", "help"),
        [
            (2565866496, "18F00421", "its parameter group (PGN 61444) as 0x18f00421"),
            (2565866750, "18FF0400", "a similar one is 0x18ff0400"),
            (2147483904, "100", "the log has this number as a standard identifier"),
        ],
    )
    def test_the_near_identifier_is_named(
        self, tmp_path: Path, number: int, identifier: str, help: str
    ) -> None:
        dbc = self.DBC.replace("2565866750", str(number))
        assert help in told(write(tmp_path, "a.log", motor_lines(identifier=identifier), dbc), MAP)


class TestText:
    FRAME = "{} {}  100             Rx   d 4 08 00 64 00"

    def asc(self, stamps: Sequence[str], header: str = ASC) -> str:
        return header + "".join(self.FRAME.format(f"   {one}", 1) + "\n" for one in stamps)

    def test_relative_stamps_are_added_up(self, tmp_path: Path) -> None:
        header = ASC.replace("absolute", "relative")
        text = self.asc(["0.010000", "0.010100", "0.010200"], header)
        text = text.replace("   0.010100", "   0.5 1 Statistic: x\n   0.010100")
        found = read(write(tmp_path, "a.asc", text), MAP)
        assert [float(t) for t in found.channels["T_em"].times] == [0.01, 0.5201, 0.5303]
        assert notes_of(found)[0].startswith("time stamps: added to those of the lines before")

    def test_decimal_commas_are_read_and_told(self, tmp_path: Path) -> None:
        found = read(write(tmp_path, "a.asc", self.asc(["0,010000", "0,020000"])), MAP)
        assert [float(t) for t in found.channels["T_em"].times] == [0.01, 0.02]
        assert notes_of(found) == ["decimal sign: comma (the form of the time stamps)"]

    def test_the_start_of_a_measurement_of_can_fd_is_no_frame(self, tmp_path: Path) -> None:
        header = ASC + "   0.000000 CANFD   Start of measurement\n"
        found = read(write(tmp_path, "a.asc", self.asc(["0.01", "0.02"], header)), MAP)
        assert len(values_of(found)) == 2 and not found.assumptions

    @pytest.mark.parametrize(
        ("name", "text", "label", "help"),
        [
            (
                "a.log",
                "  can0  100   [4]  08 00 64 00\n",
                "a.log:1:1: error: the frames have no time stamps",
                "`candump -L` or `candump -l` write a log",
            ),
            (
                "a.log",
                "\nt;x\n1;2\n",
                "a.log:2:1: error: this is no log of CAN frames: `t;x`",
                "#0F",
            ),
            ("a.asc", "t,x\n1,2\n", "a.asc:2:1: error: this is no log of CAN frames: `1,2`", "Rx"),
            ("a.trc", ";$FILEVERSION=1.2\n1) 2.0 1 Rx 0100 - 2 01 02\n", "a.trc:2:1", "1.0, 1.1"),
        ],
    )
    def test_another_format_is_told_with_its_line(
        self, tmp_path: Path, name: str, text: str, label: str, help: str
    ) -> None:
        found = told(write(tmp_path, name, text), MAP)
        assert label in found and help in found
        assert "int()" not in found and "unpack" not in found

    @pytest.mark.parametrize(
        "text",
        [
            ";##\n;   1)      {0}  0100  4  08 00 64 00\n    1)      1.5  0100  4  08 00 64 00\n",
            ";$FILEVERSION=1.1\n;$STARTTIME=45000.5\n"
            "     1)         1.5  Rx     0100  4  08 00 64 00\n",
            ";$FILEVERSION=2.1\n;$STARTTIME=45000.5\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n"
            "      1         1.500 DT 1      0100 Rx -  4    08 00 64 00\n",
        ],
    )
    def test_trc_is_read(self, tmp_path: Path, text: str) -> None:
        found = read(write(tmp_path, "a.trc", text), MAP)
        assert values_of(found) == (2.0,)

    def test_a_frame_of_trc_without_its_last_byte_is_told(self, tmp_path: Path) -> None:
        line = "     {})         1.5  Rx     0100  4  08 00 64"
        lines = [";$FILEVERSION=1.1", ";$STARTTIME=45000.5", line.format(1), line.format(2) + " 00"]
        found = read(write(tmp_path, "a.trc", "\n".join(lines) + "\n"), MAP)
        assert values_of(found) == (2.0,)
        assert notes_of(found)[0].startswith("lines: 1 left out (line 3 is no complete frame: `1)")

    def test_a_damaged_header_is_told_with_its_line(self, tmp_path: Path) -> None:
        text = ";$FILEVERSION=1.1\n;$STARTTIME=noon\n   1)  1.5  Rx  0100  1  08\n"
        found = told(write(tmp_path, "a.trc", text), MAP)
        assert "a.trc:2:1: error: this is no log of CAN frames: `;$STARTTIME=noon`" in found

    @pytest.mark.parametrize("header", ["", "base hex  timestamps absolute\n"])
    def test_an_asc_log_with_half_a_header_loses_no_frame(
        self, tmp_path: Path, header: str
    ) -> None:
        found = read(write(tmp_path, "a.asc", self.asc(["0.01", "0.02"], header)), MAP)
        assert len(values_of(found)) == 2
        assert bool(found.assumptions) == (not header)

    def test_a_log_of_error_frames_has_no_data(self, tmp_path: Path) -> None:
        rows = candump((1.5, "can0", "20000004#0008000000000000"))
        text = told(write(tmp_path, "a.log", rows), MAP)
        assert "error: the log has no data frames" in text

    def test_unsorted_frames_are_told_with_all_digits(self, tmp_path: Path) -> None:
        text = candump(
            (1.7e9 + 0.5, "can0", "100#08006400"), (1.7e9 + 0.25, "can0", "100#08006400")
        )
        found = told(write(tmp_path, "a.log", text), MAP)
        assert "time stamp 1700000000.25 is not above the one before, 1700000000.5" in found
