"""Unit spellings: what the units that files write mean."""

from __future__ import annotations

import pytest

from language.expressions.unit_spellings import (
    NAMES,
    SYMBOL_WORDS,
    UNIT_EQUIVALENTS,
    UNIT_WORDS,
    unit_meanings,
)
from language.expressions.unit_symbols import SYMBOLS
from language.expressions.units import parse_unit

MEANT = {
    "N*m": "Nm NM N.m [Nm] (Nm) N\N{MIDDLE DOT}m",
    "kN*m": "kNm",
    "rpm": "RPM rpm Rpm 1/min min^-1 min-1 U/min /min r/min rev/min [1/min]",
    "km/h": "kph KPH km/h KM/H Km/h kmh",
    "deg/s": "deg/s \N{DEGREE SIGN}/s dps degree/s",
    "degC": "degC \N{DEGREE SIGN}C [\N{DEGREE SIGN}C] \N{DEGREE CELSIUS} Celsius DEGC",
    "1": "1 - -- [-] [] unitless Unitless",
    "percent": "% percent Percent pct [%]",
    "N*m*s/rad": "Nms/rad N*m*s/rad Nm/(rad/s) N.m.s/rad",
    "m/s^2": "m/s2 m/s^2 m/s\N{SUPERSCRIPT TWO} m/(s^2) m/s**2",
    "1/kg/m^2": "1/(kg*m^2) 1/(kg.m2)",
    "us": "us \N{MICRO SIGN}s usec",
    "ohm": "Ohm \N{OHM SIGN} ohms",
}
"""Units of the language, and spellings of files, separated by blanks."""


@pytest.mark.parametrize(
    ("written", "text"),
    [(word, text) for text, words in MEANT.items() for word in words.split()],
)
def test_a_spelling_of_a_file_is_understood(written: str, text: str) -> None:
    meant = unit_meanings(written)[0]
    unit = parse_unit(text)
    assert (meant.factor, meant.offset, meant.dimension) == (
        unit.factor,
        unit.offset,
        unit.dimension,
    )


@pytest.mark.parametrize("written", ["nm", "S", "mph", "psi", "foo", "xyz/s", "*s", "m//s", "N**m"])
def test_a_doubtful_or_unknown_text_has_no_meaning(written: str) -> None:
    assert unit_meanings(written) == ()


def test_turns_per_minute_are_a_speed_or_a_frequency() -> None:
    assert [unit.text for unit in unit_meanings("1/min")] == ["rpm", "1/min"]


def test_the_letter_c_is_a_temperature_or_a_charge() -> None:
    assert [unit.text for unit in unit_meanings("C")] == ["degC", "A*s"]


@pytest.mark.parametrize("symbol", sorted(SYMBOLS))
def test_each_symbol_of_the_language_means_itself(symbol: str) -> None:
    assert parse_unit(symbol) in unit_meanings(symbol)


def test_all_words_of_the_table_are_units() -> None:
    for text in {text for texts in UNIT_WORDS.values() for text in texts}:
        parse_unit(text)
    for text in (*SYMBOL_WORDS.values(), *NAMES.values()):
        parse_unit(text)
    for factor, text in UNIT_EQUIVALENTS.values():
        assert float(factor) > 0.0
        parse_unit(text)
    assert not any(unit_meanings(word) for word in UNIT_EQUIVALENTS)
