"""Witness: values that are true - overlaps of rule 3, guards that fire for ever of rule 9."""

from __future__ import annotations

import re
from collections.abc import Mapping

import pytest
from hypothesis import given, strategies as st

from language.ir.ops import Expr, Value
from language.lowering.expressions import lower_expression
from language.model.automaton import Automaton
from language.numerics.evaluate import evaluate
from language.smt.query_engine import QueryEngine, Witness
from language.smt.symbolic_environment import GuardSnapshot
from tests.language.spec_builders import SHIPPED, automaton, problem_lines, raised_problems, tree

STOP = """language: 1
automaton: stop
parameters: {{m: {{value: 2 kg}}, limit: {{value: {limit}}}}}
inputs: {{F: {{unit: N, range: [-10, 10]}}}}
states:
  x: {{unit: m, initial: 0 m, range: [-1, 1]}}
  v: {{unit: m/s, initial: 0 m/s, range: [-2, 2]}}
equations: {{far: x - limit}}
flow: {{x: der(x) = v * moving, v: m * der(v) = F}}
initial: free
modes:
  free: {{equations: {{moving: 1}}, transitions: {{{free}}}}}
  stopped: {{equations: {{moving: 0}}, transitions: {{{stopped}}}}}
"""
LEAVE = "free: {when: v < 0 m/s}"


def stop(free: str, stopped: str = LEAVE, limit: str = "0.5 m") -> str:
    return STOP.format(free=free, stopped=stopped, limit=limit)


def arrive(guard: str, reset: str = "{x: limit}") -> str:
    return f"stopped: {{when: {guard}, reset: {reset}}}"


def both(p: str, q: str) -> str:
    """Return two transitions with priorities, so that they may overlap."""
    return f"p: {{to: stopped, when: {p}, priority: 1}}, q: {{to: stopped, when: {q}, priority: 2}}"


def together(made: Automaton) -> Mapping[str, float]:
    """Return values at which all guards of the free mode hold."""
    inquiry, moment = QueryEngine(made), GuardSnapshot(made, made.modes["free"])
    guards = [moment.lower_expression(way.when.tree) for way in made.modes["free"].transitions]
    found = inquiry.answer(inquiry.build_query(moment.path, guards))
    assert isinstance(found, Witness)
    return found.valuation


def holds(guard: str, values: dict[str, float], made: Automaton) -> bool:
    """Evaluate a guard without the search: equations laid in by hand."""
    known: dict[str, Expr] = {name: Value(value) for name, value in values.items()}
    limit = float(made.parameters["limit"].value or 0)
    known["limit"] = Value(limit)
    known["far"] = Value(values.get("x", 0.0) - limit)
    return bool(evaluate(lower_expression(tree(guard), known), {}))


# Guards that fire for ever.


@pytest.mark.parametrize(
    "guard",
    [
        "x >= limit and v > 0 m/s",
        "x >= limit and v >= 0 m/s",
        "v > 0 and far >= 0",
        "x > limit and not (v < 0 m/s)",
    ],
)
def test_a_guard_with_its_direction_of_motion_is_accepted(guard: str) -> None:
    assert problem_lines(lambda: automaton(stop(arrive(guard)))) == []


@pytest.mark.parametrize(
    "guard", ["x >= limit", "far >= 0", "not (x < limit)", "x >= limit and F > 0", "true"]
)
def test_a_bare_guard_is_refused(guard: str) -> None:
    (problem,) = raised_problems(lambda: automaton(stop(arrive(guard))))
    path = "`free` -> `stopped` -> `free`"
    assert problem.label == f"this fires again at the same instant, for ever: {path}"
    assert "write the direction of motion too" in problem.help


def test_a_cycle_of_guards_without_variables_is_refused() -> None:
    (problem,) = raised_problems(
        lambda: automaton(stop(arrive("true", "{x: 0 m}"), "free: {when: true}"))
    )
    assert problem.label == "this fires again at the same instant, for ever: " + (
        "`free` -> `stopped` -> `free`"
    )
    assert problem.help.startswith("write the direction of motion too")


def test_the_witness_of_guards_without_variables_is_empty() -> None:
    made = automaton(stop(both("limit > 0 m", "true"), ""))
    assert together(made) == {}


def test_guards_without_variables_that_hold_together_are_both_enabled() -> None:
    text = stop("p: {to: stopped, when: limit > 0 m}, q: {to: stopped, when: true}", "")
    (problem,) = raised_problems(lambda: automaton(text))
    assert problem.label == "`p` and `q` are both enabled at one instant"


def test_the_bare_guard_is_the_one_that_is_pointed_at() -> None:
    text = stop(arrive("x >= limit"))
    (problem,) = raised_problems(lambda: automaton(text))
    assert text.splitlines()[problem.span.line - 1][problem.span.column - 1 :].startswith(
        "x >= limit"
    )


@pytest.mark.parametrize("guard", ["x >= limit", "far >= 0"])
def test_the_witness_of_a_bare_guard_makes_both_guards_true(guard: str) -> None:
    text = stop(arrive(guard))
    (problem,) = raised_problems(lambda: automaton(text))
    values = shown_values(problem.help)
    made = automaton(stop(arrive(guard + " and v > 0 m/s")))
    assert holds(guard, values, made)
    assert holds("v < 0", values, made)


def test_a_wait_breaks_an_instantaneous_circle() -> None:
    assert (
        problem_lines(
            lambda: automaton(stop(arrive("x >= limit"), "free: {when: v < 0, wait: 1 ms}"))
        )
        == []
    )


def test_a_reset_that_leaves_the_guard_breaks_it_too() -> None:
    assert problem_lines(lambda: automaton(stop(arrive("x >= limit", "{x: limit - 0.1 m}")))) == []


def test_a_hysteresis_is_accepted() -> None:
    assert (
        problem_lines(
            lambda: automaton(stop("stopped: {when: x > 0.2 m}", "free: {when: x < 0.1 m}"))
        )
        == []
    )


def test_two_guards_that_are_true_together_are_refused_without_a_boundary() -> None:
    assert problem_lines(
        lambda: automaton(stop("stopped: {when: x > 0.1 m}", "free: {when: x < 0.2 m}"))
    )


@pytest.mark.parametrize(("reset", "fine"), [("{z: 0 m}", False), ("{z: 0 m, v: -0.8 * v}", False)])
def test_a_self_transition_that_stays_enabled_is_refused(reset: str, fine: bool) -> None:
    bounce = STOP.replace("x", "z").format(
        free=f"bounce: {{to: free, when: z <= 0 m, reset: {reset}}}", stopped="", limit="1 m"
    )
    assert (problem_lines(lambda: automaton(bounce)) == []) == fine
    aimed = bounce.replace("z <= 0 m", "z <= 0 m and v < 0 m/s")
    moving = reset.replace("{z: 0 m}", "{z: 0 m, v: 0 m/s}")
    assert problem_lines(lambda: automaton(aimed.replace(reset, moving))) == []


def test_the_shipped_plant_is_accepted_and_without_its_direction_of_motion_refused() -> None:
    path = SHIPPED.path_of("driveline")
    text = path.read_text("utf-8")
    for side, sign in (("theta_b >= alpha", ">"), ("theta_b <= -alpha", "<")):
        bare = text.replace(f"{side} and w_free {sign} 0 rad/s", side)
        assert bare != text
        labels = [problem.label for problem in raised_problems(lambda bare=bare: automaton(bare))]  # type: ignore[misc]
        assert any(label.startswith("this fires again") for label in labels)


# Overlaps.


def shown_values(text: str) -> dict[str, float]:
    return {name: float(value) for name, value in re.findall(r"(\w+) = (-?[\d.e+-]+\d|-?\d)", text)}


PAIRS = [
    ("x > 0.2 m", "v > 0.1 m/s"),
    ("far > 0", "F > 0"),
    ("x <= limit", "x >= limit"),
    ("far >= 0", "x <= limit and v < 0"),
    ("x > v * 1 s", "v >= x / 1 s - 0.1 m/s"),
    ("F > 3 N", "x < 0 and F < 9 N"),
]


@pytest.mark.parametrize(("p", "q"), PAIRS)
def test_both_guards_hold_at_the_values_of_a_witness(p: str, q: str) -> None:
    made = automaton(stop(both(p, q), ""))
    point = together(made)
    values = {name.partition(".")[2]: float(value) for name, value in point.items()}
    assert holds(p, values, made) and holds(q, values, made)


@pytest.mark.parametrize(("p", "q"), PAIRS)
def test_both_guards_hold_at_the_values_that_are_shown(p: str, q: str) -> None:
    text = stop(f"p: {{to: stopped, when: {p}}}, q: {{to: stopped, when: {q}}}", "")
    (problem,) = raised_problems(lambda: automaton(text))
    values = shown_values(problem.label)
    made = automaton(stop(""))
    assert set(values) <= {"x", "v", "F"}
    assert holds(p, values, made) and holds(q, values, made)


def test_both_guards_hold_at_the_values_that_are_shown_on_an_uneven_boundary() -> None:
    text = stop(
        "p: {to: stopped, when: x >= limit}, q: {to: stopped, when: x <= limit}",
        "",
        "0.123441 m",
    )
    (problem,) = raised_problems(lambda: automaton(text))
    values = shown_values(problem.label)
    made = automaton(stop("", limit="0.123441 m"))
    assert holds("x >= limit", values, made) and holds("x <= limit", values, made)


@given(st.integers(-999, 999), st.integers(-1999, 1999))
def test_an_overlap_of_two_half_planes_is_always_found(x: int, v: int) -> None:
    made = automaton(stop(both(f"x <= {x / 1000} m", f"v >= {v / 1000} m/s"), ""))
    point = together(made)
    assert point["state.x"] <= x / 1000
    assert point["state.v"] >= v / 1000


def test_the_search_stays_inside_the_ranges() -> None:
    made = automaton(stop(both("x > 0 and v > 0 and F > 0", "true"), ""))
    point = together(made)
    assert 0 < point["state.x"] <= 1
    assert 0 < point["state.v"] <= 2
    assert 0 < point["input.F"] <= 10


def test_two_truth_inputs_are_searched_apart() -> None:
    text = stop(arrive("x >= limit and p and not q")).replace(
        "inputs: {", "inputs: {p: {type: bool}, q: {type: bool}, "
    )
    assert problem_lines(lambda: automaton(text))


def test_a_sampled_automaton_may_come_back_in_the_next_tick() -> None:
    text = stop(arrive("x >= limit"))
    assert problem_lines(lambda: automaton(text))
    text = re.sub(r"flow: .*\n", "period: 1 ms\nnumbers: float64\n", text)
    assert problem_lines(lambda: automaton(text)) == []
