"""Linear: a model near a point, by differences of its compiled self: what its gain is made from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
LARGEST = 1e12
"""A difference quotient beyond this is no model any more."""
SMALLEST = 1e-9
"""Differences are at least this large: 1e7 times the rounding of a state near 1."""
PUSH = 1e-4
"""Change of an input for a difference, as a part of it; at least this many units."""


@dataclass(frozen=True)
class Linear:
    """A model near a point: `phi` (states, states), `c` (seen, states), `b` (states, inputs)."""

    phi: Reals
    c: Reals
    b: Reals


def linearised(
    advance: Callable[[Reals, Reals], tuple[Reals, Reals]], at: Reals, inputs: Reals, sizes: Reals
) -> Linear | None:
    """Return the model near states `at` by central differences of `sizes` (states,).

    `advance` gives the states a sample after some states under inputs, and what is then seen. None
    where they leave all bounds within the sample.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.diag(np.maximum(sizes, SMALLEST))
        pairs = [(advance(at + step, inputs), advance(at - step, inputs)) for step in steps]
        width = 2.0 * np.diag(steps)
        ahead = np.array([high[0] - low[0] for high, low in pairs]).T / width
        shown = np.array([high[1] - low[1] for high, low in pairs]).T / width
        pushes = np.diag(np.maximum(PUSH * np.abs(inputs), PUSH))
        ends = [(advance(at, inputs + push)[0], advance(at, inputs - push)[0]) for push in pushes]
        moved = np.array([high - low for high, low in ends]).reshape(len(inputs), len(at))
        b = moved.T / (2.0 * np.diag(pushes))
    if not np.max(np.abs(np.hstack([ahead, b]))) < LARGEST:
        return None
    return Linear(ahead, shown @ np.linalg.pinv(ahead), b)
