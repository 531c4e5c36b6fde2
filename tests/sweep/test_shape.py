"""What cannot be drawn from, or has no numbers, is refused where the study is checked."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest

from language.problem import SpecError
from sweep.shape import log_spaced
from tests.sweep.laying import study

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
        study("grid", (DRAWN, drawn))


def test_a_tail_that_has_digits_is_drawn_from() -> None:
    study("grid", (DRAWN, "{normal: [0 m, 1 m], within: [-9, -8]}"))
    study("grid", (DRAWN, "{lognormal: [1 m, 1], within: [-2, 2]}"))


def test_a_picture_of_no_measure_or_of_two_is_refused() -> None:
    for of in ("[]", "[peak, t_1]"):
        with pytest.raises(SpecError, match="a `tornado` is of one measure"):
            study("grid", ("{tornado: peak}", f"{{tornado: {of}}}"))
