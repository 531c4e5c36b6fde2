"""RK4: order four at the ends, in between and in located crossings, measured through the engine."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from fractions import Fraction

import pytest

from engine.interpreter.interpreter import Interpreter
from engine.results.trajectory import Trajectory
from engine.simulation.simulate import simulate
from language.integration.rk4 import TERMS
from language.model.system import Instance, Scenario, System
from tests.language.spec_builders import NOWHERE, automaton, program, stepper

LOGISTIC = """language: 1
automaton: logistic
step: {step}
parameters: {{k: {{value: 3 1/s}}, top: {{value: {top}}}}}
states: {{x: {{unit: "1", initial: 0.05}}}}
flow: {{x: der(x) = k * x * (1 - x)}}
initial: below
modes:
  below: {{transitions: {{above: {{when: x > top}}}}}}
  above: {{}}
outputs: [x]
"""
"""Verhulst 1838: x = 1/(1 + (1/x0 - 1) e^(-k t))."""
K, X0 = 3.0, 0.05

TURNING = """language: 1
automaton: turning
step: {step}
parameters: {{w0: {{value: 2 1/s}}}}
states: {{x: {{unit: "1", initial: 1}}, z: {{unit: "1", initial: 0}}}}
flow: {{x: der(x) = w0 * z * (x^2 + z^2), z: der(z) = -w0 * x * (x^2 + z^2)}}
modes: {{only: {{transitions: {{never: {{to: only, when: x > 2, reset: {{x: 0}}}}}}}}}}
outputs: [x, z]
"""
"""A circle: x = cos(w0 t), z = -sin(w0 t), for x^2 + z^2 = 1 stays."""


def logistic(t: float) -> float:
    return 1 / (1 + (1 / X0 - 1) * math.exp(-K * t))


def reached(top: float) -> float:
    """Return the time at which the logistic curve reaches `top`."""
    return math.log((1 / X0 - 1) / (1 / top - 1)) / K


def flown(text: str, horizon: int = 1) -> Trajectory:
    """Return an automaton's trajectory with its values at time 0 and at the horizon [s]."""
    made, end = automaton(text), Fraction(horizon)
    one = Instance("one", made, Fraction(0), "", NOWHERE)
    system = System("alone", {}, {"one": one}, {}, {}, ("one",), NOWHERE)
    return simulate(system, Scenario("run", "alone", end, {}, {}, end, NOWHERE))


def final(run: Trajectory, name: str = "x") -> float:
    return float(run.signals[f"one.{name}"][-1])


def orders(error: Callable[[int], float], counts: tuple[int, ...]) -> list[float]:
    """Return log2 of what the error shrinks by from each number of steps to its double."""
    errors = [error(count) for count in counts]
    return [math.log2(a / b) for a, b in itertools.pairwise(errors)]


def test_the_end_is_of_order_four() -> None:
    def error(steps: int) -> float:
        text = LOGISTIC.format(step=f"{1 / steps} s", top=2)
        return abs(final(flown(text)) - logistic(1.0))

    for order in orders(error, (16, 32, 64, 128)):
        assert 3.8 < order < 4.2


def test_two_states_turn_with_order_four() -> None:
    def error(steps: int) -> float:
        run = flown(TURNING.format(step=f"{1 / steps} s"))
        return math.hypot(final(run) - math.cos(2), final(run, "z") + math.sin(2))

    for order in orders(error, (16, 32, 64)):
        assert 3.8 < order < 4.3


def test_a_polynomial_of_third_degree_in_time_is_exact() -> None:
    text = """language: 1
automaton: cubic
step: 0.5 s
states: {t: {unit: s, initial: 0 s}, x: {unit: m, initial: 0 m}}
flow: {t: der(t) = 1, x: der(x) = 4 m/s^4 * t^3 - 3 m/s^3 * t^2}
modes: {only: {}}
outputs: [x]
"""
    assert final(flown(text, 2)) == pytest.approx(2.0**4 - 2.0**3, rel=1e-14)


def prepared(text: str, h: float) -> Interpreter:
    """Return an automaton at its start that has taken one step, with its polynomial."""
    inside = stepper(text)
    inside.run("start")
    inside.set("work.h", h)
    inside.run("step_only")
    inside.run("series_only")
    return inside


def between(inside: Interpreter, s: float, name: str) -> float:
    inside.set("work.s", s)
    inside.run("point")
    return float(inside.get(f"work.at_{name}"))


H = 0.125


def test_the_polynomial_meets_both_ends() -> None:
    inside = prepared(TURNING.format(step="1 s"), H)
    for name in ("x", "z"):
        assert between(inside, 0.0, name) == inside.get(f"state.{name}")
        assert between(inside, H, name) == pytest.approx(
            inside.get(f"work.end_{name}"), rel=0, abs=4e-16
        )


def test_the_polynomial_has_the_rates_of_both_ends() -> None:
    inside = prepared(TURNING.format(step="1 s"), H)
    for name in ("x", "z"):
        d0, d1, d2 = inside.get(f"work.series_{name}")
        at_end = d0 + 2 * H * d1 + 3 * H * H * d2
        for place, slope in (("state", d0), ("work.end", at_end)):
            mark = "." if place == "state" else "_"
            x, z = (float(inside.get(f"{place}{mark}{other}")) for other in ("x", "z"))
            size = x * x + z * z
            rate = 2 * z * size if name == "x" else -2 * x * size
            assert slope == pytest.approx(rate, rel=1e-13, abs=1e-14)


def test_the_polynomial_is_a_cubic() -> None:
    made = program(TURNING.format(step="1 s"))
    sizes = {v.name: v.size for v in made.variables if v.name.startswith("work.series_")}
    assert sizes == {"work.series_x": TERMS, "work.series_z": TERMS}
    assert TERMS == 3


def test_a_cubic_flow_is_followed_exactly_in_between() -> None:
    text = """language: 1
automaton: cubic
states: {t: {unit: s, initial: 0 s}, x: {unit: m, initial: 1 m}}
flow: {t: der(t) = 1, x: der(x) = 3 m/s^3 * t^2 - 1 m/s}
modes: {only: {transitions: {never: {to: only, when: x > 9 m, reset: {x: 0 m}}}}}
"""
    inside = prepared(text, H)
    for s in (0.01, 0.03, 0.0625, 0.11):
        assert between(inside, s, "x") == pytest.approx(1 + s**3 - s, rel=1e-15)


def test_in_between_it_is_of_order_four() -> None:
    """The error of a cubic through ends and slopes is h^4/384 of the fourth derivative, 2^4."""

    def error(steps: int) -> float:
        h = 1 / steps
        inside = prepared(TURNING.format(step="1 s"), h)
        points = [h * k / 16 for k in range(17)]
        return max(abs(between(inside, s, "x") - math.cos(2 * s)) for s in points)

    assert error(128) == pytest.approx(2**4 / 384 / 128**4, rel=0.02)
    for order in orders(error, (32, 64, 128)):
        assert 3.8 < order < 4.2


ONE_INSTANT = 1e-9
"""Of a major step: a crossing is committed that little after it, with what else crosses there."""
TOPS = [0.1 + 0.05 * k for k in range(17)]


def test_a_located_crossing_is_of_order_four() -> None:
    def error(steps: int) -> float:
        worst = 0.0
        for top in TOPS:
            text = LOGISTIC.format(step=f"{1 / steps} s", top=f"{top:.2f}")
            (event,) = flown(text, 3).events
            worst = max(worst, abs(event.time - reached(round(top, 2))))
        return worst

    found = orders(error, (8, 16, 32))
    assert all(3.4 < order < 4.6 for order in found)


@pytest.mark.parametrize("top", [0.2, 0.5, 0.77])
def test_a_crossing_is_committed_where_the_guard_is_true(top: float) -> None:
    marked = LOGISTIC.replace("flow: {{", "flow: {{mark: der(mark) = 0, ")
    marked = marked.replace("states: {{", 'states: {{mark: {{unit: "1", initial: 0}}, ')
    marked = marked.replace("x > top", "x > top, reset: {{mark: x}}")
    marked = marked.replace("[x]", "[x, mark]")
    run = flown(marked.format(step="0.1 s", top=top), 2)
    (event,) = run.events
    assert (event.source, event.target) == ("below", "above")
    assert 0 < final(run, "mark") - top < 0.1 * K / 4 * ONE_INSTANT


def test_a_step_that_is_cut_goes_on_as_accurately() -> None:
    whole = flown(LOGISTIC.format(step="0.05 s", top=2))
    cut = flown(LOGISTIC.format(step="0.05 s", top=0.31))
    assert len(cut.events) == 1
    errors = [abs(final(run) - logistic(1.0)) for run in (whole, cut)]
    assert errors[1] < 2 * errors[0]
