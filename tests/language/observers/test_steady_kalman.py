"""Kalman: solved numbers and one cycle of an observer, against other implementations."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from filterpy.common import van_loan_discretization
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray
from scipy.linalg import expm, solve_discrete_are

from engine.interpreter.interpreter import Interpreter
from language.ir.program import Program
from language.loading.load import automaton_of, lower_automaton
from language.overlays.expand_document import read_document
from tests.language.spec_builders import ROOT, program, project_of, solve_constants, stepper

Matrix = NDArray[np.float64]

PAPER = json.loads((ROOT / "tests/data/paper/kf_matrices.json").read_text())
TOLERANCE = 1e-9
"""Of the largest entry of a matrix: semantics, rule 17."""
STATES = ("theta_d", "w_em", "w_w")
MEASURES = ("y_em", "y_w")
INPUTS = ("T_em", "T_br")
RATES = {"100Hz": "10 ms", "1kHz": "1 ms", "10kHz": "0.1 ms"}
VARIANT = """language: 1
variant: other_rate
extends: {base}
period: {period}
modes: {{gap: {{runs: {{substeps: 20}}}}}}
"""


@pytest.fixture(scope="module", params=["estimator", "estimator_written"])
def at_rate(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Program]:
    """Return the Program of a shipped estimator at each rate of the paper's matrices.

    One takes its matrices from the model, the other has them written out.
    """
    made = {}
    for rate, period in RATES.items():
        folder = tmp_path_factory.mktemp(rate)
        project = project_of(folder, other=VARIANT.format(base=request.param, period=period))
        document = read_document(project.path_of("other_rate"))
        made[rate] = lower_automaton(automaton_of(document, project))
    return made


def matrix(made: Program, letter: str, rows: tuple[str, ...], columns: tuple[str, ...]) -> Matrix:
    numbers = solve_constants(made)
    return np.array(
        [
            [numbers.get(f"solved.drive_{letter}.{row}.{col}", 0.0) for col in columns]
            for row in rows
        ]
    )


def close(ours: Matrix, theirs: Any) -> bool:
    other = np.asarray(theirs, dtype=np.float64)
    assert ours.shape == other.shape
    return bool(np.max(np.abs(ours - other)) <= TOLERANCE * np.max(np.abs(other)))


def predicted(made: Program, mode: str, **values: float) -> Matrix:
    """Return what the prediction of a mode makes of values; all others are 0."""
    inside = Interpreter(made)
    for variable in made.variables:
        if variable.name.startswith(("state.", "before.")):
            inside.set(variable.name, 0.0)
    for name, value in values.items():
        group = "before" if name in INPUTS else "state"
        inside.set(f"{group}.{name}", value)
    inside.run(f"predict_{mode}")
    return np.array([inside.get(f"state.{name}") for name in STATES])


@pytest.mark.parametrize("rate", RATES)
def test_the_transition_matrix_is_that_of_the_paper(at_rate: dict[str, Program], rate: str) -> None:
    assert close(matrix(at_rate[rate], "Phi", STATES, STATES), PAPER["rates"][rate]["Phi"])


@pytest.mark.parametrize("rate", RATES)
def test_the_gain_is_that_of_the_paper(at_rate: dict[str, Program], rate: str) -> None:
    assert close(matrix(at_rate[rate], "L", STATES, MEASURES), PAPER["rates"][rate]["L"])


@pytest.mark.parametrize("rate", RATES)
def test_both_contacts_have_the_same_numbers(at_rate: dict[str, Program], rate: str) -> None:
    numbers = solve_constants(at_rate[rate])
    drive = {name: value for name, value in numbers.items() if name.startswith("solved.drive_")}
    drive = {name: value for name, value in drive.items() if "contact" not in name}
    assert len(drive) > 20
    for name, value in drive.items():
        assert numbers[name.replace("solved.drive_", "solved.coast_")] == value


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize(
    ("mode", "key", "side"), [("drive", "Gamma_Tem_Tbr_f_drive", 1), ("coast", "Gamma_coast", -1)]
)
def test_inputs_and_the_constant_part_act_as_in_the_paper(
    at_rate: dict[str, Program], rate: str, mode: str, key: str, side: int
) -> None:
    """The three columns by what the prediction does: T_em, T_br and f at theta_b = +-alpha."""
    made = at_rate[rate]
    alpha = side * solve_constants(made)["constant.alpha"]
    free = predicted(made, mode, theta_b=alpha)
    columns = [predicted(made, mode, theta_b=alpha, **{name: 1.0}) - free for name in INPUTS]
    assert close(np.column_stack([*columns, free]), PAPER["rates"][rate][key])


@pytest.mark.parametrize("rate", RATES)
def test_input_numbers_are_those_of_the_paper(at_rate: dict[str, Program], rate: str) -> None:
    gamma = np.array(PAPER["rates"][rate]["Gamma_Tem_Tbr_f_drive"])
    assert close(matrix(at_rate[rate], "Gamma", STATES, INPUTS), gamma[:, :2])


def test_the_numbers_given_are_those_of_the_paper(at_rate: dict[str, Program]) -> None:
    (info, _) = at_rate["1kHz"].observers
    assert close(np.array(info.a), PAPER["A_drive"])
    assert close(np.array(info.b), PAPER["B"])
    assert close(np.array(info.c), PAPER["C"])
    assert (info.states, info.inputs, info.measures) == (STATES, INPUTS, MEASURES)


def test_a_longer_period_is_so_many_short_ones(at_rate: dict[str, Program]) -> None:
    short, long = (matrix(at_rate[rate], "Phi", STATES, STATES) for rate in ("1kHz", "100Hz"))
    assert close(np.linalg.matrix_power(short, 10), long)


# One cycle of the shipped estimator against filterpy.


def reference(made: Program) -> tuple[KalmanFilter, Matrix]:
    """Return filterpy's filter in its steady state, all numbers by scipy and filterpy."""
    (info, _) = made.observers
    a, b, c = (np.array(part) for part in (info.a, info.b, info.c))
    noise = np.diag(np.sqrt(np.diag(np.array(info.process_noise))))
    phi, q = van_loan_discretization(a, noise, info.period)
    n, m = b.shape
    block = np.zeros((n + m + n, n + m + n))
    block[:n] = np.hstack([a, b, np.eye(n)])
    held = expm(block * info.period)[:n, n:]
    r = np.array(info.measurement_noise)
    ahead = solve_discrete_are(phi.T, c.T, q, r)
    gain = ahead @ c.T @ np.linalg.inv(c @ ahead @ c.T + r)
    found = KalmanFilter(dim_x=n, dim_z=len(c), dim_u=m + n)
    found.F, found.B, found.H, found.Q, found.R = phi, held, c, q, r
    found.P = (np.eye(n) - gain @ c) @ ahead
    return found, gain


def tangent_load(p: dict[str, float]) -> float:
    """Return the road load at standstill [N*m] of its tangent at 40 km/h (b_0 of the paper)."""
    r, w = p["constant.r_w"], 40 / 3.6 / p["constant.r_w"]
    weight = p["constant.m"] * p["constant.g"] * r
    return -p["constant.a_aer"] * r**3 * w**2 + weight * (
        p["constant.C_0"] - p["constant.C_2"] * w**2
    )


def test_a_cycle_of_prediction_and_correction_is_that_of_filterpy(
    at_rate: dict[str, Program],
) -> None:
    made = at_rate["1kHz"]
    theirs, gain = reference(made)
    ours, p = Interpreter(made), solve_constants(made)
    ours.run("step")
    start = {"theta_d": 0.07, "w_em": 310.0, "w_w": 38.4, "theta_b": p["constant.alpha"]}
    before = {"T_em": 27.0, "T_br": 3.0}
    now = {"T_em": -900.0, "T_br": 900.0, "y_em": 311.5, "y_w": 38.1}
    for name, value in start.items():
        ours.set(f"state.{name}", value)
    for group, values in (("before", before), ("input", now)):
        for name, value in values.items():
            ours.set(f"{group}.{name}", value)
    for name in MEASURES:
        ours.set(f"is_new.{name}", True)
    ours.run("step")
    pull = p["constant.k_hs"] * p["constant.alpha"]
    inertia = p["calibration.J_em"]
    f = [0.0, pull / (inertia * p["constant.R"]), -(pull + tangent_load(p)) / p["constant.J_v"]]
    theirs.x = np.array([[start[name]] for name in STATES])
    theirs.predict(u=np.array([[before["T_em"]], [before["T_br"]], *[[value] for value in f]]))
    ahead = theirs.x.copy()
    theirs.update(np.array([[now[name]] for name in MEASURES]))
    assert close(theirs.K, gain)
    assert close(matrix(made, "L", STATES, MEASURES), theirs.K)
    for row, name in enumerate(STATES):
        assert ours.get(f"work.predicted_{name}") == pytest.approx(ahead[row, 0], rel=TOLERANCE)
        assert ours.get(f"state.{name}") == pytest.approx(theirs.x[row, 0], rel=TOLERANCE)
    for row, name in enumerate(MEASURES):
        assert ours.get(f"innovation.{name}") == pytest.approx(
            theirs.y[row, 0], rel=0, abs=TOLERANCE * now[name]
        )


# An observer of one state, by hand.

ONE = """language: 1
automaton: one
period: 0.1 s
numbers: float64
parameters: {q: {value: 3 m^2/s}, r: {value: 0.5 m^2}, tau: {value: 0.7 s, tunable: true}}
inputs: {y_x: {unit: m}, u: {unit: m/s, default: 0 m/s}}
states: {x: {unit: m, initial: y_x}, rest: {unit: m, initial: 0 m}}
modes:
  only:
    observer:
      kalman: {states: [x]}
      inputs: [u]
      A: {x: {x: -1 / tau}}
      B: {x: {u: 1}}
      f: {x: rest / tau}
      measures: {y_x: x}
      process_noise: {x: q}
      measurement_noise: {y_x: r}
outputs: [x]
"""
T, TAU, Q, R = 0.1, 0.7, 3.0, 0.5


def one_gain() -> float:
    """Return L = P/(P + R), P = phi^2 P R/(P + R) + Qd: a quadratic equation (Kalman 1960)."""
    phi = math.exp(-T / TAU)
    qd = Q * TAU / 2 * (1 - phi * phi)
    half = (R * (1 - phi * phi) - qd) / 2
    p = -half + math.sqrt(half * half + qd * R)
    return p / (p + R)


def test_one_state_has_the_gain_of_its_quadratic_equation() -> None:
    assert solve_constants(program(ONE))["solved.only_L.x.y_x"] == pytest.approx(
        one_gain(), rel=1e-13
    )


def test_one_state_follows_its_closed_form() -> None:
    inside, phi, gain = stepper(ONE), math.exp(-T / TAU), one_gain()
    inside.set("input.y_x", 2.0)
    inside.set("is_new.y_x", True)
    inside.run("step")
    x = 2.0
    assert inside.get("state.x") == x
    for y, u, rest, fresh in [
        (1.0, 3.0, 0.0, True),
        (0.5, -1.0, 4.0, True),
        (9.0, 0.0, 1.0, False),
    ]:
        held = float(inside.get("before.u"))
        inside.set("state.rest", rest)
        for name, value in {"input.y_x": y, "input.u": u, "is_new.y_x": fresh}.items():
            inside.set(name, value)
        inside.run("step")
        x = phi * x + TAU * (1 - phi) * (held + rest / TAU)
        x += gain * (y - x) if fresh else 0.0
        assert inside.get("state.x") == pytest.approx(x, rel=1e-12)


def test_the_first_tick_corrects_and_does_not_predict() -> None:
    text = ONE.replace("initial: y_x", "initial: 1 m")
    inside = stepper(text)
    inside.set("input.y_x", 3.0)
    inside.set("is_new.y_x", True)
    inside.run("step")
    assert inside.get("state.x") == pytest.approx(1 + one_gain() * (3 - 1), rel=1e-13)


def test_solved_numbers_know_the_tunables_that_they_came_from() -> None:
    made = program(ONE)
    for constant in made.constants:
        if constant.name.startswith("solved.only_"):
            assert constant.depends_on == ("tau",)
    assert made.faults == ("stale_calibration",)


def test_a_tuned_value_that_its_numbers_do_not_know_is_a_fault() -> None:
    inside = stepper(ONE)
    assert inside.get("memory.faults") == 0
    inside.set("calibration.tau", TAU * (1 + 1e-15))
    inside.run("init")
    assert inside.get("memory.faults") == 1
