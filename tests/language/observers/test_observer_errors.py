"""Kalman, refused: what an observer must have, and what it may not read."""

from __future__ import annotations

import pytest

from tests.language.observers.test_steady_kalman import ONE
from tests.language.spec_builders import problem_lines, program, raised_problems

OWN = "modes.only.observer"
MEASURED = "check_observer looks at the keys of `measures`, not at the states that they name: "


def refused(old: str, new: str) -> list[str]:
    assert old in ONE
    return [
        line.partition(" ")[2] for line in problem_lines(lambda: program(ONE.replace(old, new)))
    ]


@pytest.mark.parametrize(
    ("old", "new", "label"),
    [
        ("[x]}", "[xx]}", "`xx` is not a state"),
        ("inputs: [u]", "inputs: [u, w_1]", "`w_1` is not an input"),
        ("B: {x: {u: 1}}", "B: {x: {v: 1}}", "`v` is not a row or column of `x`"),
        ("A: {x:", "A: {z:", "`z` is not a row or column of `A`"),
        ("noise: {x: q}", "noise: {rest: q}", "`rest` is not a row or column of `process_noise`"),
        ("measures: {y_x: x}", "C: {y_x: {x: 1}}", "`measures` is missing in the observer"),
        ("-1 / tau", "1", f"this is in `1`, `{OWN}.A.x.x` is in `1/s`"),
        ("{u: 1}", "{u: tau}", f"this is in `s`, `{OWN}.B.x.u` is in `1`"),
        (
            "f: {x: rest / tau}",
            "f: {x: rest}",
            "this is in `m`, `modes.only.observer.f.x` is in `m/s`",
        ),
        (
            "noise: {x: q}",
            "noise: {x: r}",
            "this is in `m^2`, `modes.only.observer.process_noise.x` is in `m^2/s`",
        ),
        ("-1 / tau", "-rest / (tau * 1 m)", "`rest` is not a parameter: A is made of parameters"),
        ("-1 / tau", "1 / (tau - tau)", "this is inf, not a finite number"),
    ],
)
def test_a_mistake_is_told(old: str, new: str, label: str) -> None:
    assert label in refused(old, new)


@pytest.mark.parametrize(
    ("old", "new"),
    [("{value: 0.5 m^2}", "{value: 0 m^2}"), ("{value: 3 m^2/s}", "{value: -3 m^2/s}")],
)
def test_noise_without_a_steady_gain_is_a_problem(old: str, new: str) -> None:
    (label,) = refused(old, new)
    assert label.startswith("the observer has no steady gain")


def test_a_state_that_nothing_measures_and_that_grows_is_a_problem() -> None:
    text = ONE.replace("measures: {y_x: x}", "measures: {y_x: x}\n      C: {y_x: {x: 0}}")
    (problem,) = raised_problems(lambda: program(text.replace("-1 / tau", "1 / tau")))
    assert "not detectable" in problem.label


def test_a_measured_state_that_is_none_is_refused() -> None:
    assert refused("measures: {y_x: x}", "measures: {y_x: xx}")


def test_a_measured_state_has_the_dimension_of_its_input() -> None:
    text = ONE.replace("y_x: {unit: m}", "y_x: {unit: V}").replace("initial: y_x", "initial: 0 m")
    assert problem_lines(
        lambda: program(text.replace("r: {value: 0.5 m^2}", "r: {value: 0.5 V^2}"))
    )
