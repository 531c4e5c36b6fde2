"""What cannot be drawn from, or has no numbers, is refused where the study is checked."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from language.text.diagnostic import Problems, SpecError
from sweep.definition.distribution_check import log_spaced
from tests.sweep.example_studies import make_study

AXIS, DRAWN = "[0.1 1/s, 0.2 1/s, 0.4 1/s]", "{uniform: [0.5 m, 1.5 m]}"


def test_an_axis_of_any_ratio_has_equal_ratios() -> None:
    for first, last in ((1.0e-300, 1.0e300), (1.0e300, 1.0e-300)):
        found = log_spaced(Fraction(first), Fraction(last), 5)
        assert found[0] == pytest.approx(first, rel=1e-14)
        assert found[-1] == last
        assert found[2] == pytest.approx(1.0)
        assert math.log10(found[1]) == pytest.approx(math.log10(first) / 2.0)


def test_an_ordinary_axis_has_the_bits_of_powers() -> None:
    found = log_spaced(Fraction(1, 10), Fraction(20), 4)
    assert found == (*(0.1 * 200.0 ** (k / 3) for k in range(3)), 20.0)


@pytest.mark.parametrize(
    ("drawn", "told"),
    [
        ("{lognormal: [1 m, 1], within: [-2, -1]}", "`within` leaves nothing of this `lognormal`"),
        ("{normal: [0 m, 1 m], within: [50, 60]}", "`within` leaves nothing of this `normal`"),
        ("{normal: [0 m, 1 m], within: [8, 9]}", "`within` leaves nothing"),
        ("{uniform: [-1.7e308 m, 1.7e308 m]}", "farther apart than a number can tell"),
        ("{log_uniform: [1.0e-300 m, 1.0e300 m]}", "farther apart than a number can tell"),
        ("{choice: [1 m, 2 m], weights: [1.0e308, 1.0e308]}", "the sum of the `weights`"),
        ("{choice: [1 m, 2 m], weights: [1, -1]}", "`weights` above zero"),
        ("{normal: [0 m, 0 m]}", r"`normal` is `\[mean, standard deviation\]`"),
        ("{uniform: [1 m, 2 m], weights: [1]}", "`uniform` has no `weights`"),
    ],
)
def test_a_distribution_that_cannot_be_drawn_from_is_refused(drawn: str, told: str) -> None:
    with pytest.raises(SpecError, match=told):
        make_study("grid", (DRAWN, drawn))


def test_a_tail_that_has_digits_is_drawn_from() -> None:
    make_study("grid", (DRAWN, "{normal: [0 m, 1 m], within: [-9, -8]}"))
    make_study("grid", (DRAWN, "{lognormal: [1 m, 1], within: [-2, 2]}"))


def test_a_picture_of_no_measure_or_of_two_is_refused() -> None:
    for of in ("[]", "[peak, t_1]"):
        with pytest.raises(SpecError, match="a `tornado` is of one measure"):
            make_study("grid", ("{tornado: peak}", f"{{tornado: {of}}}"))


@pytest.mark.parametrize(
    ("drawn", "words"),
    [
        ("{choice: [1 m, 20 m], weights: [1, 9]}", "1 value of `x_1` never"),
        ("{choice: [1 m, 2 m, 3 m, 4 m, 5 m, 6 m]}", "2 values of `x_1` never"),
        ("{choice: [1 m, 20 m], weights: [1, 3]}", ""),
        (DRAWN, ""),
    ],
)
def test_values_that_no_path_draws_are_told(drawn: str, words: str) -> None:
    problems = Problems()
    make_study("grid", (DRAWN, drawn), ("{random: 4, seed: 3}", "{morris: 4}"), problems=problems)
    assert [words in one.label for one in problems.reported] == ([True] if words else [])


def test_a_value_that_cannot_be_read_does_not_stand_in_the_list_twice() -> None:
    with pytest.raises(SpecError) as refused:
        make_study("grid", (AXIS, "[0 1/s, 1e200 1/s, 1e201 1/s]"))
    assert [one.kind for one in refused.value.problems if one.kind == "duplicate"] == []


def test_a_confidence_next_to_1_is_refused() -> None:
    with pytest.raises(SpecError, match=r"`confidence` is a share from 0\.5 to 0\.999999"):
        make_study("grid", ("plots:", "summary: {confidence: 0.9999999999999999}\nplots:"))
