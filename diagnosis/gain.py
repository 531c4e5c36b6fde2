"""Linear: a model near a point, by differences of its compiled self: what its gain is made from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.predictor import Predictor

Reals = NDArray[np.float64]
LARGEST = 1e12
"""A difference quotient beyond this is no model any more."""
SMALLEST = 1e-9
"""Differences are at least this large: 1e7 times the rounding of a state near 1."""


@dataclass(frozen=True)
class Linear:
    """A model near a point: `phi` (states, states), `c` (seen, states), `b` (states, inputs)."""

    phi: Reals
    c: Reals
    b: Reals


def linearised(
    predictor: Predictor,
    page: Reals,
    inputs: Reals,
    mode: int,
    substeps: int,
    at: Reals,
    sizes: Reals,
) -> Linear | None:
    """Return the model over one sample near `at` by central differences of `sizes` (states,).

    None where it leaves all bounds within the sample.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        ahead, shown, b = _differences(predictor, page, inputs, mode, substeps, at, sizes)
    if not np.max(np.abs(np.hstack([ahead, b]))) < LARGEST:
        return None
    return Linear(ahead, shown @ np.linalg.pinv(ahead), b)


def _differences(
    predictor: Predictor,
    page: Reals,
    inputs: Reals,
    mode: int,
    substeps: int,
    at: Reals,
    sizes: Reals,
) -> tuple[Reals, Reals, Reals]:
    """Return how states and what is seen a sample later change with states and inputs."""
    count = len(at)
    ahead, shown = np.empty((count, count)), np.empty((len(predictor.seen), count))
    for column in range(count):
        size = max(sizes[column], SMALLEST)
        step = np.zeros(count)
        step[column] = size
        high, seen_high = predictor.advance(page, inputs, mode, substeps, at + step)
        low, seen_low = predictor.advance(page, inputs, mode, substeps, at - step)
        ahead[:, column] = (high - low) / (2.0 * size)
        shown[:, column] = (seen_high - seen_low) / (2.0 * size)
    b = np.empty((count, len(inputs)))
    for column in range(len(inputs)):
        step = np.zeros(len(inputs))
        step[column] = max(1e-4 * abs(inputs[column]), 1e-4)
        high, _ = predictor.advance(page, inputs + step, mode, substeps, at)
        low, _ = predictor.advance(page, inputs - step, mode, substeps, at)
        b[:, column] = (high - low) / (2.0 * step[column])
    return ahead, shown, b
