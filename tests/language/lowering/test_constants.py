"""Constants: values of parameters, their order, exact times, and what X_Derive recomputes."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from hypothesis import given, strategies as st

from engine.interpreter.interpreter import Interpreter
from language.ir.number_type import round_to_type
from language.ir.ops import Assign
from language.ir.program import Program, TransitionInfo
from language.lowering.constants import (
    constant_values,
    evaluate_constant,
    evaluate_exactly,
    parameter_constants,
)
from language.lowering.program_parameters import parameter_kinds, parameter_order
from language.lowering.wait_ticks import MAX_WAIT_TICKS
from language.model.automaton import Automaton
from language.model.declaration import Formula
from language.text.diagnostic import Problems
from tests.language.spec_builders import (
    automaton,
    load_shipped,
    problem_labels,
    problem_lines,
    program,
    raised_problems,
    solve_constants,
    tree,
)

TEXT = """language: 1
automaton: clock
{period}
parameters:
{parameters}
states: {{x: {{unit: m, initial: 0 m}}}}
initial: one
modes:
  one: {{{update}transitions: {{two: {{when: x > 0 m, wait: {wait}}}}}}}
  two: {{{update}}}
outputs: [x{extra}]
"""
CHAIN = """  c: {derived: a * b, unit: m^2}
  b: {derived: 2 * a, unit: m}
  a: {value: 3 m}
  t: {value: 5 m, tunable: true, range: [1, 9]}
  d: {derived: c / t, unit: m}
  e: {derived: d + b, unit: m}
"""


def clock(parameters: str = "", wait: str = "0 s", period: str = "1 ms", extra: str = "") -> str:
    ticking = f"period: {period}\nnumbers: float64" if period else ""
    update = "" if period else "flow: {x: der(x) = 0}, "
    return TEXT.format(
        parameters=parameters or "  p: {value: 1}",
        wait=wait,
        period=ticking,
        update=update,
        extra=extra,
    )


def waiting(made: Program) -> TransitionInfo:
    return made.transitions[0]


# Order and kinds.


def test_a_derived_value_comes_after_what_it_follows_from() -> None:
    made = automaton(clock(CHAIN))
    assert parameter_order(made) == ["a", "b", "c", "t", "d", "e"]


def test_values_follow_through_a_chain() -> None:
    found = parameter_constants(automaton(clock(CHAIN)), Problems())
    values = {name: constant.value for name, constant in found.items()}
    assert values == {"a": 3, "b": 6, "c": 18, "t": 5, "d": 18 / 5, "e": 18 / 5 + 6}


def test_what_is_derived_from_fixed_values_alone_is_fixed() -> None:
    kinds = parameter_kinds(automaton(clock(CHAIN)))
    fixed = {"a", "b", "c"}
    assert {name for name, kind in kinds.items() if kind == "fixed"} == fixed
    assert {name for name, kind in kinds.items() if kind == "derived"} == {"d", "e"}


def test_constants_are_named_by_their_kind() -> None:
    found = parameter_constants(automaton(clock(CHAIN)), Problems())
    assert found["c"].name == "constant.c"
    assert (found["t"].name, found["t"].range) == ("calibration.t", (1, 9))
    assert (found["e"].name, found["e"].unit) == ("derived.e", "m")


def test_only_what_follows_from_tunables_is_derived_anew() -> None:
    text = clock(CHAIN).replace("initial: 0 m}", "initial: e}")
    made = program(text)
    ops = [op for op in made.blocks["derive"] if isinstance(op, Assign)]
    assert [op.target for op in ops] == ["derived.d", "derived.e"]
    inside = Interpreter(made)
    inside.set("calibration.t", 2.0)
    inside.run("derive")
    assert (inside.get("derived.d"), inside.get("derived.e")) == (9, 9 + 6)


def test_the_shipped_inertia_is_that_of_the_formula() -> None:
    made = load_shipped("driveline", m="1800 kg", r_w="31.83 cm")
    found = parameter_constants(made, Problems())["J_v"].value
    assert found == pytest.approx(1800 * 0.3183**2 + 4 * 0.7, rel=1e-15)


@pytest.mark.parametrize(
    ("derived", "circle"),
    [
        ({"a": "a + 1"}, "`a` -> `a`"),
        ({"a": "b", "b": "a"}, "`a` -> `b` -> `a`"),
        ({"a": "b", "b": "c", "c": "2 * a"}, "`a` -> `c` -> `b` -> `a`"),
    ],
)
def test_values_that_follow_from_each_other_are_refused(
    derived: dict[str, str], circle: str
) -> None:
    lines = "\n".join(f'  {name}: {{derived: {text}, unit: "1"}}' for name, text in derived.items())
    (problem,) = raised_problems(lambda: automaton(clock(lines)))
    assert problem.label == f"`derived` values form a cycle: {circle}"


@pytest.mark.parametrize(
    ("parameters", "label"),
    [
        ("  a: {derived: 2 m, unit: s}", "this is in `m`, `the unit of a` is in `s`"),
        ("  a: {derived: x, unit: m}", "`x` is not known among the parameters"),
        ("  a: {derived: 1 m, unit: m, value: 2 m}", "a derived parameter has no `value`"),
        ("  a: {derived: 1 m, unit: m, tunable: true}", "a derived parameter has no `tunable`"),
        ("  a: {value: 3 m, range: [4, 5]}", "the value of `a` is outside its range"),
        ("  a: {value: 3 m, range: [5, 4]}", "the range is empty: low is not below high"),
        ("  a: {value: 3 m, unit: s}", "`m` does not fit the unit `s`"),
        (
            "  a: {value: 3 m + 1 m}",
            "`parameters.a.value` is a number with a unit, not an expression",
        ),
    ],
)
def test_a_parameter_that_contradicts_itself_is_refused(parameters: str, label: str) -> None:
    assert label in [
        line.partition(" ")[2] for line in problem_lines(lambda: automaton(clock(parameters)))
    ]


def test_a_value_that_is_not_finite_is_told_with_its_name() -> None:
    made = automaton(clock("  a: {value: 0}\n  b: {derived: 1 / a}"))
    problems = Problems()
    assert parameter_constants(made, problems)["b"].value == 0
    assert problem_labels(problems) == ["parameter `b` is inf, not finite"]


@pytest.mark.parametrize("value", ["9.9e308", "1.0e308 km", "9" * 400])
def test_a_value_past_the_largest_double_is_a_problem(value: str) -> None:
    assert raised_problems(lambda: program(clock(f"  a: {{value: {value}}}")))


@given(st.fractions(-10, 10, max_denominator=10**9))
def test_a_value_is_rounded_once_from_its_exact_value(exact: Fraction) -> None:
    assert round_to_type(exact) == float(exact)


# Formulas of parameters.


def formula(text: str) -> Formula:
    return Formula(tree(text), "here")


def test_a_constant_is_a_formula_of_parameters() -> None:
    made = automaton(clock(CHAIN))
    values = constant_values(parameter_constants(made, Problems()))
    assert evaluate_constant(formula("sqrt(c) + t"), made, values, "A") == math.sqrt(18) + 5
    (problem,) = raised_problems(lambda: evaluate_constant(formula("c + x"), made, values, "A"))
    assert problem.label == "`x` is not a parameter: A is made of parameters"
    (problem,) = raised_problems(
        lambda: evaluate_constant(formula("1 / (a - a)"), made, values, "A")
    )
    assert problem.label == "this is inf, not a finite number"


def exact(text: str, made: Automaton) -> Fraction:
    return evaluate_exactly(formula(text), made)


def test_a_time_is_exact() -> None:
    made = automaton(clock("  t1: {value: 0.1 ms}\n  t2: {derived: 3 * t1, unit: s}"))
    assert exact("0.1 s + 0.2 s", made) == Fraction(3, 10)
    assert exact("t2 - t1 / 3", made) == Fraction(3, 10**4) - Fraction(1, 3 * 10**4)
    assert exact("-t1 * 2^3", made) == Fraction(-8, 10**4)
    assert exact("t1^-1", made) == 10**4


@pytest.mark.parametrize("text", ["max(t1, 0)", "if t1 > 0 then t1 else 0", "t1 / (t1 - t1)", "x"])
def test_what_cannot_be_exact_is_no_time(text: str) -> None:
    made = automaton(clock("  t1: {value: 0.1 ms}"))
    (problem,) = raised_problems(lambda: exact(text, made))
    assert problem.label == "a time is made of numbers, parameters and + - * /"


# Waits: N = ceil(d / T), semantics rule 4.


@given(st.fractions(0, 50, max_denominator=40), st.fractions(Fraction(1, 4), 9, max_denominator=40))
def test_a_wait_is_the_next_whole_number_of_ticks(wait: Fraction, period: Fraction) -> None:
    parts = [wait.numerator, wait.denominator, period.numerator, period.denominator]
    names = ("w_n", "w_d", "p_n", "p_d")
    lines = [f"  {name}: {{value: {value}}}" for name, value in zip(names, parts, strict=True)]
    text = clock("\n".join(lines), wait="1 ms * w_n / w_d / (p_n / p_d)", period="1 ms")
    info = waiting(program(text))
    assert info.wait == wait / period / 1000
    assert info.ticks == math.ceil(wait / period)


@pytest.mark.parametrize(
    ("wait", "period", "ticks"),
    [("5 ms", "1 ms", 5), ("0.7 ms", "1 ms", 1), ("0.3 ms", "0.1 ms", 3), ("1 min", "1 s", 60)],
)
def test_no_wait_is_a_tick_longer_for_its_rounding(wait: str, period: str, ticks: int) -> None:
    assert waiting(program(clock(wait=wait, period=period))).ticks == ticks


def test_a_wait_of_0_s_is_no_wait() -> None:
    for period in ("1 ms", ""):
        info = waiting(program(clock(wait="0 s", period=period)))
        assert (info.wait == 0, info.ticks, info.timer) == (True, 0, None)
    assert waiting(program(clock(wait="0 s"))).timer is None


def test_a_wait_of_a_continuous_automaton_has_no_ticks_but_a_timer() -> None:
    info = waiting(program(clock(wait="0.7 ms", period="")))
    assert (info.wait, info.ticks, info.timer) == (Fraction(7, 10**4), 0, "timer.one_two")


def test_the_longest_wait_fits_its_counter() -> None:
    assert waiting(program(clock(wait=f"{MAX_WAIT_TICKS} ms"))).ticks == MAX_WAIT_TICKS == 2**31 - 2
    (line,) = problem_lines(lambda: program(clock(wait=f"{MAX_WAIT_TICKS + 1} ms")))
    assert line.endswith(f"a wait of {MAX_WAIT_TICKS + 1} ticks is longer than {MAX_WAIT_TICKS}")


@pytest.mark.parametrize(
    ("wait", "label"),
    [
        ("-1 ms", "a wait is not negative"),
        ("3", "this is in `1`, `wait` is in `s`"),
        ("x / 1 m * 1 s", "`x` is not known in `wait`: it is a fixed time"),
        ("2 * t_c", "`t_c` is tunable: a wait is made of fixed values"),
        ("t_d", "`t_d` is derived: a wait is made of fixed values"),
    ],
)
def test_what_is_no_fixed_time_is_no_wait(wait: str, label: str) -> None:
    parameters = "  t_c: {value: 1 ms, tunable: true}\n  t_d: {derived: 2 * t_c, unit: s}"
    (problem,) = raised_problems(lambda: program(clock(parameters, wait=wait)))
    assert problem.label == label


def test_a_tunable_wait_is_a_number_of_ticks_on_the_page() -> None:
    parameters = "  t_c: {value: 30 ms, tunable: true, range: [10, 50.5]}"
    found = program(clock(parameters, wait="t_c"))
    (constant,) = (c for c in found.constants if c.kind == "tunable")
    assert (constant.name, constant.value, constant.type) == ("calibration.t_c", 30, "whole")
    assert (constant.range, constant.unit) == ((10, 51), "tick")
    assert (
        waiting(found).tunable_wait == "calibration.t_c" and waiting(found).timer_limit == 2**16 - 1
    )


@pytest.mark.parametrize(
    ("value", "limits", "label"),
    [
        ("0 ms", "[-0.5, 9]", "`t_c` is a wait: its range is within 0 to 2147483646 ticks"),
        ("5 ms", "[0, 2147484 s]", "`t_c` is a wait: its range is within 0 to 2147483646 ticks"),
        ("51 ms", "[10, 50.5]", "the value of `t_c` is outside its range"),
    ],
)
def test_a_tunable_wait_is_a_time_of_its_range(value: str, limits: str, label: str) -> None:
    parameters = f"  t_c: {{value: {value}, tunable: true, range: {limits}}}"
    (problem, *_) = raised_problems(lambda: program(clock(parameters, wait="t_c")))
    assert problem.label == label


@pytest.mark.parametrize(
    ("value", "limits", "period", "ticks"),
    [
        ("5 s", "[0 s, 5 s]", "7 ms", (0, 715, 715)),
        ("50.2 ms", "[10, 50.5]", "1 ms", (10, 51, 51)),
        ("0.5 ms", "[0.1, 0.9]", "1 ms", (1, 1, 1)),
        ("10 ms", "[10 ms, 1 s]", "3 ms", (4, 4, 334)),
        ("1 h", "[30 min, 1 h]", "7 ms", (257143, 514286, 514286)),
    ],
)
def test_a_tunable_wait_may_have_any_time_of_its_range(
    value: str, limits: str, period: str, ticks: tuple[int, int, int]
) -> None:
    """Value and ends are rounded up to whole ticks alike, so the value is between the ends."""
    parameters = f"  t_c: {{value: {value}, tunable: true, range: {limits}}}"
    found = program(clock(parameters, wait="t_c", period=period))
    (constant,) = (c for c in found.constants if c.kind == "tunable")
    assert constant.range
    assert (constant.range[0], constant.value, constant.range[1]) == ticks


@pytest.mark.parametrize(
    ("limits", "limit"),
    [
        ("", 2**31 - 1),
        (", range: [0 s, 65534 ms]", 2**16 - 1),
        (", range: [0 s, 65535 ms]", 2**31 - 1),
        (", range: [0 s, 12 h]", 2**31 - 1),
    ],
)
def test_the_counter_of_a_tunable_wait_counts_more_than_the_end_of_its_range(
    limits: str, limit: int
) -> None:
    found = program(clock(f"  t_c: {{value: 1 ms, tunable: true{limits}}}", wait="t_c"))
    assert waiting(found).timer_limit == limit


def test_a_tunable_wait_of_a_continuous_automaton_is_none() -> None:
    parameters = "  t_c: {value: 1 ms, tunable: true}"
    (problem,) = raised_problems(lambda: program(clock(parameters, wait="t_c", period="")))
    assert problem.label == "`t_c` is tunable: a wait is made of fixed values"


def test_a_wait_may_follow_from_fixed_values() -> None:
    parameters = "  t_a: {value: 1 ms}\n  t_b: {derived: 3 * t_a, unit: s}"
    assert waiting(program(clock(parameters, wait="t_b"))).ticks == 3


def test_a_wait_follows_the_value_that_is_set() -> None:
    text = clock("  t_a: {value: 1 ms}", wait="2 * t_a")
    assert waiting(program(text, t_a="4.5 ms")).ticks == 9
    assert "constant.t_a" not in solve_constants(program(text))
