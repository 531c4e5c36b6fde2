"""Which signals of a run are piecewise constant, with the interpreter and with compiled C."""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw

PLANT = """language: 1
automaton: tank
parameters: {a: {value: 2 1/s}}
inputs: {u: {unit: m/s}}
states: {x: {unit: m, initial: 0 m}}
flow: {x: der(x) = u - a * x}
outputs: [x]
"""
CONTROLLER = """language: 1
automaton: valve
period: 10 ms
numbers: float64
inputs: {level: {unit: m}}
equations: {u: (1 m - level) * 1 1/s}
outputs: [u]
"""
SYSTEM = """language: 1
system: rig
instances: {p: {of: tank}, c: {of: valve}}
sensors: {s: {of: p.x, sample: 5 ms}, direct: {of: p.x}}
connections: {p.u: c.u, c.level: s}
outputs: {twice: 2 * c.u, both: c.u * 1 s + p.x, copy: c.u}
"""
SCENARIO = """language: 1
scenario: run
of: rig
horizon: 50 ms
record: {every: 1 ms, signals: [p.x, c.u, s, direct, twice, both, copy]}
"""


@pytest.mark.parametrize("compiled", [False, True], ids=["interpreted", "compiled"])
def test_signals_of_a_system(
    compiled: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "spec").mkdir()
    texts = {"tank": PLANT, "valve": CONTROLLER, "rig": SYSTEM, "run": SCENARIO}
    for name, text in texts.items():
        (tmp_path / "spec" / f"{name}.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    run = mw.simulate("rig", "run", compiled=compiled)
    assert run.piecewise_constant == {"c.u", "s", "twice", "copy"}
