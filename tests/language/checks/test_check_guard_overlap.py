"""Guards: transitions of one mode that may hold together need priorities - semantics, rule 3."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, strategies as st

from language.checks.check_guard_overlap import are_syntactically_exclusive
from language.ir.ops import Expr, Value
from language.lowering.expressions import lower_expression
from language.numerics.evaluate import evaluate
from tests.language.spec_builders import automaton, problem_lines, raised_problems, tree

TEXT = """language: 1
automaton: slide
parameters: {{limit: {{value: 0.5 m}}}}
inputs: {{flag: {{type: bool, default: false}}}}
states:
  x: {{unit: m, initial: 0 m, range: [-1, 1]}}
  v: {{unit: m/s, initial: 0 m/s, range: [-2, 2]}}
equations: {{far: x - limit}}
flow: {{x: der(x) = v, v: der(v) = 0}}
initial: free
modes:
  free: {{transitions: {{p: {{{p}}}, q: {{{q}}}}}}}
  end: {{}}
"""

REGION = """regions:
  place:
    initial: left
    modes:
      left: {{equations: {{side: {left}}}, transitions: {{right: {{when: x > 0.3 m}}}}}}
      right: {{equations: {{side: {right}}}, transitions: {{left: {{when: x < 0.2 m}}}}}}
"""


def slide(p: str, q: str) -> str:
    return TEXT.format(p=f"to: end, when: {p}", q=f"to: end, when: {q}")


def overlaps(p: str, q: str) -> list[str]:
    return [line.partition(" ")[2] for line in problem_lines(lambda: automaton(slide(p, q)))]


@pytest.mark.parametrize(
    ("p", "q"),
    [
        ("x < limit", "x >= limit"),
        ("x <= limit", "x > limit"),
        ("x > limit", "x <= limit"),
        ("x >= limit", "x < limit"),
        ("x < limit", "x > limit"),
        ("x > limit", "x < limit"),
        ("x + v * 1 s > limit", "x + v * 1 s <= limit"),
        ("flag", "not flag"),
        ("not flag", "flag"),
        ("not (x > limit and flag)", "x > limit and flag"),
        ("far < 0", "(far) >= 0"),
    ],
)
def test_complements_need_no_priorities(p: str, q: str) -> None:
    assert are_syntactically_exclusive(tree(p), tree(q))
    assert overlaps(p, q) == []


@pytest.mark.parametrize(
    ("p", "q"),
    [
        ("x <= limit", "x >= limit"),
        ("x < limit", "x <= limit"),
        ("x > limit", "x > limit"),
        ("x > limit", "v > 0"),
        ("x > limit", "flag"),
        ("flag", "flag"),
        ("far > 0", "x > 0"),
        ("x > limit or flag", "x <= limit"),
        ("true", "x > limit"),
    ],
)
def test_guards_that_may_hold_together_are_refused_with_a_witness(p: str, q: str) -> None:
    (label,) = overlaps(p, q)
    assert label.startswith("`p` and `q` are both enabled at")


@pytest.mark.parametrize(
    ("p", "q"),
    [
        ("x < limit", "limit <= x"),
        ("x < limit", "x > limit + 0.1 m"),
        ("x > limit and v > 0", "x < -limit and v < 0"),
        ("2 * x - v * 1 s > limit", "v * 1 s >= 2 * x"),
        ("far > 0 and flag", "x < limit or not (flag or x > limit)"),
        ("x > 3 m", "x > limit"),  # outside of the range of x
        ("x * v > 0", "x > limit and v < 0"),
        ("x^2 + v^2 * 1 s^2 < limit^2", "x + v * 1 s > 2 * limit"),
        ("sqrt(abs(x) / 1 m) > 0.5", "abs(x) <= 0.25 m"),
        ("sin(x / 1 m) > v / 1 m * 1 s", "v / 1 m * 1 s > 1"),
        ("rising(x > limit)", "falling(x > limit)"),
        ("after(2 s)", "not after(1 s) and x > 0"),
    ],
)
def test_what_is_proven_to_exclude_each_other_needs_no_priorities(p: str, q: str) -> None:
    assert not are_syntactically_exclusive(tree(p), tree(q))
    assert overlaps(p, q) == []


@pytest.mark.parametrize(
    ("p", "q"), [("exp(v * 1 s/m) > 100", "x > limit"), ("x > limit", "tanh(v * 1 s/m) > 0.999")]
)
def test_what_is_not_proven_is_refused_even_without_a_witness(p: str, q: str) -> None:
    assert overlaps(p, q) == ["nothing proves that `p` and `q` exclude each other"]


def test_a_tunable_counts_with_all_its_values() -> None:
    """At its present value 0.5 m the guards exclude each other, at 0.2 m they do not."""
    tunable = TEXT.replace("limit: {{value: 0.5 m}}", "limit: {{value: 0.5 m, {more}}}")
    text = tunable.format(
        more="range: [0.2, 1], tunable: true",
        p="to: end, when: x < 0.4 m",
        q="to: end, when: x > limit",
    )
    (label,) = problem_lines(lambda: automaton(text))
    assert re.search(r"both enabled at x = 0\.[23]\d*, limit = 0\.[23]", label), label
    assert problem_lines(lambda: automaton(text.replace("[0.2, 1]", "[0.4, 1]"))) == []


def test_regions_beside_are_in_any_of_their_modes() -> None:
    """The equation `side` has another value in each mode of the region."""
    text = slide("side > 0 and x > 0", "x > 0 and side < 1")
    (label,) = problem_lines(lambda: automaton(text + REGION.format(left=0.5, right=2)))
    assert "`p` and `q` are both enabled at" in label
    assert problem_lines(lambda: automaton(text + REGION.format(left=-1, right=2))) == []


def test_different_priorities_decide() -> None:
    assert overlaps("x > limit, priority: 1", "v > 0, priority: 2") == []
    assert overlaps("x > limit, priority: 2", "v > 0, priority: 1") == []
    assert overlaps("x > limit, priority: 1", "v > 0") == []


def test_equal_priorities_decide_nothing() -> None:
    assert len(overlaps("x > limit, priority: 3", "v > 0, priority: 3")) == 1


def test_no_priority_and_priority_0_are_the_same() -> None:
    assert len(overlaps("x > limit", "v > 0, priority: 0")) == 1


def test_the_problem_stands_at_the_later_guard_and_says_what_helps() -> None:
    text = slide("x > limit", "v > 0")
    (problem,) = raised_problems(lambda: automaton(text))
    line = text.splitlines()[problem.span.line - 1]
    assert line[problem.span.column - 1 :].startswith("v > 0")
    assert problem.help == "give them different priorities: the smallest wins"


def test_every_pair_is_looked_at() -> None:
    more = "to: end, when: x > 0}, r: {to: end, when: flag"
    text = TEXT.format(p="to: end, when: v > 0", q=more)
    assert len(raised_problems(lambda: automaton(text))) == 3


def test_guards_of_two_modes_never_meet() -> None:
    text = slide("x > limit", "x <= limit").replace(
        "end: {}", "end: {transitions: {back: {to: free, when: x > 2 m}}}"
    )
    assert problem_lines(lambda: automaton(text)) == []


sides = st.sampled_from(["x", "v", "x + 1", "2 * v"])
relations = st.builds(
    "{} {} {}".format,
    sides,
    st.sampled_from(["<", "<=", ">", ">="]),
    st.sampled_from(["0", "v", "1"]),
)
conditions = st.one_of(
    relations,
    relations.map("not ({})".format),
    st.builds("{} and {}".format, relations, relations),
)
reals = st.sampled_from([-1.0, -0.5, -0.0, 0.0, 0.5, 1.0, 2.0, float("nan"), float("inf")])


def holds(text: str, x: float, v: float) -> bool:
    known: dict[str, Expr] = {"x": Value(x), "v": Value(v)}
    return bool(evaluate(lower_expression(tree(text), known), {}))


@given(conditions, conditions, reals, reals)
def test_what_is_taken_for_disjoint_never_holds_together(
    p: str, q: str, x: float, v: float
) -> None:
    if are_syntactically_exclusive(tree(p), tree(q)):
        assert not (holds(p, x, v) and holds(q, x, v))


@given(conditions, conditions)
def test_exclusion_is_mutual(p: str, q: str) -> None:
    assert are_syntactically_exclusive(tree(p), tree(q)) == are_syntactically_exclusive(
        tree(q), tree(p)
    )


def test_where_only_time_matters_the_witness_is_an_instant() -> None:
    (found,) = overlaps("after(20 ms)", "after(30 ms)")
    assert "`p` and `q` are both enabled at one instant" in found
