"""Difference literal: a quantity that is a difference, such as a noise level or an amplitude."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

from language.expressions.units import Unit
from language.readers.base_reader import Reader
from language.text.diagnostic import Span
from language.text.document import YamlNode

LABEL = "a temperature in degC is a point, not a difference"
"""The label of the problem of `read_difference`."""
HINT = "write a difference in K"
"""The hint of the problem of `read_difference`."""


def read_difference(
    reader: Reader, node: YamlNode | None, what: str, span: Span, unit: Unit
) -> Fraction:
    """Return a literal in SI as a difference; a bare number is in `unit` without its offset.

    `what` names the literal and `span` places the problem if `node` is absent (reported, 0). A
    literal in a unit with an offset (degC) is reported, and its value as a point (273.15 K more) is
    returned. The sign is not checked.
    """
    own_zero = dataclasses.replace(unit, offset=Fraction(0))
    value, own = reader.read_quantity(node, what, span, own_zero)
    if own.offset:
        reader.problems.error("dimension", node.span if node else span, LABEL, HINT)
    return value
