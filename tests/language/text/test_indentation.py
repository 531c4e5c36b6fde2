"""Keys of one mapping that are indented differently: the message names both indentations."""

from __future__ import annotations

import pytest

from tests.language.spec_builders import document, raised_problems

HEAD = "language: 1\nautomaton: room\nperiod: 10 ms\n"


@pytest.mark.parametrize(
    ("text", "line", "own", "above"),
    [
        ("inputs:\n  u: {unit: m}\n   v: {unit: m}\n", 6, 3, "2 or 0"),
        ("inputs:\n  u: {unit: m}\n v: {unit: m}\n", 6, 1, "2 or 0"),
        (" numbers: float32\n", 4, 1, "0"),
        ("inputs:\n  u:\n    unit: m\n\n   # a comment\n   range: [0, 1]\n", 9, 3, "4 or 2 or 0"),
        ("inputs:\n  u:\n    unit: m\n      range: [0, 1]\n", 7, 6, "4 or 2 or 0"),
    ],
)
def test_a_wrong_indentation_is_named(text: str, line: int, own: int, above: str) -> None:
    (problem,) = raised_problems(lambda: document(HEAD + text))
    assert problem.span.line == line
    told = f"this line is indented by {own}, the lines above it by {above}"
    assert problem.label == f"this is not YAML: {told}"
    assert problem.help == "keys of one mapping have the same indentation"


@pytest.mark.parametrize(
    ("text", "help"),
    [
        ("about: this: that\n", "quote a text that has a `: `"),
        ("inputs: {u: {unit: m}\n", "in `{...}` quote an expression that has a comma"),
        ('about: "text\n', "a bracket or a quote is not closed, or a key has no `:`"),
    ],
)
def test_other_errors_keep_their_help(text: str, help: str) -> None:
    (problem,) = raised_problems(lambda: document(HEAD + text))
    assert "indented" not in problem.label
    assert problem.help == help
