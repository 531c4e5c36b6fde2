"""Linear: a model near a point, by differences of its compiled self: what its gain is made from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from codegen.predictor.predictor import Predictor

Reals = NDArray[np.float64]
MAX_QUOTIENT = 1e12
"""A difference quotient beyond this is no model any more."""
MIN_STATE_STEP = 1e-9
"""Differences are at least this large: 1e7 times the rounding of a state near 1."""
INPUT_STEP = 1e-4
"""Change of an input for a difference, as a part of it; at least this many units."""

RCOND = 1e-15
"""A singular value that is a smaller part of the largest one is none."""


@dataclass(frozen=True)
class LinearModel:
    """A model near a point: `phi` (states, states), `c` (seen, states), `b` (states, inputs)."""

    phi: Reals
    c: Reals
    b: Reals


def linearise(
    predictor: Predictor,
    calibration_page: Reals,
    mode: int,
    substeps: int,
    states: Reals,
    inputs: Reals,
    state_steps: Reals,
) -> LinearModel | None:
    """Return the model over one sample near `states` (states,) in a mode under `inputs`.

    By central differences of `state_steps` (states,). None where they leave all bounds in the sample.
    """
    steps, pushes = (
        np.maximum(state_steps, MIN_STATE_STEP),
        np.maximum(INPUT_STEP * np.abs(inputs), INPUT_STEP),
    )
    phi, shown, b = predictor.compute_jacobians(
        calibration_page, inputs, mode, substeps, states, steps, pushes
    )
    if not all(np.max(np.abs(part), initial=0.0) < MAX_QUOTIENT for part in (phi, b)):
        return None
    return LinearModel(phi, shown @ _pseudoinverse(phi), b)


def _pseudoinverse(matrix: Reals) -> Reals:
    """Return the pseudoinverse, bit by bit as `numpy.linalg.pinv` finds it, in half of its time."""
    left, sizes, right = np.linalg.svd(matrix, full_matrices=False)
    large = sizes > RCOND * sizes[0]
    inverse = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=large)
    found: Reals = right.T @ (inverse[:, None] * left.T)
    return found
