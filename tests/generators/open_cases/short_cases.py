"""Short cases for the tests: three brief recordings that show every effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tests.generators.open_cases.case import Case, SimulatedRecording, draw_case
from tests.generators.open_cases.manoeuvre import Manoeuvre

SECONDS = 1.2
THROUGH_ZERO = Manoeuvre(
    "through zero",
    SECONDS,
    -0.6,
    ([0.0, 0.1, 0.15, 0.5, 0.55, 0.95, 1.0], [0.0, 0.0, 70.0, 70.0, -60.0, -60.0, 20.0]),
)
FAST = Manoeuvre(
    "fast, with a stop",
    SECONDS,
    55.0,
    ([0.0, 0.1, 0.15, 0.5, 0.58, 0.8, 0.85], [20.0, 20.0, 130.0, 130.0, -80.0, -80.0, 0.0]),
    ([0.8, 0.85, 1.0, 1.05], [0.0, 500.0, 500.0, 0.0]),
)
SWEPT = Manoeuvre("sweep", SECONDS, 25.0, ([0.0], [40.0]), sweep=(20.0, 2.0, 14.0))


def short_case(effects: Sequence[str], strength: float = 1.0, rate: int | None = None) -> Case:
    """Return a case of seed 7 with the three short recordings, one of them held out."""
    case = draw_case(7, 0, effects, strength, rate)
    return replace(case, manoeuvres=(THROUGH_ZERO, FAST, SWEPT), train=2)


def largest_change(
    courses: Sequence[SimulatedRecording], others: Sequence[SimulatedRecording]
) -> float:
    """Return the largest rms difference of a recorded speed over the noise of the worst sensor."""
    changes = [
        np.sqrt(np.mean(np.square(one - other))) / noise
        for course, reference in zip(courses, others, strict=True)
        for one, other, noise in (
            (course.w_em, reference.w_em, 0.20),
            (course.w_w, reference.w_w, 0.04),
        )
    ]
    return float(max(changes))
