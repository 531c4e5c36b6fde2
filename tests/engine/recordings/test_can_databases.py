"""CAN databases as public ones are: imperfect DBC files, and one database for each bus."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from tests.engine.recordings.test_can_logs import (
    ASC,
    HEADER,
    MAP,
    MOTOR,
    TORQUES,
    candump,
    frame,
    motor_lines,
    notes_of,
    values_of,
    write,
)
from tests.engine.recordings.test_mdf_channels import TestBus
from tests.engine.recordings.test_recording_formats import read, told

INDEX = """\
BO_ 256 Motor: 4 ECU
 SG_ Index M : 0|8@1{sign} (1,0) [0|0] "" ECU
 SG_ T_em m{value} : 16|16@1- (0.25,0) [0|0] "Nm" ECU
"""
"""A message whose signal one value of a multiplexer selects."""


def column(name: str, unit: str = "N*m") -> str:
    return f"dbc: car.dbc\ncolumns: {{T_em: {{column: '{name}', to: T_em, unit: {unit}}}}}\n"


def selected_lines(*indices: int) -> str:
    frames = [struct.pack("<Bxh", index, 4 * k) for k, index in enumerate(indices)]
    return candump(
        *((1.0 + 0.01 * k, "can0", f"100#{data.hex()}") for k, data in enumerate(frames))
    )


class TestIdentifiers:
    def test_an_identifier_of_29_bits_without_its_bit_is_extended(self, tmp_path: Path) -> None:
        dbc = MOTOR.replace("BO_ 256", "BO_ 419361024") + 'VAL_ 419361024 n_em 1 "slow" ;\n'
        found = read(write(tmp_path, "a.log", motor_lines(identifier="18FEF100"), dbc), MAP)
        assert values_of(found) == TORQUES
        assert notes_of(found) == [
            "identifiers of messages in `car.dbc`: 1 taken as extended (line 5: 0x18fef100 has "
            "more than 11 bits, but not the bit of extended identifiers)"
        ]

    def test_one_of_more_than_29_bits_is_left_out(self, tmp_path: Path) -> None:
        dbc = MOTOR + MOTOR.replace("256 Motor", "1075054137 Other")
        found = read(write(tmp_path, "a.log", motor_lines(), dbc), MAP)
        assert values_of(found) == TORQUES
        (note,) = notes_of(found)
        assert "line 8 (`BO_ 1075054137 Other:`) has an identifier of more than 29 bits" in note

    def test_two_messages_of_one_name_are_told_apart_by_identifier(self, tmp_path: Path) -> None:
        dbc = MOTOR + MOTOR.replace("256", "257").replace("0.25", "0.5")
        lines = motor_lines() + motor_lines(identifier="101", shift=0.005)
        path = write(tmp_path, "a.log", lines, dbc)
        assert "`0x100.Motor.T_em`, `0x101.Motor.T_em`" in told(path, MAP)
        found = read(path, column("0x101.Motor.T_em"))
        assert values_of(found) == tuple(2 * value for value in TORQUES)


class TestStatements:
    @pytest.mark.parametrize(
        ("right", "written"),
        [
            ("(0.25,0)", "(.25,0)"),
            ("(0.25,0)", "(0.25,-.0)"),
            ("(0.25,0) [0|0]", "(+0.25,0) [-.5|+.5]"),
            (HEADER, ""),
            ("BS_:", "BS_: 500000 : 2, 2"),
            ("BU_: ECU\n", 'BU_: ECU\nCM_ "no semicolon"\n'),
            ("BU_: ECU\n", 'BU_: ECU\nCM_ SG_ 256 "no name";\nBA_ "Sendable" BO_ 256 True;\n'),
            ("BU_: ECU\n", 'BU_: ECU\nCM_ "two\nBO_ 256 Lines: 8 ECU\nof text";\n'),
            ("BU_: ECU\n", "BU_: ECU\n/* a comment\nBO_ 256 Old: 8 ECU */\n// and another\n"),
            ("BU_: ECU\n", 'BU_: ECU\nBA_DEF_ BO_ "Bad" ENUM ;\nEV_ nothing;\n'),
        ],
    )
    def test_a_file_with_a_bad_habit_is_read(
        self, tmp_path: Path, right: str, written: str
    ) -> None:
        path = write(tmp_path, "a.log", motor_lines())
        text = HEADER + MOTOR
        assert right in text
        (tmp_path / "car.dbc").write_text(text.replace(right, written, 1), "utf-8")
        found = read(path, MAP)
        assert values_of(found) == TORQUES
        assert not notes_of(found)

    @pytest.mark.parametrize("name", ["5_SEC_TIMER", "64_BIT", "0x", "12"])
    def test_a_name_may_begin_with_a_digit(self, tmp_path: Path, name: str) -> None:
        dbc = MOTOR.replace("Motor", "2017_5").replace("T_em", name)
        dbc += f'VAL_ 256 {name} 9 "nine" ;\n'
        path = write(tmp_path, "a.log", motor_lines(), dbc)
        assert values_of(read(path, column(name))) == TORQUES
        assert values_of(read(path, column(f"2017_5.{name}"))) == TORQUES

    def test_more_faulty_attributes_than_rounds_do_not_count(self, tmp_path: Path) -> None:
        faults = "".join(f'BA_ "Sendable" BO_ {k} True;\nCM_ BO_ {k} no text;\n' for k in range(60))
        assert values_of(read(write(tmp_path, "a.log", motor_lines(), MOTOR + faults), MAP))

    def test_a_signal_without_a_message_is_told(self, tmp_path: Path) -> None:
        dbc = ' SG_ lost : 0|8@1+ (1,0) [0|0] "" ECU\n' + MOTOR
        (note,) = notes_of(read(write(tmp_path, "a.log", motor_lines(), dbc), MAP))
        assert "line 5 (`SG_ lost :`) is a signal without a message" in note

    def test_a_part_of_a_database_names_the_others(self, tmp_path: Path) -> None:
        text = told(write(tmp_path, "a.log", motor_lines(), 'CM_ "IMPORT _common.dbc";\n'), MAP)
        assert "error: `car.dbc` has no message" in text
        assert "`dbc:` in the map lists them instead: `_common.dbc`" in text
        text = told(write(tmp_path, "a.log", motor_lines(), ""), MAP)
        assert "error: `car.dbc` has no message" in text

    @pytest.mark.parametrize("name", ["car.arxml", "car.kcd", "car.sym"])
    def test_another_database_that_is_damaged_is_told(self, tmp_path: Path, name: str) -> None:
        (tmp_path / name).write_text("<a/>\n", "utf-8")
        path = write(tmp_path, "a.log", motor_lines())
        text = told(path, MAP.replace("car.dbc", name))
        assert f"error: `{name}` cannot be understood: " in text
        assert not any(word in text for word in ("ARXML:", "KCD:", "SYM:", ">>!<<"))
        assert "help: a DBC file of the same bus is read" in text

    def test_a_pointer_of_git_lfs_is_named(self, tmp_path: Path) -> None:
        pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 9\n"
        path = write(tmp_path, "a.log", motor_lines())
        (tmp_path / "car.dbc").write_text(pointer, "utf-8")
        text = told(path, MAP)
        assert "error: `car.dbc` is a pointer of Git LFS, and not the database" in text
        for name in ("b.log", "b.mf4", "b.csv", "b.parquet", "b.blf"):
            text = told(write(tmp_path, name, pointer), MAP)
            assert "error: the recording cannot be read: it is a pointer of Git LFS" in text
            assert "help: `git lfs pull` fetches the file itself" in text


class TestSignalsWithoutAValue:
    """cantools fails at a frame, or needs minutes to load such a file."""

    @pytest.mark.parametrize(
        ("statement", "told"),
        [
            (
                f' SG_ x : {place} (1,0) [0|0] "" ECU',
                "(`SG_ x :`) has bits outside of a message of 4095 bytes",
            )
            for place in ("-1|8@1+", "-16|16@1-", "99999999|8@1+", "0|999999999@1+", "7|80000@0+")
        ]
        + [
            (
                f'BO_ 1000 x: {length} ECU\n SG_ y : 0|8@1+ (1,0) [0|0] "" ECU',
                f"(`BO_ 1000 x:`) has {length} bytes; a message has 0 to 4095",
            )
            for length in (-8, -1, 4096, 99999999, 10**40)
        ],
    )
    def test_bits_and_lengths_outside_of_a_message_are_left_out_and_told(
        self, tmp_path: Path, statement: str, told: str
    ) -> None:
        dbc = f"{MOTOR}{statement}\n"
        found = read(write(tmp_path, "a.log", motor_lines(), dbc), MAP)
        assert values_of(found) == TORQUES
        (note,) = notes_of(found)
        assert f"line 8 {told}" in note

    @pytest.mark.parametrize("place", ["0|8@11e3-", "0|8@2+", "0|8@1", "0|8@"])
    def test_a_signal_without_its_byte_order_is_left_out(self, tmp_path: Path, place: str) -> None:
        dbc = MOTOR + f' SG_ x : {place} (1,0) [0|0] "" ECU\n'
        found = read(write(tmp_path, "a.log", motor_lines(), dbc), MAP)
        assert values_of(found) == TORQUES
        (note,) = notes_of(found)
        assert "line 8 (`SG_ x :`) does not state the order of its bytes and its sign" in note

    @pytest.mark.parametrize("length", [8, 24, 31])
    def test_a_floating_point_signal_of_a_wrong_size_is_refused(
        self, tmp_path: Path, length: int
    ) -> None:
        dbc = MOTOR + f' SG_ x : 0|{length}@1+ (1,0) [0|0] "" ECU\nSIG_VALTYPE_ 256 x : 1;\n'
        path = write(tmp_path, "a.log", motor_lines(), dbc)
        assert values_of(read(path, MAP)) == TORQUES
        text = told(path, column("x", "1"))
        assert f"the DBC calls it a floating-point number of {length} bits" in text

    @pytest.mark.parametrize("factor", ["1e308", "-1e308", "1" + "0" * 400])
    def test_a_value_that_no_float_holds_is_told(self, tmp_path: Path, factor: str) -> None:
        path = write(tmp_path, "a.log", motor_lines(), MOTOR.replace("0.25,0", f"{factor},0"))
        assert "is not a finite number" in told(path, MAP)


class TestMultiplexers:
    def test_a_long_name_of_a_multiplexer_still_selects(self, tmp_path: Path) -> None:
        long_name = "Index_that_is_longer_than_the_32_letters_of_a_name"
        dbc = INDEX.format(sign="+", value=1)
        dbc += 'BA_DEF_ SG_ "SystemSignalLongSymbol" STRING ;\n'
        dbc += f'BA_ "SystemSignalLongSymbol" SG_ 256 Index "{long_name}";\n'
        path = write(tmp_path, "a.log", selected_lines(1, 2, 1, 0), dbc)
        assert values_of(read(path, MAP)) == (0.0, 2.0)
        assert values_of(read(path, column(long_name, "1"))) == (1.0, 2.0, 1.0, 0.0)

    def test_a_long_name_of_a_message_counts(self, tmp_path: Path) -> None:
        dbc = MOTOR + 'BA_ "SystemMessageLongSymbol" BO_ 256 "Motor_of_the_rear_axle";\n'
        path = write(tmp_path, "a.log", motor_lines(), dbc)
        assert values_of(read(path, column("Motor_of_the_rear_axle.T_em"))) == TORQUES

    def test_a_value_counts_the_bits_of_a_signed_multiplexer(self, tmp_path: Path) -> None:
        dbc = INDEX.format(sign="-", value=128)
        path = write(tmp_path, "a.log", selected_lines(128, 2, 128), dbc)
        assert values_of(read(path, MAP)) == (0.0, 2.0)

    @pytest.mark.parametrize("mark", ["M :", "m :"])
    def test_without_a_multiplexer_the_signal_is_refused(self, tmp_path: Path, mark: str) -> None:
        dbc = INDEX.format(sign="+", value=1).replace("Index M :", f"Index {mark[1:]}")
        text = told(write(tmp_path, "a.log", selected_lines(1, 2), dbc), MAP)
        assert "error: signal `T_em` cannot be read" in text
        assert "help: a multiplexer has `M` behind its name in the DBC" in text

    def test_multiplexers_that_select_each_other_are_refused(self, tmp_path: Path) -> None:
        dbc = INDEX.format(sign="+", value=1).replace("Index M", "Index m2M")
        dbc = dbc.replace("T_em m1", "T_em m1M")
        dbc += "SG_MUL_VAL_ 256 T_em Index 1-1;\nSG_MUL_VAL_ 256 Index T_em 2-2;\n"
        text = told(write(tmp_path, "a.log", selected_lines(1, 2), dbc), MAP)
        assert "error: signal `T_em` cannot be read" in text


class TestDatabasesOfBuses:
    TWO = "dbc: {%s: car.dbc, %s: other.dbc}\ncolumns: {T_em: {column: '%s', to: T_em, unit: N*m}}"

    def write_two(self, folder: Path, name: str, text: str) -> Path:
        """Write a log and two databases that define its message differently."""
        (folder / "other.dbc").write_text(HEADER + MOTOR.replace("0.25", "0.5"), "utf-8")
        return write(folder, name, text)

    @pytest.mark.parametrize(("bus", "factor"), [("can0", 1), ("can1", 2)])
    def test_each_bus_has_its_database(self, tmp_path: Path, bus: str, factor: int) -> None:
        lines = motor_lines() + motor_lines("can1", 0.003)
        path = self.write_two(tmp_path, "a.log", lines)
        found = read(path, self.TWO % ("can0", "can1", f"{bus}.Motor.T_em"))
        assert values_of(found) == tuple(factor * value for value in TORQUES)
        text = told(path, self.TWO % ("can0", "can1", "T_em"))
        assert "names one of them: `can0.Motor.T_em`, `can1.Motor.T_em`" in text

    @pytest.mark.parametrize(("bus", "factor"), [("CAN1", 1), ("CAN2", 2)])
    def test_numbered_buses_of_asc_and_mf4(self, tmp_path: Path, bus: str, factor: int) -> None:
        data = frame(2.0).hex(" ")
        lines = [f"   {0.01 * k:.6f} {k % 2 + 1}  100  Rx   d 4 {data}" for k in range(4)]
        path = self.write_two(tmp_path, "a.asc", ASC + "\n".join(lines) + "\n")
        text = self.TWO % ("can1", "CAN2", f"{bus}.Motor.T_em")
        assert values_of(read(path, text)) == (2.0 * factor,) * 2
        path = TestBus().write_bus(tmp_path / "a.mf4", (1, 2))
        (tmp_path / "car.dbc").write_text(HEADER + MOTOR, "utf-8")
        found = values_of(read(path, text))
        assert found[0] == factor * values_of(read(path, self.TWO % (
            "CAN1", "CAN2", "CAN1.Motor.T_em"
        )))[0]  # fmt: skip

    def test_one_bus_may_have_several(self, tmp_path: Path) -> None:
        path = self.write_two(tmp_path, "a.log", motor_lines())
        (tmp_path / "more.dbc").write_text(HEADER + MOTOR.replace("256 Motor", "1 X"), "utf-8")
        text = self.TWO % ("can0", "can1", "T_em")
        found = read(path, text.replace("can0: car.dbc", "can0: [car.dbc, more.dbc]"))
        assert values_of(found) == TORQUES

    def test_a_bus_that_the_log_lacks_is_told(self, tmp_path: Path) -> None:
        path = self.write_two(tmp_path, "a.log", motor_lines())
        text = told(path, self.TWO % ("can4", "can5", "T_em"))
        assert "is not on the bus `can4`; the log has `can0`" in text


def test_the_command_line_names_a_database_for_each_bus(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from modewright.api.recordings import check_recordings

    monkeypatch.chdir(tmp_path)
    lines = motor_lines() + motor_lines("can1", 0.003)
    path = TestDatabasesOfBuses().write_two(tmp_path, "a.log", lines)
    checked = check_recordings([path], databases=["can0=car.dbc", "can1=other.dbc"])
    columns = checked.mapping.columns
    assert "can0.Motor.T_em" in columns
    assert "can1.Motor.T_em" in columns
