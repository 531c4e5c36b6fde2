"""Units of the parameters of effects: readable texts of the right dimension."""

from __future__ import annotations

import pytest
from hypothesis import given, strategies as st

from language.expressions.units import SECOND, Dimension, parse_unit
from language.overlays.name_types import format_rate_unit, format_si_unit

DIMENSIONS = st.builds(
    Dimension,
    st.tuples(*[st.integers(-3, 3)] * 5),
    st.integers(-2, 2),
)


def rate_of(dimension: Dimension) -> Dimension:
    """The dimension of a quantity per second."""
    powers = zip(dimension.powers, SECOND.powers, strict=True)
    return Dimension(tuple(one - time for one, time in powers), dimension.angle)


@pytest.mark.parametrize(
    ("unit", "rate"),
    [
        ("N*m", "N*m/s"),
        ("N", "N/s"),
        ("V", "V/s"),
        ("A", "A/s"),
        ("K", "K/s"),
        ("Pa", "Pa/s"),
        ("rad/s", "rad/s/s"),
        ("m/s", "m/s/s"),
        ("1", "1/s"),
    ],
)
def test_the_rate_of_a_quantity_is_its_unit_per_second(unit: str, rate: str) -> None:
    quantity = parse_unit(unit).dimension
    text = format_rate_unit(quantity, rate_of(quantity))
    assert parse_unit(text).dimension == parse_unit(rate).dimension
    assert text == rate or "/s/s" in rate


@given(DIMENSIONS)
def test_the_text_of_a_unit_has_its_dimension(dimension: Dimension) -> None:
    for text, expected in (
        (format_si_unit(dimension), dimension),
        (format_rate_unit(dimension, rate_of(dimension)), rate_of(dimension)),
    ):
        assert parse_unit(text).factor == 1
        assert parse_unit(text).dimension.powers == expected.powers
