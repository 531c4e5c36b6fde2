"""Faults: the word and its bits, as tests expect them, on the engine and in C; derived by hand.

`U` leaves its range from 30 ms to 50 ms: bit 0, `sensor`, stays. `T` does at 60 ms: bit 1.
"""

from __future__ import annotations

from pathlib import Path

from modewright.api import spec_tests as tests

CHARGER = Path(__file__).parent.parent / "data" / "charts" / "charger.yaml"
HEAD = """\
language: 1
test: charger_faults
scenario:
  of: charger
  horizon: 100 ms
  inputs:
    plugged: true
    U: {start: 1 V, steps: {30 ms: 501 V, 50 ms: 1 V}}
    T: {start: 280 K, steps: {60 ms: 401 K, 70 ms: 280 K}}
  record: {every: 10 ms}
expect:
"""
RIGHT = """\
  none:   {always: faults < 1, until: 20 ms}
  word:   {that: charger.faults == 1, at: 30 ms}
  both:   {that: faults == 3, at: 60 ms}
  bit:    {that: fault(sensor), at: 30 ms, within: 10 ms}
  named:  {that: fault(charger.range_T), before: 60 ms}
  stays:  {always: fault(sensor), from: 30 ms}
  apart:  {that: fault(sensor) and not fault(range_T), at: 50 ms}
  often:  {always: count(fault(sensor)) <= 1}
"""
WRONG = """\
  early:  {that: fault(sensor), at: 20 ms}
  never:  {never: fault(range_T)}
  word:   {always: faults < 1}
"""


def run(folder: Path, expectations: str, compiled: bool) -> tests.TestRun:
    (folder / "spec").mkdir()
    (folder / "spec" / "charger.yaml").write_text(CHARGER.read_text())
    path = folder / "spec" / "charger_faults.yaml"
    path.write_text(HEAD + expectations)
    (found,) = tests.run_tests([str(path)], folder, compiled=compiled)
    return found


def test_the_word_and_its_bits_are_expected_on_engine_and_c(tmp_path: Path) -> None:
    found = run(tmp_path, RIGHT, compiled=True)
    assert [(each.name, each.message) for each in found.outcomes if not each.passed] == []
    assert (found.difference, len(found.outcomes)) == ("", 8) and found.backend.startswith(
        "compiled"
    )


def test_a_fault_that_is_not_expected_fails_at_its_tick(tmp_path: Path) -> None:
    found = run(tmp_path, WRONG, compiled=False)
    assert [(each.passed, each.time) for each in found.outcomes] == [
        (False, 0.02),
        (False, 0.06),
        (False, 0.03),
    ]
    assert found.outcomes[1].values == {"charger.faults": 3}
    assert found.outcomes[1].modes == {
        "charger.charge": "session.cv",
        "charger.thermal": "cooling.pump",
    }
