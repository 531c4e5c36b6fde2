"""Linearisation: a discrete linear model near a point, by differences of the compiled model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from codegen.predictor.predictor import Predictor
from diagnosis.data.array_types import Reals

MAX_QUOTIENT = 1e12
"""A larger difference quotient makes the linearisation invalid."""
MIN_STATE_STEP = 1e-9
"""Smallest step of a state as a fraction of its value, 1e7 times the rounding error."""
INPUT_STEP = 1e-4
"""Step of an input as a fraction of its magnitude."""

RCOND = 1e-15
"""Relative size below which a singular value counts as 0."""


@dataclass(frozen=True)
class LinearModel:
    """A linear model over one sample:

    `phi` (states, states), `c` (outputs, states), `b` (states, inputs).
    """

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
    input_sizes: Reals,
) -> LinearModel | None:
    """Return the linear model over one sample near `states` (states,) in a mode under `inputs`.

    The derivatives are central differences with the steps `state_steps` (states,), at least
    `MIN_STATE_STEP` times the states, and `INPUT_STEP` times `input_sizes` (inputs,), the
    magnitudes of the inputs; a magnitude of 0 counts as 1. `c` refers to the
    states at the end of the sample: the outputs' derivatives times the pseudoinverse of `phi`. The
    result is None if a derivative of a state reaches `MAX_QUOTIENT` (1e12) or is NaN.
    """
    steps = np.maximum(state_steps, MIN_STATE_STEP * np.abs(states))
    pushes = INPUT_STEP * np.where(input_sizes > 0.0, input_sizes, 1.0)
    phi, shown, b = predictor.compute_jacobians(
        calibration_page, inputs, mode, substeps, states, steps, pushes
    )
    if not all(np.max(np.abs(part), initial=0.0) < MAX_QUOTIENT for part in (phi, b)):
        return None
    return LinearModel(phi, shown @ _pseudoinverse(phi), b)


def _pseudoinverse(matrix: Reals) -> Reals:
    """Return the Moore-Penrose pseudoinverse,
    bit-identical to `numpy.linalg.pinv` in half its time.
    """
    left, sizes, right = np.linalg.svd(matrix, full_matrices=False)
    large = sizes > RCOND * np.max(sizes, initial=0.0)
    inverse = np.divide(1.0, sizes, out=np.zeros_like(sizes), where=large)
    found: Reals = right.T @ (inverse[:, None] * left.T)
    return found
