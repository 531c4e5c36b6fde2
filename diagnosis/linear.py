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
PUSH = 1e-4
"""Change of an input for a difference, as a part of it; at least this many units."""


@dataclass(frozen=True)
class Linear:
    """A model near a point: `phi` (states, states), `c` (seen, states), `b` (states, inputs)."""

    phi: Reals
    c: Reals
    b: Reals


def linearised(
    predictor: Predictor,
    page: Reals,
    mode: int,
    substeps: int,
    states: Reals,
    inputs: Reals,
    sizes: Reals,
) -> Linear | None:
    """Return the model over one sample near `states` (states,) in a mode under `inputs`.

    By central differences of `sizes` (states,). None where they leave all bounds in the sample.
    """
    steps, pushes = np.maximum(sizes, SMALLEST), np.maximum(PUSH * np.abs(inputs), PUSH)
    phi, shown, b = predictor.differences(page, inputs, mode, substeps, states, steps, pushes)
    if not np.max(np.abs(np.hstack([phi, b]))) < LARGEST:
        return None
    return Linear(phi, shown @ np.linalg.pinv(phi), b)
