"""Printing: the canonical text of a Program, and a digest that sees values, not looks."""

from __future__ import annotations

import dataclasses
import re
from fractions import Fraction

import pytest

from language.ir.ops import (
    Assign,
    Binary,
    Branch,
    Call,
    Compare,
    Count,
    Expr,
    FaultBit,
    Item,
    Loop,
    Op,
    Ref,
    RunBlock,
    Select,
    Store,
    Switch,
    Unary,
    Value,
)
from language.ir.printer import block_lines, digest, format_expr, format_program
from language.loading.load import automaton_of, program_of
from language.overlays.expand_document import read_document
from tests.language.spec_builders import SHIPPED, load_shipped, program

X, Y = Ref("state.x"), Ref("state.y")


@pytest.mark.parametrize(
    ("expr", "text"),
    [
        (Value(0.1), "0.1"),
        (Value(-0.0), "-0.0"),
        (Value(1), "1"),
        (Value(True), "True"),
        (X, "state.x"),
        (Item("work.list", Value(2)), "work.list[2]"),
        (Unary("-", X), "(- state.x)"),
        (Unary("not", X), "(not state.x)"),
        (Binary("-", Binary("-", X, Y), X), "((state.x - state.y) - state.x)"),
        (Binary("-", X, Binary("-", Y, X)), "(state.x - (state.y - state.x))"),
        (Compare("<=", X, Value(1.0)), "(state.x <= 1.0)"),
        (Select(Ref("input.q"), X, Y), "(if input.q then state.x else state.y)"),
        (Call("min", (X, Y)), "min(state.x, state.y)"),
    ],
)
def test_an_expression_is_printed_with_every_parenthesis(expr: Expr, text: str) -> None:
    assert format_expr(expr) == text


@pytest.mark.parametrize(
    ("op", "lines"),
    [
        (Assign("state.x", Y, "here"), ["state.x := state.y    # here"]),
        (Assign("state.x", Y), ["state.x := state.y"]),
        (Store("work.list", Value(1), Y), ["work.list[1] := state.y"]),
        (Count("timer.a", X, 3, "k"), ["count timer.a up to 3 while state.x    # k"]),
        (FaultBit("limit"), ["fault limit"]),
        (RunBlock("b"), ["run b"]),
        (Loop(2, "work.k", (RunBlock("b"),)), ["repeat 2 times as work.k", "    run b"]),
        (Branch(X, (RunBlock("b"),)), ["if state.x", "    run b"]),
        (Branch(X, (), (RunBlock("c"),)), ["if state.x", "else", "    run c"]),
        (
            Switch("memory.mode", ((1, (RunBlock("b"),)), (2, ()))),
            ["when memory.mode is 1", "    run b", "when memory.mode is 2"],
        ),
    ],
)
def test_an_operation_is_printed_a_line_each(op: Op, lines: list[str]) -> None:
    assert list(block_lines((op,))) == lines
    assert list(block_lines((op,), 1)) == [f"    {line}" for line in lines]


@pytest.mark.parametrize("name", ["estimator", "driveline"])
def test_the_text_of_a_program_is_the_same_in_every_run(name: str) -> None:
    document = read_document(SHIPPED.path_of(name))
    first, second = program_of(load_shipped(name)), program_of(automaton_of(document, SHIPPED))
    assert format_program(first) == format_program(second)
    assert digest(first) == digest(second)
    assert format_program(first).startswith(f"program {name}\nnumbers float64\n")


def test_the_digest_is_16_hexadecimal_digits() -> None:
    assert re.fullmatch("[0-9a-f]{16}", digest(program_of(load_shipped("estimator"))))


# Every value counts.


def test_the_digest_changes_with_every_parameter() -> None:
    made = load_shipped("estimator")
    digests = {"": digest(program_of(made))}
    for name, thing in made.parameters.items():
        if thing.value is not None and name != "t_wait":
            nudged = dataclasses.replace(thing, value=thing.value * (1 + Fraction(1, 10**9)))
            changed = dataclasses.replace(made, parameters={**made.parameters, name: nudged})
            digests[name] = digest(program_of(changed))
    assert len(digests) > 20
    assert len(set(digests.values())) == len(digests)


@pytest.mark.parametrize(("name", "value"), [("t_wait", "0.71 ms"), ("m", "1250.0001 kg")])
def test_the_digest_changes_with_a_value_that_is_set(name: str, value: str) -> None:
    assert digest(program_of(load_shipped("estimator", **{name: value}))) != digest(
        program_of(load_shipped("estimator"))
    )


MACHINE = """language: 1
automaton: machine
about: what it is for
period: 1 ms
numbers: float64
parameters:
  k: {value: 2 1/s, range: [1, 3], tunable: true}
inputs: {u: {unit: m, default: 1 m}}
states: {x: {unit: m, initial: 0 m, range: [-1, 1]}, z: {unit: m, initial: 3 m}}
equations: {e: x + 0.5 m}
initial: one
modes:
  one:
    number: 4
    update: {x: x + k * u * 1 s}
    transitions:
      two: {when: e > 0.25 m, wait: 5 ms, priority: 1, reset: {x: 7 m, z: 9 m}}
      far: {to: two, when: x > 8 m, priority: 2}
  two: {number: 6, equations: {f: 2 * e}}
outputs: [x, e]
"""


@pytest.fixture(scope="module")
def plain() -> str:
    """Return the digest of the machine as it is."""
    return digest(program(MACHINE))


def changed(old: str, new: str) -> str:
    assert old in MACHINE
    return digest(program(MACHINE.replace(old, new)))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("period: 1 ms", "period: 2 ms"),
        ("automaton: machine", "automaton: engine"),
        ("value: 2 1/s", "value: 2.5 1/s"),
        (", tunable: true", ""),
        ("default: 1 m", "default: 2 m"),
        ("{unit: m, default: 1 m}", "{unit: m}"),
        ("initial: 0 m", "initial: 0.1 m"),
        ("x + 0.5 m", "x + 0.25 m"),
        ("x + 0.5 m", "0.5 m + x"),
        ("initial: one", "initial: two"),
        ("number: 4", "number: 5"),
        ("k * u * 1 s", "u * k * 1 s"),
        ("e > 0.25 m", "e >= 0.25 m"),
        ("e > 0.25 m", "e > 0.75 m"),
        ("wait: 5 ms", "wait: 6 ms"),
        ("wait: 5 ms, ", ""),
        ("priority: 1", "priority: 3"),
        ("x: 7 m", "x: 6 m"),
        ("to: two", "to: one"),
        ("[x, e]", "[e, x]"),
        ("[x, e]", "[x]"),
        ("far:", "near:"),
    ],
)
def test_the_digest_changes_with_what_is_said(plain: str, old: str, new: str) -> None:
    assert changed(old, new) != plain


def test_the_digest_changes_with_the_range_of_a_calibration(plain: str) -> None:
    assert changed("range: [1, 3]", "range: [1, 4]") != plain


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("about: what it is for", "about: something else"),
        ("about: what it is for\n", "# what it is for\n\n"),
        ("period: 1 ms", "period: 1 ms   # a comment"),
        ("period: 1 ms", "period: 1.0e-3 s"),
        ("value: 2 1/s", "value: 2.0 1/s"),
        ("x + 0.5 m", "x + 500 mm"),
        ("x + 0.5 m", "(x) + (0.5 m)"),
        ("x + k * u * 1 s", "x+k  *u * 1 s"),
        ("x + k * u * 1 s", "'x + k * u * 1 s'"),
        (
            "{value: 2 1/s, range: [1, 3], tunable: true}",
            "{tunable: true, range: [1, 3], value: 2 1/s}",
        ),
        ("when: x > 8 m, priority: 2", "priority: 2, when: x > 8 m"),
        ("to: two, when: x > 8 m", "when: x > 8 m, to: two"),
        ("number: 6, equations: {f: 2 * e}", "equations: {f: 2 * e}, number: 6"),
        (
            "number: 4\n    update: {x: x + k * u * 1 s}",
            "update: {x: x + k * u * 1 s}\n    number: 4",
        ),
        ("parameters:\n", "parameters:\n  idle: {value: 7 m}\n"),
    ],
)
def test_the_digest_does_not_change_with_how_it_is_said(plain: str, old: str, new: str) -> None:
    assert changed(old, new) == plain


def test_the_digest_does_not_change_with_the_order_of_sections(plain: str) -> None:
    head, *sections = re.split(r"\n(?=\w)", MACHINE.rstrip())
    assert len(sections) > 8
    for shift in (1, 4, 7):
        moved = "\n".join([head, *sections[shift:], *sections[:shift]]) + "\n"
        assert digest(program(moved)) == plain


def test_a_template_prints_as_what_it_stands_for(plain: str) -> None:
    text = MACHINE.replace("two: {number: 6, equations: {f: 2 * e}}", "two: {number: 6, like: t}")
    text = text.replace("modes:\n", "templates: {t: {equations: {f: 2 * e}}}\nmodes:\n")
    assert digest(program(text)) == plain
