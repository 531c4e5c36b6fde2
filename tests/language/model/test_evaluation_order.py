"""Order: each name after those that it reads, and circles refused by the names of their members."""

from __future__ import annotations

import itertools
from fractions import Fraction

import pytest
from hypothesis import given, strategies as st

from language.expressions.syntax_tree import names
from language.ir.ops import Assign
from language.ir.program import unqualified_name
from language.model.automaton import Mode
from language.model.declaration import Formula
from language.model.evaluation_order import equation_order, report_cycle
from language.model.graph_algorithms import format_cycle
from language.text.diagnostic import Problems
from tests.language.spec_builders import (
    NOWHERE,
    problem_labels,
    problem_lines,
    program,
    raised_problems,
    tree,
)

Reading = dict[str, list[str]]


def mode(equations: dict[str, str]) -> Mode:
    """Return a mode of nothing but equations."""
    formulas = {name: Formula(tree(text), name) for name, text in equations.items()}
    return Mode("only", 0, formulas, {}, {}, None, None, (), "modes.only", NOWHERE)


def order(equations: dict[str, str]) -> list[str]:
    return equation_order(mode(equations))


def summed(reading: Reading) -> dict[str, str]:
    return {name: " + ".join(["1", *read]) for name, read in reading.items()}


@st.composite
def acyclic(draw: st.DrawFn) -> Reading:
    """Return names that read some of those before them, in any order."""
    count = draw(st.integers(1, 8))
    made: Reading = {}
    for place in range(count):
        before = [f"e{k}" for k in range(place)]
        made[f"e{place}"] = draw(st.lists(st.sampled_from(before), unique=True)) if before else []
    shuffled = draw(st.permutations(list(made)))
    return {name: made[name] for name in shuffled}


def test_a_name_comes_after_those_that_it_reads() -> None:
    assert order({"a": "b + c", "b": "c", "c": "x"}) == ["c", "b", "a"]


def test_what_is_free_stays_in_the_order_of_the_file() -> None:
    assert order({"c": "x", "a": "y", "b": "z"}) == ["c", "a", "b"]
    assert order({"c": "b", "a": "y", "b": "z"}) == ["a", "b", "c"]


def test_names_of_other_things_give_no_order() -> None:
    assert order({"b": "x + k", "a": "in(plant.b) and b > 0"}) == ["b", "a"]


@given(acyclic())
def test_every_name_comes_once_and_after_what_it_reads(reading: Reading) -> None:
    found = order(summed(reading))
    assert sorted(found) == sorted(reading)
    for name, read in reading.items():
        assert all(found.index(other) < found.index(name) for other in read)


@given(acyclic())
def test_the_order_is_the_first_in_the_order_of_the_file(reading: Reading) -> None:
    """At each place stands the first name of the file that may stand there."""
    left = dict(reading)
    for name in order(summed(reading)):
        ready = [other for other, read in left.items() if not set(read) & set(left)]
        assert name == ready[0]
        del left[name]


@given(acyclic(), st.data())
def test_a_loop_names_members_that_read_each_other(reading: Reading, data: st.DataObject) -> None:
    names_ = list(reading)
    first, last = data.draw(st.sampled_from(names_)), data.draw(st.sampled_from(names_))
    texts = summed(reading)
    texts[first] += f" + {last}"
    texts[last] += f" + {first}"
    (problem,) = raised_problems(lambda: order(texts))
    members = problem.label.partition(": ")[2].replace("`", "").split(" -> ")
    assert members[0] == members[-1]
    for one, other in itertools.pairwise(members):
        assert one in [read.path for read in names(tree(texts[other]))]


@pytest.mark.parametrize(
    ("equations", "loop"),
    [
        ({"a": "a + 1"}, "`a` -> `a`"),
        ({"a": "b", "b": "a"}, "`a` -> `b` -> `a`"),
        ({"x1": "1", "b": "c + x1", "c": "d", "d": "b"}, "`b` -> `d` -> `c` -> `b`"),
    ],
)
def test_an_algebraic_loop_is_told_once(equations: dict[str, str], loop: str) -> None:
    (problem,) = raised_problems(lambda: order(equations))
    assert problem.label == f"an algebraic loop in mode `only`: {loop}"


def test_a_chain_ends_where_it_started() -> None:
    assert format_cycle(["a", "b"]) == "`a` -> `b` -> `a`"


def test_a_circle_of_values_is_told_and_none_is_not() -> None:
    problems = Problems()
    spans = dict.fromkeys("abc", NOWHERE)
    report_cycle({"a": tree("b"), "b": tree("c"), "c": tree("x")}, spans, "derived", problems)
    assert problems.reported == []
    report_cycle({"a": tree("b"), "b": tree("a"), "c": tree("x")}, spans, "derived", problems)
    assert problem_labels(problems) == ["`derived` values form a cycle: `a` -> `b` -> `a`"]


MODES = """language: 1
automaton: modes
period: 1 ms
numbers: float64
states: {x: {unit: m, initial: 2 m}, z: {unit: m, initial: x + 1 m}}
equations: {b: a + x}
initial: one
modes:
  one: {equations: {a: c + x, c: 3 m}, transitions: {two: {when: b > 0}}}
  two: {equations: {c: a + x, a: 4 m}}
outputs: [b, a]
"""


def test_each_mode_has_an_order_of_its_own() -> None:
    made = program(MODES)
    for block, expected in (("equations_one", ["c", "a", "b"]), ("equations_two", ["a", "b", "c"])):
        targets = [op.target for op in made.blocks[block] if isinstance(op, Assign)]
        assert [
            unqualified_name(name) for name in targets if name.startswith("equation.")
        ] == expected


def test_a_loop_in_one_mode_is_told_there() -> None:
    lines = problem_lines(lambda: program(MODES.replace("a: 4 m", "a: c")))
    assert lines == ["10:24 an algebraic loop in mode `two`: `c` -> `a` -> `c`"]


def test_loops_in_two_modes_are_both_told() -> None:
    text = MODES.replace("a: 4 m", "a: c").replace("c: 3 m", "c: a")
    assert len(problem_lines(lambda: program(text))) == 2


def test_start_values_come_after_those_that_they_read() -> None:
    text = MODES.replace("initial: 2 m", "initial: z - 1 m").replace(
        "initial: x + 1 m", "initial: 7 m"
    )
    ops = program(text).blocks["start"]
    states = [op.target for op in ops if isinstance(op, Assign) and op.target.startswith("state.")]
    assert states == ["state.z", "state.x"]


def test_a_circle_of_start_values_is_refused() -> None:
    lines = problem_lines(lambda: program(MODES.replace("initial: 2 m", "initial: z")))
    assert lines == ["5:10 `initial` values form a cycle: `x` -> `z` -> `x`"]
    assert Fraction(1, 1000) == program(MODES).period
