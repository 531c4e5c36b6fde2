"""Quantity: an estimated value with its unit and standard deviation."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """An estimated value [unit] with its standard deviation."""

    value: float
    unit: str
    std: float
