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

NOTHING = 1e-15
"""A singular value that is a smaller part of the largest one is none."""


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
    if not all(np.max(np.abs(part), initial=0.0) < LARGEST for part in (phi, b)):
        return None
    return Linear(phi, shown @ _inverse(phi), b)


def _inverse(matrix: Reals) -> Reals:
    """Return the pseudoinverse, bit by bit as `numpy.linalg.pinv` finds it, in half of its time."""
    left, sizes, right = np.linalg.svd(matrix, full_matrices=False)
    large = sizes > NOTHING * sizes[0]
    inverse = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=large)
    found: Reals = right.T @ (inverse[:, None] * left.T)
    return found
