"""Digits: numbers as a reader wants them."""

from __future__ import annotations

import pytest

from diagnosis.report.number_text import (
    format_change,
    format_percent,
    format_significant,
    format_with_std,
)


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (3.7687, 0.0521, "3.769 ± 0.052"),
        (12744.3, 23.1, "12744 ± 23"),
        (12744.3, 231.0, "12740 ± 230"),
        (0.002022, 0.0000182, "0.002022 ± 0.000018"),
        (-45.2, 0.99, "-45.20 ± 0.99"),
        (45.2, 0.999, "45.2 ± 1.0"),
        (6000.0, 0.0, "6000"),
        (6000.0, float("nan"), "6000"),
    ],
)
def test_a_number_has_as_many_digits_as_are_known(value: float, std: float, text: str) -> None:
    assert format_with_std(value, std) == text


def test_numbers_are_told_without_exponents() -> None:
    assert [format_significant(x) for x in (1556.4, 0.021349, 0.0, 35.44, 0.99999)] == [
        "1560", "0.0213", "0", "35.4", "1.00",
    ]  # fmt: skip
    assert [format_percent(x) for x in (0.00228, 0.034, 0.113)] == ["0.23 %", "3.4 %", "11 %"]
    assert [format_change(2.0, x) for x in (1.0, 2.005, 3.0)] == [
        "\N{MINUS SIGN}50 %",
        "as before",
        "+50 %",
    ]
    assert format_change(0.0, 1.0) == format_change(float("nan"), 1.0) == "-"
