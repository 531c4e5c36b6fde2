"""An automaton without outputs runs: its run has times and no signals."""

from __future__ import annotations

from pathlib import Path

import pytest

from modewright.api.simulation import simulate

PLANT = """\
language: 1
automaton: silent
step: 1 ms
inputs: {u: {unit: m/s}}
states: {x: {unit: m, initial: 0 m}}
flow: {x: der(x) = u}
outputs: []
"""
PUSH = "language: 1\nscenario: push\nof: silent\nhorizon: 20 ms\ninputs: {u: 1 m/s}\n"


@pytest.mark.parametrize("every", ["", "record: {every: 5 ms}\n"])
def test_an_automaton_without_outputs_runs(tmp_path: Path, every: str) -> None:
    (tmp_path / "spec").mkdir()
    (tmp_path / "spec" / "silent.yaml").write_text(PLANT, "utf-8")
    (tmp_path / "spec" / "push.yaml").write_text(PUSH + every, "utf-8")
    run = simulate("silent", "push", root=tmp_path, compiled=False)
    assert len(run.times) > 1 and not run.signals
