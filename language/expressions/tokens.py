"""Tokens of expressions: keywords and the patterns of numbers and units.

`expression.lark` has the same keywords; a test compares both.
"""

from __future__ import annotations

KEYWORDS = ("if", "then", "else", "and", "or", "not", "true", "false")
"""Words that are no names."""
KEYWORD_PATTERN = rf"(?:{'|'.join(KEYWORDS)})\b"
NUMBER_PATTERN = r"\d(?:[eE][-+]\d|[0-9A-Za-z_.])*"
"""A digit and what follows it; whether it is a number is checked when it is read."""
UNIT_PATTERN = r"(?:1/)?[A-Za-z]+(?:\^-?\d)?(?:[*/][A-Za-z]+(?:\^-?\d)?)*"
"""A unit as `parse_unit` reads it: factors with exponents, without blanks."""
