"""Names: words of the languages that they end up in, case, and files."""

from __future__ import annotations

import pytest

from language.expressions.name_rules import (
    check_file_name,
    check_name,
    check_variable_name,
    report_case_collisions,
    reserved_words,
)
from language.text.diagnostic import Problems
from language.typecheck.function_calls import FUNCTION_NAMES
from tests.language.spec_builders import NOWHERE


def complaints(name: str) -> list[str]:
    problems = Problems()
    check_name(name, NOWHERE, problems)
    return [problem.label for problem in problems.reported]


@pytest.mark.parametrize("language", ["GRAMMAR", "YAML", "C", "C++", "A2L", "GENERATED"])
def test_no_reserved_word_is_a_name_and_with_a_digit_each_is(language: str) -> None:
    for word in reserved_words()[language]:
        assert len(complaints(word)) == 1, word
        assert complaints(f"{word}_1") == [], word


def test_a_word_of_the_c_library_is_no_variable_but_may_be_a_mode() -> None:
    for word in reserved_words()["C library"]:
        problems = Problems()
        check_variable_name(word, NOWHERE, problems)
        assert len(problems.reported) == 1, word
        assert complaints(word) == [], word


@pytest.mark.parametrize(
    "words",
    [
        "cbrt fabs fma hypotf lgammal round",
        "printf memset qsort free signal errno",
        "int_fast32_t time_t FILE va_list",
        "EOF RAND_MAX INT_MAX SIGINT",
    ],
)
def test_functions_types_and_macros_of_the_c_library_are_reserved(words: str) -> None:
    for word in words.split():
        problems = Problems()
        check_name(word, NOWHERE, problems)
        check_variable_name(word, NOWHERE, problems)
        assert len(problems.reported) == 1, word


def test_every_function_of_the_language_is_a_word_of_it() -> None:
    assert set(FUNCTION_NAMES) <= reserved_words()["GRAMMAR"]


def test_the_sections_of_library_and_language_have_no_common_word() -> None:
    words = reserved_words()
    for section in words.keys() - {"C library"}:
        assert not words["C library"] & words[section], section


@pytest.mark.parametrize("name", ["a", "T_em", "x" * 31, "Z9_", "virtual_mass", "Unit", "value"])
def test_a_letter_then_letters_digits_and_underscores_is_a_name(name: str) -> None:
    assert complaints(name) == []


WRONG = ["", "_a", "9a", "x" * 32, "ä", "a-b", "a b", "a\n", "a\0", "a\u202e", "a*/"]
LOOK_ALIKES = ["\u0430", "K\u212a"]
"""A Cyrillic letter, and the sign of kelvin."""


@pytest.mark.parametrize("name", [*WRONG, *LOOK_ALIKES])
def test_anything_else_is_none(name: str) -> None:
    assert len(complaints(name)) == 1


@pytest.mark.parametrize(
    "name",
    ["main", "MAIN", "math", "nul", "COM1", "lpt9", "ha_math", "ha_page", "signal", "Limits"],
)
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
