"""Reading: the complete text of a Program gives the Program again, and wrong texts are refused."""

from __future__ import annotations

from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, given, note, settings, strategies as st

from codegen.passes.pass_list import run_c_passes
from language.ir.expression_parser import ExpressionSyntaxError, parse_expression_text
from language.ir.number_type import NUMBER_TYPES, NumberType
from language.ir.ops import (
    Assign,
    Binary,
    Call,
    Compare,
    Expr,
    Item,
    Ref,
    Select,
    Switch,
    Unary,
    Value,
)
from language.ir.printer import format_expr, format_program, serialise_program
from language.ir.program import Program
from language.ir.program_parser import ProgramSyntaxError, parse_program
from language.loading.load import automaton_of, lower_automaton, program_of
from language.overlays.expand_document import Project, read_document
from language.passes.pass_list import run_passes
from tests.language.spec_builders import ROOT, load_shipped
from tests.lockstep.random_specs.spec import automaton
from tests.lockstep.random_specs.spec_kinds import random_spec

GOLDEN = Path(__file__).parent / "golden"
HEATER = ROOT / "tests" / "codegen" / "emit" / "golden" / "heater.yaml"
SHARE = 4
"""An example lowers a spec."""


def require_round_trip(program: Program) -> None:
    text = serialise_program(program)
    again = parse_program(text)
    assert again == program
    assert serialise_program(again) == text
    assert format_program(again) == format_program(program)


@settings(
    max_examples=max(1, settings().max_examples // SHARE),
    suppress_health_check=[HealthCheck.too_slow],
)
@given(st.integers(0, 2**32), st.sampled_from(NUMBER_TYPES))
def test_the_text_of_a_random_program_is_read_again(seed: int, number: NumberType) -> None:
    spec = random_spec(Random(seed), "found")
    note(spec.text)
    with TemporaryDirectory() as folder:
        lowered = lower_automaton(automaton(spec, number, Path(folder)))
    made = run_passes(lowered)
    for program in (lowered, made, run_c_passes(made)):
        require_round_trip(program)


@pytest.mark.parametrize("name", ["estimator_float32", "supervisor", "driveline", "hko"])
def test_the_text_of_a_shipped_program_is_read_again(name: str) -> None:
    made = program_of(load_shipped(name))
    require_round_trip(made)
    require_round_trip(run_c_passes(made))


X, K = Ref("state.x"), Ref("memory.k", is_integer=True)
LEAVES = st.one_of(
    st.floats(allow_nan=False).map(Value),
    st.integers(-(2**31), 2**31 - 1).map(Value),
    st.booleans().map(Value),
    st.sampled_from([X, K, Ref("input.inflow"), Ref("work.not_a")]),
)


def compound(part: st.SearchStrategy[Expr]) -> st.SearchStrategy[Expr]:
    return st.one_of(
        st.builds(Unary, st.sampled_from(["-", "not"]), part),
        st.builds(Binary, st.sampled_from(["+", "-", "*", "/", "and", "or"]), part, part),
        st.builds(Compare, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), part, part),
        st.builds(Select, part, part, part),
        st.builds(lambda inner: Call("min", tuple(inner)), st.lists(part, max_size=3)),
        st.builds(lambda index: Item("memory.list", index, True), part),
    )


@given(st.recursive(LEAVES, compound, max_leaves=12))
def test_the_text_of_an_expression_is_read_again(expr: Expr) -> None:
    text = format_expr(expr)
    again = parse_expression_text(text, {"memory.k", "memory.list"})
    assert repr(again) == repr(expr), "0.0 and -0.0, 1 and 1.0 and True are not the same"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("(state.x + )", r"column 12: `\)` instead of an expression"),
        ("(state.x state.y)", "column 10: `state.y` instead of an operator"),
        ("(state.x + 1.0", "column 15: the end instead of `\\)`"),
        ("state.x 1", "column 9: `1` instead of the end"),
        ("(if a.b then 1 2)", "column 16: `2` instead of `else`"),
        ("", "column 1: the end instead of an expression"),
        ("a.b & c.d", "column 5: unexpected `&`"),
        ("then", "column 1: `then` instead of an expression"),
    ],
)
def test_a_text_that_is_no_expression_is_refused(text: str, message: str) -> None:
    with pytest.raises(ExpressionSyntaxError, match=message):
        parse_expression_text(text, ())


def test_switches_over_one_variable_stay_apart() -> None:
    made = program_of(load_shipped("contactor"))
    one, other = (Switch("memory.mode", ((k, (Assign("memory.mode", Value(k)),)),)) for k in (0, 1))
    blocks = {**made.blocks, "step": (one, other)}
    require_round_trip(Program(**{**vars(made), "blocks": blocks}))


# Wrong texts.


def heater() -> Program:
    return program_of(automaton_of(read_document(HEATER), Project(HEATER.parent)))


def replaced(old: str, new: str) -> str:
    text = serialise_program(heater())
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("numbers float64", "numbers float16", "line 2: no number type: `float16`"),
        ("block init\n", "block\n", "no declaration: `block`"),
        ("    run latch", "    dash latch", "no operation: `dash latch`"),
        ("    run latch", "   run latch", "an indentation is a multiple of four blanks"),
        ("    run latch", "        run latch", "the line is indented too far"),
        ('@ {"kind"', "@ {kind", "no JSON"),
        ('"kind": "fixed"', '"sort": "fixed"', "wrong attributes"),
        ('"writes": ["', '"writes": ["memory.wrong", "', "too many ..memory.wrong.., missing"),
        ('"reads": ["', '"reads": ["memory.wrong", "', "`reads` does not agree with the rest"),
    ],
)
def test_a_wrong_text_is_refused_with_its_line(old: str, new: str, message: str) -> None:
    with pytest.raises(ProgramSyntaxError, match=message):
        parse_program(replaced(old, new))


def test_a_text_without_a_header_is_refused() -> None:
    with pytest.raises(ProgramSyntaxError, match="there is no major_step, name, number_type"):
        parse_program("block step\n")


# Golden texts.


@pytest.mark.parametrize("name", ["cruise_driver", "contactor", "heater"])
def test_the_complete_text_is_golden(name: str, update: bool) -> None:
    program = heater() if name == "heater" else program_of(load_shipped(name))
    golden, text = GOLDEN / f"{name}.txt", serialise_program(program)
    if update:
        golden.write_text(text, "utf-8")
    assert text == golden.read_text("utf-8")
