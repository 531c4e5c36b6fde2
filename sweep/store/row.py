"""One row of results: the outcome and the measures of a variant."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sweep.measurement.evaluate_measures import Cell

DONE, FAULT, STOPPED, REFUSED = "done", "fault", "stopped", "refused"
"""What became of a variant: fine; a fault bit is set; the run stopped; it cannot be simulated."""


@dataclass(frozen=True)
class Row:
    """One variant: its place in the study, what varies, what became of it, its measures."""

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
    """The variants from `start` to before `stop`."""

    start: int
    stop: int
