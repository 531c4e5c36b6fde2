"""Twins by hand do what generated C does, bit for bit, here and on the target."""

from __future__ import annotations

import math
import shutil
import struct
from fractions import Fraction
from pathlib import Path

import pytest

from codegen.toolchain.external_tools import ARM_COMPILER, EMULATOR
from codegen.toolchain.target_machine import CORTEX_M4F, HOST, MACHINES
from lockstep.tick_log import TickLog
from tests.codegen.hand_written_c.timing_comparison import HERE, duel
from tests.codegen.target.closed_loop import record_driveline

NEEDS = pytest.mark.skipif(
    not (shutil.which(ARM_COMPILER) and shutil.which(EMULATOR)),
    reason="no compiler for ARM, no emulator: make system-packages",
)
TWINS = {"est": ("estimator", Fraction(3)), "plant": ("plant", Fraction(1))}


@pytest.fixture(scope="module", params=TWINS)
def pair(request: pytest.FixtureRequest) -> tuple[TickLog, str]:
    twin, horizon = TWINS[request.param]
    return record_driveline("float32", horizon, [request.param])[request.param], twin


@pytest.mark.long
@pytest.mark.parametrize("machine", [HOST.name, pytest.param(CORTEX_M4F.name, marks=NEEDS)])
def test_a_twin_has_the_same_bits(pair: tuple[TickLog, str], machine: str) -> None:
    tape, twin = pair
    found = duel(tape, twin, 1, MACHINES[machine])
    assert tape.transitions > 5
    assert found.steps == len(tape.inputs) > 2000
    assert found.differing == 0


def test_an_input_that_is_no_number_is_held_by_both() -> None:
    tape = record_driveline("float32", Fraction(1), ["est"])["est"]
    size = struct.calcsize("<d")
    for tick in (100, 101, 500):
        tape.inputs[tick] = struct.pack("<d", math.nan) + tape.inputs[tick][size:]
    tape.inputs[700] = struct.pack("<d", -math.inf) + tape.inputs[700][size:]
    assert duel(tape, "estimator", 1).differing == 0


def test_a_twin_of_another_plant_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for path in HERE.glob("*.[ch]"):
        text = path.read_text().replace("twin_page = {0.05F}", "twin_page = {0.0500001F}")
        (tmp_path / path.name).write_text(text)
    monkeypatch.setattr("tests.codegen.hand_written_c.timing_comparison.HERE", tmp_path)
    tape = record_driveline("float32", Fraction(1, 2), ["plant"])["plant"]
    assert duel(tape, "plant", 1).differing > 100
