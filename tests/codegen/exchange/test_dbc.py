"""DBC: every value has its bits of C on the bus, and tools read what it means."""

from __future__ import annotations

import struct
from pathlib import Path

import cantools
import pytest
from cantools.database import Database

from codegen.exchange.dbc import emit_dbc
from language.ir.printer import digest
from language.ir.program import unqualified_name
from modewright.api.simulation import program
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from tests.language.spec_builders import program as made

PERIODS = {"contactor": 10, "supervisor": 10, "estimator": 1, "estimator_float32": 1}
"""What the specs say [ms]."""
WIDE = """\
language: 1
automaton: wide
about: 'it says "no" at 90 °C'
period: 250 us
numbers: float64
inputs: {COUNTED}
modes: {run: {}}
equations: {z: u_0}
outputs: [z]
"""


def read(text: str) -> Database:
    found = cantools.database.load_string(text, "dbc")
    assert isinstance(found, Database)
    return found


@pytest.mark.parametrize("is_fd", [False, True])
@pytest.mark.parametrize("name", ["contactor", "supervisor", "estimator", "estimator_float32"])
def test_all_that_is_received_and_sent_is_there(name: str, is_fd: bool) -> None:
    used = program(name)
    known = read(emit_dbc(used, {}, is_fd=is_fd))
    received = [s for m in known.messages if m.senders != [name] for s in m.signals]
    sent = [s for m in known.messages if m.senders == [name] for s in m.signals]
    assert [s.name for s in received] == [unqualified_name(v.name) for v in used.inputs]
    assert [s.name for s in sent] == [wire.name for wire in used.outputs]
    assert all(s.receivers == [name] for s in received)
    assert known.version == digest(used)
    assert [m.frame_id for m in known.messages] == [0x100 + k for k in range(len(known.messages))]
    assert all(m.length <= (64 if is_fd else 8) for m in known.messages)
    assert {m.is_fd for m in known.messages} == {is_fd}
    assert {m.cycle_time for m in known.messages} == {PERIODS[name]}


@pytest.mark.parametrize("is_fd", [False, True])
def test_values_have_the_bits_that_they_have_in_c(is_fd: bool) -> None:
    known = read(emit_dbc(program("supervisor"), {}, is_fd=is_fd))
    values = {"key": 2, "U_dc": 0.1, "U_pack": -1e-40, "T_req": 3.5, "v": 0.0, "temp": 293.15}
    values |= {"hv_ok": 1, "clear": 0}
    frames = [m for m in known.messages if m.senders != ["supervisor"]]
    data = b""
    for message in frames:
        own = {s.name: values[s.name] for s in message.signals}
        frame = message.encode(own, strict=False)
        assert len(frame) == message.length
        data += frame
    singles = [values[name] for name in ("U_dc", "U_pack", "T_req", "v", "temp")]
    assert data.rstrip(b"\0") == struct.pack("<B5fB", values["key"], *singles, 1)


def test_words_units_and_ranges_are_told() -> None:
    known = read(emit_dbc(program("supervisor"), {"U_dc": (0.0, 500.0)}))
    signals = {s.name: s for m in known.messages for s in m.signals}
    assert {k: str(v) for k, v in (signals["key"].choices or {}).items()} == {
        0: "parked", 1: "ignition", 2: "crank",
    }  # fmt: skip
    assert (signals["U_dc"].unit, signals["T_cmd"].unit) == ("V", "N*m")
    assert (signals["U_dc"].minimum, signals["U_dc"].maximum) == (0.0, 500.0)
    assert signals["mode"].is_signed
    assert (1, "operation.precharge") in [
        (k, str(v)) for k, v in (signals["mode"].choices or {}).items()
    ]


@pytest.mark.parametrize(("period", "cycle"), [("250 us", None), ("1.5 ms", None), ("20 ms", 20)])
def test_a_cycle_is_told_where_it_is_one_of_milliseconds(period: str, cycle: int | None) -> None:
    text = WIDE.replace("COUNTED", "u_0: {unit: 1}").replace("250 us", period)
    assert {m.cycle_time for m in read(emit_dbc(made(text), {})).messages} == {cycle}


def test_frames_are_filled_in_turn_and_identifiers_end() -> None:
    counted = ", ".join(f"u_{k}: {{unit: 1}}" for k in range(9))
    used = made(WIDE.replace("COUNTED", counted))
    known = read(emit_dbc(used, {}, first=0x7F8, is_fd=True))
    assert [m.name for m in known.messages] == ["wide_In_1", "wide_In_2", "wide_Out"]
    assert [m.length for m in known.messages] == [64, 8, 8]
    known = read(emit_dbc(used, {}, first=0x7FA))
    assert [m.is_extended_frame for m in known.messages] == [False] * 6 + [True] * 4
    for first in (-1, 0x1FFFFFF7):
        with pytest.raises(ValueError, match="is no identifier of a CAN frame"):
            emit_dbc(used, {}, first=first)


def test_the_command_writes_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "supervisor.dbc"
    words = ["dbc", "supervisor", "--first", "0x320", "--fd", "--out", str(out)]
    assert run_with_exit_code(lambda: app(words, standalone_mode=False)) == 0
    assert [m.frame_id for m in read(out.read_text()).messages] == [0x320, 0x321]
    before = out.read_bytes()
    words[3] = "none"
    assert run_with_exit_code(lambda: app(words, standalone_mode=False)) == 2
    assert "--first" in capsys.readouterr().err and out.read_bytes() == before
