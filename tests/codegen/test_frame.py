"""Functions that are not put into each other: less of the stack of an ECU is open at once."""

from __future__ import annotations

import pytest

from codegen.frame import apart
from codegen.source import c_files, c_program
from modewright.api import program


def test_what_computes_much_has_a_frame_of_its_own() -> None:
    found = apart(c_program(program("estimator")))
    assert {"predict_drive", "half_no_contact", "series_coast_contact", "point"} <= found
    assert "rates_drive_contact" not in found, "pull_drive_contact alone runs it, and is apart"
    assert not found & {"run_gap", "latch", "remember"}


@pytest.mark.parametrize("name", ["estimator_float32", "driveline"])
def test_float32_and_continuous_automata_stay_as_they_are(name: str) -> None:
    assert apart(c_program(program(name))) == frozenset()
    assert "NOT_INLINED" not in c_files(program(name))[f"{name}.c"]
