"""Large and deep specs: what is read in time, and what is refused clearly."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

import modewright as mw
from language.text.document import MAX_BYTES

READ_TWICE = 60
"""Steps of a chain in which each equation reads the one before twice: 2^60 parts if put in."""
LONGEST = 60.0
"""Seconds that a test machine under load may take for a spec of 60 equations; measured: 1 s."""


def automaton(equations: list[str], tail: str = "") -> str:
    lines = "\n".join(f"  {line}" for line in equations)
    last = equations[-1].partition(":")[0]
    return (
        "language: 1\nautomaton: large\nstates: {x: {initial: 1, range: [0, 2]}}\n"
        f"equations:\n{lines}\nmodes: {{only: {{flow: {{x: 1 s * der(x) = {last} - x}}}}}}\n"
        f"outputs: [x]\n{tail}"
    )


def problems(folder: Path, text: str) -> list[str]:
    path = folder / "large.yaml"
    path.write_text(text)
    return [problem.label for problem in mw.check(str(path))]


def test_a_chain_that_reads_twice_costs_no_more_than_its_length(tmp_path: Path) -> None:
    chain = ["e_0: x"]
    chain += [f"e_{k}: 0.3 * e_{k - 1} + 0.1 * e_{k - 1} * x" for k in range(1, READ_TWICE)]
    start = time.monotonic()
    assert problems(tmp_path, automaton(chain)) == []
    assert time.monotonic() - start < LONGEST


@pytest.mark.long
def test_a_chain_of_a_thousand_derived_parameters_needs_no_stack(tmp_path: Path) -> None:
    names = "\n".join(f"  p_{k}: {{derived: p_{k + 1} + 1}}" for k in range(1000))
    text = automaton(["e_0: p_0 + x"], f"parameters:\n{names}\n  p_1000: {{value: 1}}\n")
    assert problems(tmp_path, text) == []


@pytest.mark.parametrize(
    "text",
    [
        "(" * 10_000 + "x" + ")" * 10_000,
        "x" + " + x" * 250_000,
        "x^2^3",
        "-" * 1900 + "x",
        "if x > 0 then 1 else " * 150 + "2",
        "not " * 400 + "true",
        "abs(" * 400 + "x" + ")" * 400,
    ],
    ids=["parentheses", "a megabyte", "towers", "signs", "branches", "nots", "calls"],
)
def test_an_expression_beyond_all_measure_is_one_clear_problem(tmp_path: Path, text: str) -> None:
    (label,) = problems(tmp_path, automaton([f'e_0: "{text}"']))
    assert len(label) < 200


def test_laughs_are_refused_before_they_are_expanded(tmp_path: Path) -> None:
    lines = ['l0: &l0 "ha"']
    lines += [f"l{k}: &l{k} [{', '.join([f'*l{k - 1}'] * 10)}]" for k in range(1, 10)]
    start = time.monotonic()
    found = problems(tmp_path, "\n".join(["language: 1", "automaton: laughs", *lines]))
    assert time.monotonic() - start < LONGEST
    assert set(found) == {
        "an anchor (`&name`) is not part of the language",
        "an alias (`*name`) is not part of the language",
    }


def test_more_nodes_than_are_read_are_refused(tmp_path: Path) -> None:
    text = "language: 1\nautomaton: nodes\nabout: [" + "1," * 200_001 + "]\n"
    assert len(text) < MAX_BYTES
    assert problems(tmp_path, text) == ["a spec has at most 200000 keys and values"]
