"""Lookup tables: axes, values and units."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from language.expressions.units import Unit


@dataclass(frozen=True)
class Axis:
    """An axis of a table: its strictly ascending points in SI, exact, and their texts."""

    name: str
    unit: Unit
    points: tuple[Fraction, ...]
    point_texts: tuple[str, ...] = ()


@dataclass(frozen=True)
class LookupTable:
    """Values over one or two axes in SI, exact; the last axis varies fastest."""

    axes: tuple[Axis, ...]
    unit: Unit
    values: tuple[Fraction, ...]
