"""Difference: a literal that is the width of something, not a point of a scale."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

from language.expressions.units import Unit
from language.reading.reader import Reader
from language.text.diagnostic import Span
from language.text.document import YamlNode

LABEL = "a temperature in degC is a point, not a difference"
HINT = "write a difference in K"


def read_difference(
    reader: Reader, node: YamlNode | None, what: str, span: Span, unit: Unit
) -> Fraction:
    """Return a literal in SI; a bare number is in `unit`, whose zero has no influence.

    One with a unit that has a zero of its own (degC) is a point: reported.
    """
    own_zero = dataclasses.replace(unit, offset=Fraction(0))
    value, own = reader.read_quantity(node, what, span, own_zero)
    if own.offset:
        reader.problems.error("dimension", node.span if node else span, LABEL, HINT)
    return value
