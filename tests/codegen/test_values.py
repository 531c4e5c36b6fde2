"""The value analysis: with which counts its steps begin."""

from __future__ import annotations

from codegen.proofs.values import step_counts
from codegen.source import c_program
from modewright.api import program


def test_the_value_analysis_begins_with_any_counts() -> None:
    counts = step_counts(c_program(program("hko"), by_amount=False))
    assert counts["timer.gap_drive_fast"] == 6 and counts["timer.after_1"] == 60
    assert counts["memory.oldest_2"] == 49 and counts["memory.newest"] == 2
    assert step_counts(c_program(program("supervisor"))) == {}, "it runs no model"
