"""Exponential: exact for affine flows, of second order for the rest, against closed forms."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from engine.interpreter.interpreter import Interpreter
from tests.language.continuous_model import Flow
from tests.language.spec_builders import solve_constants

EXACT = 1e-13
"""Relative: some ten roundings of 1.1e-16 a tick, over at most fifty ticks."""


W, Z = 3.0, 0.15
PARAMETERS = f"w0: {{value: {W} 1/s}}, zeta: {{value: {Z}}}"
SWING = "x: der(x) = v * 1 1/s, v: der(v) = -w0^2 * 1 s * x - 2 * zeta * w0 * v + u * 1"


def swing(folder: Path) -> Flow:
    return Flow(folder, SWING, {"x": 1.0, "v": 0.5}, parameters=PARAMETERS)


def swung(t: float, u: float = 0.0) -> tuple[float, float]:
    """Return x, v of x'' + 2 zeta w0 x' + w0^2 x = u, from x = 1, v = 0.5 (any textbook)."""
    rest, decay, turn = u / W**2, Z * W, W * math.sqrt(1 - Z * Z)
    a, b = 1 - rest, (0.5 + decay * (1 - rest)) / turn
    c, s = math.cos(turn * t), math.sin(turn * t)
    x = math.exp(-decay * t) * (a * c + b * s)
    v = -decay * x + math.exp(-decay * t) * turn * (b * c - a * s)
    return rest + x, v


@pytest.mark.parametrize("u", [0.0, 2.5])
@pytest.mark.parametrize(("period", "count"), [("0.1 s", 50), ("0.25 s", 20), ("10 ms", 50)])
def test_a_damped_swing_is_exact(tmp_path: Path, period: str, count: int, u: float) -> None:
    found = swing(tmp_path).run_ticks(count, u, period=period)
    t = count * float(period.split()[0]) / (1000 if "ms" in period else 1)
    x, v = swung(t, u)
    scale = W * max(1.0, u)
    assert found["x"] == pytest.approx(x, rel=0, abs=EXACT * scale)
    assert found["v"] == pytest.approx(v, rel=0, abs=EXACT * scale)


def test_a_decay_and_a_ramp_are_exact(tmp_path: Path) -> None:
    flow = "x: der(x) = -2 1/s * x, z: der(z) = 3 1/s * z, q: der(q) = 0.5 1/s * x + u"
    start = {"x": 1.0, "z": 1.0, "q": 0.0}
    found = Flow(tmp_path, flow, start, widths={"z": 300}).run_ticks(8, 0.75, period="0.2 s")
    t = 8 * 0.2
    expected = {
        "x": math.exp(-2 * t),
        "z": math.exp(3 * t),
        "q": 0.25 * (1 - math.exp(-2 * t)) + 0.75 * t,
    }
    assert found == pytest.approx(expected, rel=EXACT)


def test_two_half_steps_are_a_whole_one(tmp_path: Path) -> None:
    """E = Eh^2, F = (I + Eh) Fh: what the step to the middle is made of, seen by no affine flow."""
    pulled = SWING.replace("v * 1 1/s", "v * 1 1/s + u * 1")
    flow = Flow(tmp_path, pulled, {"x": 1.0, "v": 0.5}, parameters=PARAMETERS)
    numbers = solve_constants(flow.program(period="0.4 s"))

    def of(letter: str) -> NDArray[np.float64]:
        names = [[f"solved.one_{letter}.{row}.{column}" for column in "xv"] for row in "xv"]
        return np.array([[numbers[name] for name in row] for row in names])

    assert np.allclose(of("Eh") @ of("Eh"), of("E"), rtol=EXACT, atol=0)
    assert np.allclose((np.eye(2) + of("Eh")) @ of("Fh"), of("F"), rtol=EXACT, atol=0)


def test_a_state_that_follows_from_others_alone_is_not_pulled(tmp_path: Path) -> None:
    """x' = v is its row of A: nothing else moves it, so that F has no column for it."""
    numbers = solve_constants(swing(tmp_path).program(period="0.4 s"))
    assert "solved.one_F.x.v" in numbers
    assert not [name for name in numbers if re.fullmatch(r"solved\.one_Fh?\.\w\.x", name)]


def test_substeps_change_nothing_for_an_affine_flow(tmp_path: Path) -> None:
    flow = swing(tmp_path)
    whole, parts = (flow.run_ticks(10, 1.0, period="0.3 s", substeps=n) for n in (1, 7))
    assert parts == pytest.approx(whole, rel=0, abs=EXACT * W)


@pytest.mark.parametrize("fraction", [1e-6, 0.1, 0.37, 0.5, 0.99])
def test_a_part_of_a_step_is_exact_too(tmp_path: Path, fraction: float) -> None:
    """The Taylor sum that goes on after an event, against the same closed form."""
    inside = Interpreter(swing(tmp_path).program(period="0.4 s"))
    inside.run("step")
    inside.set("before.u", 2.5)
    inside.set("work.h", 0.4 * fraction)
    inside.run("step_one")
    x, v = swung(0.4 * fraction, 2.5)
    assert inside.get("work.end_x") == pytest.approx(x, rel=0, abs=EXACT * W)
    assert inside.get("work.end_v") == pytest.approx(v, rel=0, abs=EXACT * W)


def test_the_polynomial_follows_the_flow_inside_the_step(tmp_path: Path) -> None:
    leave = "never: {to: one, when: x < -9, reset: {x: 0}}"
    flow = Flow(tmp_path, SWING, {"x": 1.0, "v": 0.5}, parameters=PARAMETERS, leave=leave)
    inside = Interpreter(flow.program(period="0.4 s"))
    inside.run("step")
    inside.set("work.h", 0.4)
    inside.run("step_one")
    inside.run("series_one")
    for s in (0.0, 0.05, 0.2, 0.399, 0.4):
        inside.set("work.s", s)
        inside.run("point")
        assert inside.get("work.at_x") == pytest.approx(swung(s)[0], rel=0, abs=EXACT * W)


def test_the_flow_goes_on_in_the_mode_that_an_event_leads_to(tmp_path: Path) -> None:
    """x falls with 2/s to 0.3, then rises with 1/s; the event is located to T/2^24."""
    made = Flow(
        tmp_path,
        "x: der(x) = -2 1/s * x",
        {"x": 1.0},
        leave="two: {when: x <= 0.3}",
        other="x: der(x) = 1 1/s * x",
    )
    turn = math.log(1 / 0.3) / 2
    for count in (1, 2, 3):
        after = 0.4 * count - turn
        expected = 0.3 * math.exp(after) if after > 0 else math.exp(-0.8 * count)
        located = 0.4 / 2**24 * 3
        found = made.run_ticks(count, period="0.4 s")["x"]
        assert found == pytest.approx(expected, rel=located)


def orders(error: Callable[[int], float], counts: tuple[int, ...]) -> list[float]:
    errors = [error(count) for count in counts]
    return [math.log2(a / b) for a, b in itertools.pairwise(errors)]


def test_a_rest_that_is_not_linear_is_of_second_order(tmp_path: Path) -> None:
    """Bernoulli 1695: x' = -2 x + 3 x^2 has 1/x = 3/2 + (1/x0 - 3/2) e^(2 t)."""
    made = Flow(tmp_path, "x: der(x) = -2 1/s * x + 3 1/s * x^2", {"x": 0.5})
    exact = 1 / (1.5 + (1 / 0.5 - 1.5) * math.exp(2.0))

    def error(substeps: int) -> float:
        return abs(made.run_ticks(1, substeps=substeps)["x"] - exact)

    for order in orders(error, (8, 16, 32, 64)):
        assert 1.9 < order < 2.1


def test_a_stiff_linear_part_does_not_spoil_the_order(tmp_path: Path) -> None:
    """z relaxes fifty times faster than x bends; z' = -50 (z - x), x' = -x^2, x = 1/(1 + t)."""
    flow = "x: der(x) = -1 1/s * x^2, z: der(z) = -50 1/s * (z - x)"
    made = Flow(tmp_path, flow, {"x": 1.0, "z": 1.0})

    def error(substeps: int) -> float:
        return abs(made.run_ticks(1, substeps=substeps)["x"] - 0.5)

    for order in orders(error, (32, 64)):
        assert 1.9 < order < 2.1


def test_an_input_is_held_over_the_tick(tmp_path: Path) -> None:
    inside = Interpreter(Flow(tmp_path, "x: der(x) = u", {"x": 0.0}).program(period="0.5 s"))
    for u, x in ((1.0, 0.0), (2.0, 0.5), (0.0, 1.5), (4.0, 1.5)):
        inside.set("input.u", u)
        inside.run("step")
        assert inside.get("state.x") == x
