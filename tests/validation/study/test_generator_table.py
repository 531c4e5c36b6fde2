"""The table of generators, and the page that is made of a study."""

from __future__ import annotations

import pytest

from tests.generators.blind_cases.case_specification import parse_order
from tests.generators.driveline_b.__main__ import order_cases
from tests.generators.open_cases.effect_catalogue import parse_effects
from tests.validation.study.generator_table import Generator, generators
from tests.validation.study.test_case_score import answer, verdict
from tests.validation.study.validation_page import render_page

COUNTS = {
    "blind_cases": lambda words, strength: len(parse_order(words, 1, strength, None)),
    "open_cases": lambda words, strength: len(parse_effects(words, 1)),
    "driveline_b": lambda words, strength: len(order_cases(words, 1, strength)),
}


@pytest.mark.parametrize("generator", [one for one in generators() if one.name in COUNTS])
def test_the_groups_are_in_the_words_of_the_generators(generator: Generator) -> None:
    counts = {
        group.name: COUNTS[generator.name](group.effects, group.strength)
        for group in generator.groups
    }
    assert list(counts) == ["full", "clean", "weak", "pairs", "removed"]
    assert counts["full"] >= 15 and counts["clean"] >= 8 and counts["pairs"] >= 4
    assert COUNTS[generator.name](generator.fixed, 1.0) == (
        12 if generator.name == "blind_cases" else 6
    )


def test_the_seeds_of_groups_differ() -> None:
    for generator in generators(7):
        assert [group.seed for group in generator.groups] == [*range(7, 7 + len(generator.groups))]


def test_a_third_of_the_fixed_cases_has_no_effect() -> None:
    for generator in generators():
        counts = {word.partition(":")[0]: int(word[-1]) for word in generator.fixed.split(",")}
        assert 3 * counts["none"] == sum(counts.values())


def test_the_page_has_all_figures_and_wrong_verdicts() -> None:
    some = [
        answer(("tyre_slip",), verdict("tyre_slip"), generator="blind_cases"),
        answer(("tyre_slip",), verdict("road_grade"), generator="open_cases"),
        answer((), verdict("road_grade"), "clean", generator="open_cases"),
    ]
    page = render_page(some, generators(), {"open_cases/full": "0123456789"})
    assert "| first name right | >= 88 % | 50.0 % (50.0 % to 50.0 %) | 100.0 % | 0.0 % |" in page
    assert "| `open_cases` | `full` | tyre_slip | road_grade |" in page
    assert "| `open_cases` | `clean` | none | road_grade |" in page
    assert "1 (`01234567`)" in page
    assert "| `FORM_ERROR` | 0.4 |" in page
