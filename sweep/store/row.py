"""Rows of results: the status and the measures of a variant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sweep.evaluation.evaluate_measures import Cell

DONE, FAULT, STOPPED, REFUSED = "done", "fault", "stopped", "refused"
"""Status of a variant: finished; a fault bit is set; the run stopped; it cannot be simulated."""


@dataclass(frozen=True)
class Row:
    """The results of one variant.

    It has the indices in the study, the values [SI] of the variables, status, message and measures.
    """

    number: int
    variant: str
    scenario: str
    sample: int
    replicate: int
    seed: int
    values: Mapping[str, float]
    status: str
    message: str
    measures: Mapping[str, Cell]


@dataclass(frozen=True)
class Block:
    """The variants with numbers from `start` to `stop` (exclusive)."""

    start: int
    stop: int
