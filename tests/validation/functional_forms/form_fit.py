"""Fit of a family of laws to a law of the generator, and what excites both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import chirp

from tests.generators.blind_cases.driver_model import smooth_hann
from tests.validation.functional_forms.library_forms import Array

MS = 0.001


@dataclass(frozen=True)
class LawComparison:
    """What the generator gives, what it gives without the effect, and the library's family.

    `law` takes the factors on `typical` values; `starts` are such factors.
    """

    truth: Array
    clean: Array
    law: Callable[[Array], Array]
    typical: Sequence[float]
    starts: Sequence[Sequence[float]] = ()

    def fit(self) -> tuple[float, Array]:
        """What the best fit leaves of the departure from clean [-], and its parameters."""
        typical = np.array(self.typical)

        def error(factors: Array) -> Array:
            return self.law(factors * typical) - self.truth

        ones = [1.0] * len(typical)
        found = [
            least_squares(error, start, x_scale=0.3, diff_step=1e-5, max_nfev=60)
            for start in (ones, *self.starts)
        ]
        best = min(found, key=lambda one: float(one.cost))
        return size(error(best.x)) / size(self.truth - self.clean), best.x * typical


def size(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def steps(seconds: float, step: float = 2 * MS) -> Array:
    """Demand in steps of several sizes, smoothed as a pedal does, then a sweep to 12 Hz [N*m]."""
    time = np.arange(0, seconds, step)
    levels = np.array([20.0, 60.0, 30.0, 150.0, 40.0, -60.0, 20.0])
    held = levels[np.minimum((time / seconds * 14).astype(int), 6)]
    sweep = 50 * chirp(time - seconds / 2, 0.5, seconds / 2, 12.0, "logarithmic", phi=-90)
    width = 0.06 * MS / step
    return np.asarray(smooth_hann(held, width) + np.where(time > seconds / 2, sweep, 0.0))
