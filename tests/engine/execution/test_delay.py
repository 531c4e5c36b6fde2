"""Delays of a continuous automaton: a delay equation against its closed form, and its order."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

import modewright as mw

SPEC = """language: 1
automaton: ages
step: {step} ms
states: {{x: {{unit: "1", initial: 1}}}}
flow: {{x: "der(x) = -1 1/s * delay(x, {delay})"}}
modes: {{only: {{}}}}
outputs: [x, mode]
"""
RIG = """language: 1
system: rig
instances: {a: {of: ages}}
outputs: {x: a.x}
"""
RUN = """language: 1
scenario: run
of: rig
horizon: 3 s
record: {every: 0.125 s}
"""


def exact(time: float) -> float:
    """Return x of dx/dt = -x(t - 1), x = 1 before 0, by the method of steps (Bellman 1963)."""
    found = 1.0 - time
    if time > 1.0:
        found += (time - 1.0) ** 2 / 2.0
    if time > 2.0:
        found -= (time - 2.0) ** 3 / 6.0
    return found


def worst(folder: Path, step: float, delay: str = "1 s") -> float:
    (folder / "spec").mkdir(exist_ok=True)
    texts = {"ages": SPEC.format(step=step, delay=delay), "rig": RIG, "run": RUN}
    for name, text in texts.items():
        (folder / "spec" / f"{name}.yaml").write_text(text)
    found = mw.simulate("rig", "run", root=folder)
    assert found.stopped is None
    return max(
        abs(float(x) - exact(time))
        for time, x in zip(found.times, found.signals["a.x"], strict=True)
    )


def test_a_delay_equation_has_the_order_of_its_interpolation(tmp_path: Path) -> None:
    """Linear between major steps: halving them divides the error by four."""
    errors = [worst(tmp_path, step) for step in (50.0, 25.0, 12.5)]
    assert errors[0] < 5e-4
    for coarse, fine in itertools.pairwise(errors):
        assert coarse / fine == pytest.approx(4.0, rel=0.05)


def test_a_delay_between_major_steps_is_as_near(tmp_path: Path) -> None:
    assert worst(tmp_path, 30.0) < 3e-4
