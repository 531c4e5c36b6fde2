"""Names: words of the languages that they end up in, case, and files."""

from __future__ import annotations

import pytest

from language.expressions.name_rules import (
    check_file_name,
    check_name,
    report_case_collisions,
    reserved_words,
)
from language.text.diagnostic import Problems
from tests.language.build import NOWHERE


def complaints(name: str) -> list[str]:
    problems = Problems()
    check_name(name, NOWHERE, problems)
    return [problem.label for problem in problems.reported]


@pytest.mark.parametrize("language", ["GRAMMAR", "YAML", "C", "C++", "A2L", "GENERATED"])
def test_no_reserved_word_is_a_name_and_with_a_digit_each_is(language: str) -> None:
    for word in reserved_words()[language]:
        assert len(complaints(word)) == 1, word
        assert complaints(f"{word}_1") == [], word


@pytest.mark.parametrize("name", ["a", "T_em", "x" * 31, "Z9_", "virtual_mass", "Unit", "value"])
def test_a_letter_then_letters_digits_and_underscores_is_a_name(name: str) -> None:
    assert complaints(name) == []


WRONG = ["", "_a", "9a", "x" * 32, "ä", "a-b", "a b", "a\n", "a\0", "a\u202e", "a*/"]
LOOK_ALIKES = ["\u0430", "K\u212a"]
"""A Cyrillic letter, and the sign of kelvin."""


@pytest.mark.parametrize("name", [*WRONG, *LOOK_ALIKES])
def test_anything_else_is_none(name: str) -> None:
    assert len(complaints(name)) == 1


@pytest.mark.parametrize("name", ["main", "MAIN", "math", "nul", "COM1", "lpt9", "ha_math"])
def test_an_automaton_is_not_named_like_another_file(name: str) -> None:
    problems = Problems()
    check_file_name(name, NOWHERE, problems)
    assert len(problems.reported) == 1 + (name == "main")


def test_names_that_differ_in_case_only_are_told_once_each() -> None:
    problems = Problems()
    named = [(name, NOWHERE) for name in ("a", "b", "A", "a", "B")]
    report_case_collisions(named, problems)
    assert [p.label for p in problems.reported] == [
        "`A` and `a` differ in case only",
        "`B` and `b` differ in case only",
    ]
