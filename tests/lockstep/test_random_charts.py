"""Random charts through the whole front end: interpreter and compiled C agree on every bit."""

from __future__ import annotations

from pathlib import Path

from tests.validation.evidence.random_charts import measure_part, programs

COUNT, TICKS = 6, 150


def test_random_charts_are_in_lockstep_and_do_what_the_rules_are_about(tmp_path: Path) -> None:
    """`make verify` has 300 of 500 ticks, and asks for each of the rules 20 times."""
    found = measure_part(programs(range(COUNT), tmp_path), tmp_path, TICKS)
    assert found["bits"]["differing"] == 0
    assert found["bits"]["ticks"] == COUNT * TICKS
    assert found["bits"]["moving"] == COUNT
    assert sum(count > 0 for count in found["hits"].values()) > len(found["hits"]) * 0.8
