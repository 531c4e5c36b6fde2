"""The value analysis: with which counts its steps begin."""

from __future__ import annotations

from codegen.passes.pass_list import run_c_passes
from codegen.proofs.eva import counter_limits
from modewright.api.simulation import program


def test_the_value_analysis_begins_with_any_counts() -> None:
    counts = counter_limits(run_c_passes(program("hko"), by_magnitude=False))
    assert counts["timer.gap_drive_fast"] == 6 and counts["timer.after_1"] == 60
    assert counts["memory.oldest_2"] == 49 and counts["memory.newest"] == 2
    assert counter_limits(run_c_passes(program("supervisor"))) == {}, "it runs no model"
