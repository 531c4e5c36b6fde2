"""Exponential, bounds: the number of Taylor terms, |A h| <= 4, and what is refused."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from language.integration.exponential import MAX_STEP_NORM
from language.integration.taylor_bound import taylor_term_count
from language.ir.program import Program
from tests.language.continuous_model import Flow
from tests.language.spec_builders import problem_lines, program, project_of, raised_problems

ONE = {"x": 1.0}
TWO = {"x": 1.0, "z": 1.0}


def decay(folder: Path, rate: str) -> Flow:
    return Flow(folder, f"x: der(x) = {rate} 1/s * x", ONE)


def terms_of(norm: Fraction) -> int:
    """Return the smallest K >= 1 with norm^(K+1)/(K+1)! <= 2^-53, in exact arithmetic."""
    return next(k for k in itertools.count(1) if rest(norm, k) <= 1)


def rest(norm: Fraction, terms: int) -> Fraction:
    """Return the first term left out, in units of 2^-53."""
    return norm ** (terms + 1) * 2**53 / math.factorial(terms + 1)


def series_length(made: Program) -> int:
    (size,) = {v.size for v in made.variables if v.name.startswith("work.series_")}
    return size


@given(st.floats(1e-6, MAX_STEP_NORM))
def test_the_number_of_terms_is_the_smallest_that_is_enough(norm: float) -> None:
    exact = terms_of(Fraction(norm))
    near = [abs(rest(Fraction(norm), k) - 1) for k in (exact - 1, exact)]
    assert taylor_term_count(((norm,),)) == exact or min(near) < 1e-12


def test_at_the_ends_it_is_the_smallest_too() -> None:
    assert taylor_term_count(((0.0,),)) == taylor_term_count(((1e-20,),)) == 1
    assert taylor_term_count(((-MAX_STEP_NORM,),)) == terms_of(Fraction(MAX_STEP_NORM))


def test_what_turns_into_another_quantity_is_gone_after_a_term() -> None:
    """A chain of three: its third power is 0, whatever its norm."""
    chain = ((0.0, 3.5, 0.0), (0.0, 0.0, 3.5), (0.0, 0.0, 0.0))
    assert taylor_term_count(chain) == 3
    circle = ((0.0, 3.5, 0.0), (0.0, 0.0, 3.5), (3.5, 0.0, 0.0))
    assert taylor_term_count(circle) == taylor_term_count(((3.5,),))


ENTRIES = st.floats(-1.25, 1.25, width=16)  # short, for exact powers of them
MATRICES = st.lists(st.lists(ENTRIES, min_size=3, max_size=3), min_size=3, max_size=3)


@given(MATRICES)
def test_no_term_that_is_left_out_counts(rows: list[list[float]]) -> None:
    """Largest entries of the series that are left out, in exact arithmetic, for any start."""
    z = [[Fraction(entry) for entry in row] for row in rows]
    norm = max(sum(abs(entry) for entry in row) for row in z)
    terms = taylor_term_count(tuple(tuple(row) for row in rows))
    power = [[Fraction(i == j) for j in range(3)] for i in range(3)]
    for k in range(40):
        size = max(sum(abs(entry) for entry in row) for row in power) * norm
        if k >= terms:
            assert size <= Fraction(1, 2**53) * (1 + Fraction(1, 10**9)) * math.factorial(k + 1)
        columns = list(zip(*power, strict=True))
        power = [[_dot(row, column) for column in columns] for row in z]


def _dot(row: list[Fraction], column: tuple[Fraction, ...]) -> Fraction:
    return sum((x * y for x, y in zip(row, column, strict=True)), start=Fraction(0))


@pytest.mark.parametrize("rate", ["-0.01", "0.5", "-2", "4"])
def test_a_program_has_the_terms_that_its_norm_needs(tmp_path: Path, rate: str) -> None:
    made = decay(tmp_path, rate).program()
    assert series_length(made) == terms_of(abs(Fraction(rate)))


def test_the_norm_belongs_to_a_substep(tmp_path: Path) -> None:
    made = decay(tmp_path, "3").program(period="2 s", substeps=12)
    assert series_length(made) == terms_of(Fraction(3 * 2, 12))


def test_the_fastest_mode_counts(tmp_path: Path) -> None:
    made = Flow(
        tmp_path,
        "x: der(x) = -0.1 1/s * x",
        ONE,
        leave="two: {when: x <= 0}",
        other="x: der(x) = -3 1/s * x",
    )
    assert series_length(made.program()) == terms_of(Fraction(3))


@pytest.mark.parametrize(("widths", "norm"), [({}, 3.0), ({"z": 20.0}, 5.0), ({"x": 20.0}, 2.0)])
def test_the_norm_is_a_row_sum_in_units_of_the_ranges(
    tmp_path: Path, widths: dict[str, float], norm: float
) -> None:
    """Row x: 1 + 2 width_z / width_x, row z: 0.5 + 0.5 width_x / width_z."""
    text = "x: der(x) = -1 1/s * x + 2 1/s * z, z: der(z) = -0.5 1/s * z - 0.5 1/s * x"
    program = Flow(tmp_path, text, TWO, widths=widths).program
    if norm > MAX_STEP_NORM:
        (line,) = problem_lines(program)
        assert line.endswith(f"|A h| = {norm:.3g} is above 4")
    else:
        made = program()
        assert made.integration
        assert made.integration.norms["one"] == norm
        assert 1 < series_length(made) <= terms_of(Fraction(norm))


@pytest.mark.parametrize("sign", ["", "-"])
def test_a_step_that_is_too_long_is_a_problem_that_proposes_substeps(
    tmp_path: Path, sign: str
) -> None:
    flow = decay(tmp_path, f"{sign}19")
    (problem,) = raised_problems(flow.program)
    assert problem.label == "mode `one` is too fast for one step: |A h| = 19 is above 4"
    assert problem.help == f"{math.ceil(19 / 4)} times as many `substeps` are enough"
    assert raised_problems(lambda: flow.program(substeps=math.ceil(19 / 4) - 1))
    assert not raised_problems(lambda: flow.program(substeps=math.ceil(19 / 4)))


def test_substeps_that_are_there_are_counted_in(tmp_path: Path) -> None:
    flow = decay(tmp_path, "40")
    (problem,) = raised_problems(lambda: flow.program(substeps=2))
    assert problem.help == "5 times as many `substeps` are enough"
    assert not raised_problems(lambda: flow.program(substeps=2 * 5))


def test_a_norm_of_4_is_not_too_long(tmp_path: Path) -> None:
    assert not raised_problems(decay(tmp_path, "-4").program)
    assert raised_problems(decay(tmp_path, "-4.001").program)


def test_every_mode_that_is_too_fast_is_told(tmp_path: Path) -> None:
    fast = "x: der(x) = -5 1/s * x"
    flow = Flow(tmp_path, fast, ONE, leave="two: {when: x <= 0}", other=fast)
    assert len(raised_problems(flow.program)) == 2


def test_rk4_knows_no_such_bound(tmp_path: Path) -> None:
    """It takes |A h| = 4 and more where that is no decay; where it is, its own limit counts."""
    swings = "x: der(x) = 1 1/s * z * 50, z: der(z) = -1 1/s * x / 50"
    flow = Flow(tmp_path, swings, TWO)
    assert raised_problems(flow.program)
    assert not raised_problems(lambda: flow.program(method="rk4"))


BARE = """language: 1
automaton: m
states: {x: {unit: "1", initial: 1}}
modes: {one: {flow: {x: der(x) = 0}}}
"""
TAU = "tau: {value: 1 s, range: [0.5, 2], tunable: true}"


def test_a_tunable_in_the_matrix_may_be_tuned_and_stamps_its_numbers(tmp_path: Path) -> None:
    made = Flow(tmp_path, "x: tau * der(x) = -x", ONE, parameters=TAU).program()
    solved = [constant for constant in made.constants if constant.kind == "solved"]
    assert {constant.depends_on for constant in solved} == {("tau",)}
    assert "solved.stamp_tau" in [constant.name for constant in solved]
    assert "stale_calibration" in made.faults


def test_the_terms_are_enough_for_the_whole_range_of_a_tunable(tmp_path: Path) -> None:
    made = Flow(tmp_path, "x: tau * der(x) = -x", ONE, parameters=TAU).program()
    assert series_length(made) == terms_of(Fraction(2))


def test_the_bound_holds_for_the_whole_range_of_a_tunable(tmp_path: Path) -> None:
    fast = TAU.replace("[0.5, 2]", "[0.2, 2]")
    flow = Flow(tmp_path, "x: tau * der(x) = -x", ONE, parameters=fast)
    (problem,) = raised_problems(flow.program)
    assert problem.label == "mode `one` is too fast for one step: |A h| = 5 is above 4"
    assert not raised_problems(lambda: flow.program(substeps=2))


def test_what_is_derived_from_a_tunable_follows_it_to_the_ends_of_its_range(tmp_path: Path) -> None:
    more = f"{TAU}, rate: {{derived: 1 / tau, unit: 1/s}}"
    made = Flow(tmp_path, "x: der(x) = -rate * x", ONE, parameters=more).program()
    assert series_length(made) == terms_of(Fraction(2))


@pytest.mark.parametrize(
    "flow", ["x: der(x) = -x / gap", "x: der(x) = 1.0e6 1/s * x", "x: gap * der(x) = -x"]
)
def test_a_flow_that_is_far_too_fast_is_a_problem_not_a_crash(tmp_path: Path, flow: str) -> None:
    gap = "gap: {value: 0 s, tunable: true}"
    (problem,) = raised_problems(Flow(tmp_path, flow, ONE, parameters=gap).program)
    assert "is too fast for one step" in problem.label


@pytest.mark.parametrize("flow", ["x: der(x) = -x / (1 s - 1 s)", "x: 0 s * der(x) = -x"])
def test_a_divisor_that_is_0_is_told_before_the_step_is_looked_at(
    tmp_path: Path, flow: str
) -> None:
    (problem,) = raised_problems(Flow(tmp_path, flow, ONE).program)
    assert problem.label == "this divisor may be 0: it lies from 0 to 0"


@pytest.mark.parametrize("place", ["m", "s"])
def test_a_state_without_a_range_is_refused(tmp_path: Path, place: str) -> None:
    span = ", range: [-5, 5]"
    model = BARE.replace("initial: 1", "initial: 1" + (span if place == "s" else ""))
    clock = BARE.replace("initial: 1", "initial: 1" + (span if place == "m" else ""))
    clock = clock.replace("automaton: m", "automaton: s\nperiod: 1 s\nnumbers: float64\nmodel: m")
    clock = clock.replace("flow: {x: der(x) = 0}", "runs: {of: m.one, method: exponential}")
    project = project_of(tmp_path, m=model)
    (line,) = problem_lines(lambda: program(clock, project))
    assert line.endswith("state `x` needs a `range`: method `exponential` scales with it")
