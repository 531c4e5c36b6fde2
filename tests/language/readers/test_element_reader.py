"""Elements, places, terms and outputs that read something else - docs/language.md."""

from __future__ import annotations

import pytest

from language.ir.printer import block_lines, format_program
from tests.language.spec_builders import automaton, problem_lines, program, stepper

CART = """language: 1
automaton: cart
parameters:
  m: {{value: 2 kg, range: [1, 5], neutral: 1.5, starts: [2, 3], per: recording}}
  b: {{value: 3 N*s/m}}
  k: {{value: 7 N/m}}
inputs: {{F: {{unit: N}}}}
states: {{x: {{unit: m, initial: 0 m}}, v: {{unit: m/s, initial: 0 m/s}}}}
equations: {{F_s: k * x, p: m * v}}
flow:
  x: der(x) = v
  v: m * der(v) = {right}
modes: {{only: {{{mode}}}}}
{more}
outputs: {outputs}
"""
ELEMENTS = "elements: {spring: {kind: elastic, twist: x, rate: v, torque: F_s, stiffness: k}}"


def cart(right: str = "F", mode: str = "", more: str = "", outputs: str = "[x, v, p, mode]") -> str:
    return CART.format(right=right, mode=mode, more=more, outputs=outputs)


def test_terms_are_added_to_the_right_side_in_their_order() -> None:
    terms = cart(more="terms: {v: {drag: -b * v, spring: -F_s}}")
    written = cart(right="F + -b * v + -F_s")
    found, wanted = (list(block_lines(program(t).blocks["rates_only"])) for t in (terms, written))
    assert found == wanted
    assert any("-" in line for line in found)


def test_terms_of_a_mode_come_after_those_of_the_root() -> None:
    both = cart(mode="terms: {v: {drag: -b * v}}", more="terms: {v: {spring: -F_s}}")
    written = cart(right="F + -F_s + -b * v")
    assert program(both).blocks["rates_only"] == program(written).blocks["rates_only"]


@pytest.mark.parametrize(
    ("more", "line"),
    [
        ("terms: {w: {a: 1 N}}", "there is no balance of `w` that a term could be added to"),
        ("terms: {v: {a: 1 m}}", "`+` joins `N` and `m`"),
        ("elements: {s: {kind: rubber}}", "`rubber` is not one of elastic, inertia"),
        ("elements: {s: {twist: x}}", "`elements.s.kind` is missing"),
        ("elements: {s: {kind: inertia, speed: v}}", "`elements.s.inertia` is missing"),
        (
            "elements: {s: {kind: inertia, speed: v, inertia: m, twist: x}}",
            "`twist` is not a key of `elements.s`",
        ),
        (
            "elements: {s: {kind: inertia, speed: vv, inertia: m, far: [G]}}",
            "`vv` is not known here",
        ),
        ("elements: {s: {kind: inertia, speed: v, inertia: m, far: [G]}}", "`G` is not known here"),
        ("places: {w: {weight: 1 N}}", "`w` is not a balance, an input or an output"),
        ("places: {v: {wait: 1 N}}", "`wait` is not a key of `places.v`"),
    ],
)
def test_what_is_wrong_with_them_is_told(more: str, line: str) -> None:
    assert any(found.endswith(line) for found in problem_lines(lambda: automaton(cart(more=more))))


def test_elements_and_places_have_no_influence() -> None:
    more = ELEMENTS + "\nplaces: {v: {weight: 9 N}, F: {angle_rate: v}}"
    assert format_program(program(cart(more=more))) == format_program(program(cart()))
    made = automaton(cart(more=more))
    assert made.elements["spring"].kind == "elastic"
    assert set(made.elements["spring"].parts) == {"twist", "rate", "torque", "stiffness"}
    assert set(made.places) == {"v", "F"}


def test_an_output_may_read_something_else() -> None:
    made = stepper(cart(outputs="{place: x, p: p, v: F_s, m: mode}"))
    wires = {wire.name: wire.source for wire in made.program.outputs}
    assert wires == {
        "place": "state.x",
        "p": "equation.p",
        "v": "equation.F_s",
        "m": "memory.mode",
    }


def test_an_output_that_reads_nothing_known_is_told() -> None:
    lines = problem_lines(lambda: automaton(cart(outputs="{place: xx}")))
    assert [line.partition(" ")[2] for line in lines] == [
        "output `xx` is not a state, an equation or `mode`"
    ]


def test_a_parameter_may_say_how_it_is_fitted() -> None:
    fitting = automaton(cart()).parameters["m"].fitting
    assert (float(fitting.neutral or 0), fitting.per) == (1.5, "recording")
    assert [float(start) for start in fitting.starts] == [2.0, 3.0]
    assert automaton(cart()).parameters["b"].fitting.neutral is None


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("neutral: 1.5", "neutral: 7", "the neutral value is outside the range"),
        ("starts: [2, 3]", "starts: [2, 9]", "this start is outside the range"),
        ("per: recording", "per: file", "`file` is not one of model, recording"),
    ],
)
def test_what_is_wrong_with_a_fitting_is_told(old: str, new: str, line: str) -> None:
    assert [
        t.partition(" ")[2] for t in problem_lines(lambda: automaton(cart().replace(old, new)))
    ] == [line]
