"""Oracle of DBC files: its rules by examples worked out by hand, and the product against it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.public.dbc_oracle import OracleSignal, parse_dbc
from tests.public.read_file import Outcome, read_file

DBC = """\
VERSION ""
BS_:
BU_: ECU
CM_ "a comment; BO_ 1 Not: 8 ECU
 SG_ here : 0|8@1+ (1,0) [0|0] "" ECU";
BO_ 256 Motor: 8 ECU
 SG_ T_em : 0|16@1- (0.25,-10) [0|0] "Nm" ECU
 SG_ n_em : 23|12@0+ (2,0) [0|0] "rpm" ECU
 SG_ big : 39|16@0- (1,0) [0|0] "" ECU
 SG_ flag : 63|1@1+ (1,0) [0|0] "" ECU
BO_ 2566844926 CCVS: 8 ECU
 SG_ Index M : 0|4@1+ (1,0) [0|0] "" ECU
 SG_ speed m3 : 8|32@1- (1,0) [0|0] "km/h" ECU
 SG_ Sub m5M : 8|4@1+ (1,0) [0|0] "" ECU
 SG_ deep m1 : 16|8@1- (1,0) [0|0] "" ECU
 SG_ range m2 : 40|8@1+ (1,0) [0|0] "" ECU
SIG_VALTYPE_ 2566844926 speed : 1;
SG_MUL_VAL_ 2566844926 deep Sub 1-2, 7-7;
SG_MUL_VAL_ 2566844926 range Index 8-9;
VAL_ 256 flag 0 "off" 1 "on" ;
"""
"""A database with both byte orders, nested multiplexers and a floating-point signal."""


def signal_of(start: int, length: int, is_little_endian: bool, is_signed: bool) -> OracleSignal:
    return OracleSignal("s", start, length, is_little_endian, is_signed, 1.0, 0.0, "")


@pytest.mark.parametrize(
    ("start", "length", "is_little_endian", "is_signed", "data", "value"),
    [
        (0, 8, True, False, "FF", 255),
        (0, 8, True, True, "FF", -1),
        (4, 8, True, False, "F00A", 0xAF),
        (0, 16, True, True, "0080", -32768),
        (7, 8, False, False, "A5", 0xA5),
        (7, 16, False, False, "1234", 0x1234),
        (3, 8, False, False, "1234", 0x23),
        (7, 12, False, True, "8000", -2048),
        (0, 2, False, False, "0180", 3),
    ],
)
def test_bits_by_hand(
    start: int, length: int, is_little_endian: bool, is_signed: bool, data: str, value: int
) -> None:
    signal = signal_of(start, length, is_little_endian, is_signed)
    assert signal.integer(bytes.fromhex(data)) == value


def test_a_written_number_is_read() -> None:
    for is_little_endian, start in ((True, 5), (False, 2)):
        signal = signal_of(start, 11, is_little_endian, False)
        data = bytearray(b"\xff" * 8)
        signal.write(data, 0x2A5)
        assert signal.raw(bytes(data)) == 0x2A5


def test_statements_by_hand() -> None:
    motor, speed = parse_dbc(DBC)
    assert (motor.name, motor.identifier, motor.is_extended, motor.size) == ("Motor", 256, False, 8)
    assert [signal.name for signal in motor.signals] == ["T_em", "n_em", "big", "flag"]
    data = bytes.fromhex("3000 7D10 8000 0080")
    torque, rate, big, flag = motor.signals
    assert (torque.value(data), torque.unit) == (0x30 * 0.25 - 10, "Nm")
    assert rate.value(data) == 2 * 0x7D1
    assert (big.value(data), flag.value(data), flag.words) == (-32768.0, 1.0, {0: "off", 1: "on"})
    assert (speed.identifier, speed.is_extended) == (0x18FEF1FE, True)
    frames = {"03" + "0000C03F" + "00" * 3: {"Index", "speed"}, "050100FF" + "00" * 4: {
        "Index", "Sub", "deep"}, "05" + "03" + "00" * 6: {"Index", "Sub"},
        "0900000000" + "FF0000": {"Index", "range"}}  # fmt: skip
    for text, names in frames.items():
        found = {s.name for s in speed.signals if speed.is_present(s, bytes.fromhex(text))}
        assert found == names
    assert speed.signals[1].value(bytes.fromhex("03" + "0000C03F" + "00" * 3)) == 1.5


def test_the_product_decodes_as_the_oracle(tmp_path: Path) -> None:
    path = tmp_path / "car.dbc"
    path.write_text(DBC, "utf-8")
    assert read_file(path) == Outcome("read", 9)


def test_a_wrong_decoder_would_differ(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "car.dbc"
    path.write_text(DBC, "utf-8")
    monkeypatch.setattr(OracleSignal, "value", lambda self, data: float(self.raw(data)))
    assert read_file(path).text == "differs: Motor.T_em"


def test_a_refusal_is_the_outcome(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_text("no frame\n", "utf-8")
    assert read_file(path).text.startswith("this is no log of CAN frames: `no frame`")
