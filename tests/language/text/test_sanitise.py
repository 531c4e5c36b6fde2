"""Texts of users in output: no character controls a terminal, no cell is a formula."""

from __future__ import annotations

import pytest

from language.text.sanitise import escape_formula, escape_output


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("plain, Grüße 日本", "plain, Grüße 日本"),
        ("two\n\tlines", "two\n\tlines"),
        ("\x1b[31mred", r"\x1b[31mred"),
        ("\x9b31m", r"\x9b31m"),
        ("hidden\rshown", r"hidden\x0dshown"),
        ("\u202eturned\n", "\\u202eturned\n"),
        ("\u2066isolated", r"\u2066isolated"),
        ("line\u2028end", r"line\u2028end"),
        ("\x07\x00\ud800", r"\x07\x00\ud800"),
    ],
)
def test_output_keeps_line_feeds_and_tabs_only(text: str, expected: str) -> None:
    assert escape_output(text) == expected


@pytest.mark.parametrize(
    ("cell", "expected"),
    [
        ("=cmd|' /C calc'!A0", "'=cmd|' /C calc'!A0"),
        ("+1+1", "'+1+1"),
        ("-2+3", "'-2+3"),
        ("@SUM(A1)", "'@SUM(A1)"),
        ("\t=1", "'\t=1"),
        ("-1.5e3", "-1.5e3"),
        ("+2", "+2"),
        ("a=b", "a=b"),
        ("", ""),
    ],
)
def test_a_cell_of_csv_is_no_formula(cell: str, expected: str) -> None:
    assert escape_formula(cell) == expected
