"""Affine: the Jacobian of what is linear with constant coefficients, against formulas."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, strategies as st

from language.integration.vector_field import VectorField, field_blocks
from language.ir.ops import Assign, Block, Expr, Ref, Select, Value
from language.lowering.constants import constant_values, parameter_constants
from language.lowering.expressions import lower_expression
from language.lowering.program_parameters import constant_bindings
from language.model.automaton import Automaton
from language.numerics.affine_form import jacobian
from language.numerics.matrix import Matrix
from language.programs.continuous_program import lower_continuous_automaton
from language.text.diagnostic import Problems
from tests.language.spec_builders import automaton, load_shipped, tree

STATES = ("x", "v", "z")
CONSTANTS = {"constant.k": 3.5, "constant.c": -0.25, "calibration.tau": 0.04}


def block(**rates: str) -> Block:
    """Return the rates of x, v and z; other names are equations in the order given."""
    known: dict[str, Expr] = {name: Ref(f"work.at_{name}") for name in STATES}
    known.update({name.partition(".")[2]: Ref(name) for name in CONSTANTS})
    known.update({name: Ref(f"input.{name}") for name in ("u", "flag")})
    ops = []
    for name, text in rates.items():
        target = f"work.rate_{name}" if name in STATES else f"work.at_{name}"
        ops.append(Assign(target, lower_expression(tree(text), known)))
        known.setdefault(name, Ref(target))
    return tuple(ops)


def slopes(text: str, **equations: str) -> tuple[float, ...]:
    """Return the first row of the Jacobian for x' = text."""
    return jacobian(block(**equations, x=text, v="0", z="0"), STATES, CONSTANTS)[0]


@pytest.mark.parametrize(
    ("text", "row"),
    [
        ("x", (1, 0, 0)),
        ("2 * x - v / 4", (2, -0.25, 0)),
        ("-(x - v)", (-1, 1, 0)),
        ("(x + v) / tau", (1 / 0.04, 1 / 0.04, 0)),
        ("k * (c * x - v) + 7", (3.5 * -0.25, -3.5, 0)),
        ("x * k * c / tau", (3.5 * -0.25 / 0.04, 0, 0)),
        ("k^2 * x", (3.5**2, 0, 0)),
        ("sqrt(k) * x + abs(c) * v", (math.sqrt(3.5), 0.25, 0)),
        ("max(k, c) * x + sin(c) * z", (3.5, 0, math.sin(-0.25))),
        ("(if k > 1 then k else c) * x", (3.5, 0, 0)),
        ("x - x", (0, 0, 0)),
        ("x + x + x", (3, 0, 0)),
        ("5", (0, 0, 0)),
    ],
)
def test_a_linear_term_gives_its_coefficient(text: str, row: tuple[float, ...]) -> None:
    assert slopes(text) == pytest.approx(row, rel=1e-15, abs=0)


@pytest.mark.parametrize(
    ("text", "row"),
    [
        ("u", (0, 0, 0)),
        ("k * x + u", (3.5, 0, 0)),
        ("(x + u) / tau", (1 / 0.04, 0, 0)),
        ("k * x + x^2", (3.5, 0, 0)),
        ("k * x - v * z", (3.5, 0, 0)),
        ("u * x + v", (0, 1, 0)),
        ("x / u + v", (0, 1, 0)),
        ("k / x + v", (0, 1, 0)),
        ("sin(x) + v", (0, 1, 0)),
        ("min(x, k) - z", (0, 0, -1)),
        ("(if flag then x else v) + z", (0, 0, 1)),
        ("(x + x^2) * k", (3.5, 0, 0)),
        ("-(x * v - z)", (0, 0, 1)),
    ],
)
def test_what_is_not_linear_or_not_constant_is_left_out(text: str, row: tuple[float, ...]) -> None:
    assert slopes(text) == pytest.approx(row, rel=1e-15, abs=0)


def test_a_term_is_followed_through_equations() -> None:
    assert slopes("k * b - a", a="2 * x", b="a + v + u") == pytest.approx((3.5 * 2 - 2, 3.5, 0))


def test_rows_and_columns_are_in_the_order_of_the_states() -> None:
    rates = block(z="x", x="v", v="-k * x - c * v")
    assert jacobian(rates, STATES, CONSTANTS) == ((0, 1, 0), (-3.5, 0.25, 0), (1, 0, 0))
    assert jacobian(rates, STATES[::-1], CONSTANTS) == ((0, 0, 1), (0, 0.25, -3.5), (0, 1, 0))


def test_a_quotient_by_zero_is_infinite_and_not_a_crash() -> None:
    assert slopes("x / (k - k)") == (math.inf, 0, 0)


def test_a_choice_between_terms_is_left_out_even_where_it_is_constant() -> None:
    rates = (Assign("work.rate_x", Select(Value(True), Ref("work.at_x"), Value(0.0))),)
    assert jacobian(rates, ("x",), {}) == ((0,),)


numbers = st.sampled_from([-3.0, -0.5, 0.0, 0.25, 1.0, 7.0])
rows = st.tuples(numbers, numbers, numbers, numbers)


@given(rows, rows, rows)
def test_any_affine_flow_gives_back_its_matrix(
    a: tuple[float, ...], b: tuple[float, ...], c: tuple[float, ...]
) -> None:
    def written(row: tuple[float, ...]) -> str:
        terms = [f"({value}) * {name}" for value, name in zip(row, (*STATES, "1"), strict=True)]
        return " + ".join(terms)

    rates = block(x=written(a), v=written(b), z=written(c))
    assert jacobian(rates, STATES, {}) == (a[:3], b[:3], c[:3])


@given(rows, rows)
def test_the_jacobian_of_a_sum_is_the_sum(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    def written(row: tuple[float, ...]) -> str:
        return f"({row[0]}) * x + ({row[1]}) * v + x * v + u * ({row[3]})"

    both = slopes(f"{written(a)} - ({written(b)})")
    assert both == pytest.approx((a[0] - b[0], a[1] - b[1], 0))


# The shipped plant: Guercioni et al. 2018, eqs (1)-(9).


def matrix_of(made: Automaton, mode: str) -> Matrix:
    assert lower_continuous_automaton(made, Problems()).period is None
    inputs: dict[str, Expr] = {name: Ref(f"input.{name}") for name in made.inputs}
    field = VectorField(made, constant_bindings(made), inputs, "memory.mode", "")
    constants = constant_values(parameter_constants(made, Problems()))
    return jacobian(field_blocks(field)[f"rates_{mode}"], field.states, constants)


def test_the_plant_in_contact_has_the_matrix_of_the_paper() -> None:
    made = load_shipped("driveline")
    p = {name: float(thing.value or 0) for name, thing in made.parameters.items()}
    r, k, c, inertia = p["R"], p["k_hs"], p["c_hs"], p["J_em"]
    vehicle = p["m"] * p["r_w"] ** 2 + 4 * p["J_wh"]
    rolling = p["m"] * p["g"] * p["r_w"] * p["C_1"]
    expected = {
        "w_w": {
            "w_w": -(c + rolling + p["b_w"]) / vehicle,
            "w_em": c / r / vehicle,
            "theta_d": k / vehicle,
            "theta_b": -k / vehicle,
        },
        "w_em": {
            "w_w": c / r / inertia,
            "w_em": -(c / r**2 + p["b_em"]) / inertia,
            "theta_d": -k / r / inertia,
            "theta_b": k / r / inertia,
        },
        "theta_d": {"w_w": -1, "w_em": 1 / r},
        "theta_b": {},
    }
    found = matrix_of(made, "drive_contact")
    for name, row in zip(made.states, found, strict=True):
        wanted = [expected[name].get(column, 0.0) for column in made.states]
        assert row == pytest.approx(wanted, rel=1e-13, abs=1e-16), name
    assert found == matrix_of(made, "coast_contact")


def test_the_plant_in_the_gap_relaxes_with_stiffness_over_damping() -> None:
    made = load_shipped("driveline")
    p = {name: float(thing.value or 0) for name, thing in made.parameters.items()}
    found = matrix_of(made, "no_contact")
    row = dict(zip(made.states, found[list(made.states).index("theta_b")], strict=True))
    rate = p["k_hs"] / p["c_hs"]
    expected = {"w_w": -1, "w_em": 1 / p["R"], "theta_d": rate, "theta_b": -rate}
    assert row == pytest.approx(expected, rel=1e-14)


def test_an_automaton_of_one_state_has_one_number() -> None:
    text = """language: 1
automaton: decay
parameters: {tau: {value: 40 ms}}
states: {x: {unit: m, initial: 1 m}}
flow: {x: tau * der(x) = -x}
modes: {only: {}}
"""
    ((entry,),) = matrix_of(automaton(text), "only")
    assert entry == pytest.approx(-1 / 0.040)
