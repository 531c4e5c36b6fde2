"""A signal that goes through a cyclic CAN frame: sampled, held, late, with jitter."""

import numpy as np

from tests.generators.blind_cases.solver import STEP_S, Array


def sample_frames(
    values: Array, rng: np.random.Generator, period_s: float, jitter_s: float, late_s: float
) -> Array:
    """The held values every STEP_S; before the first frame the first value [any unit]."""
    if period_s <= 0.0:
        return values
    time = np.arange(len(values)) * STEP_S
    count = int((time[-1] + late_s) / period_s) + 3
    frames = (np.arange(count) - 1 + rng.random()) * period_s
    frames = frames + np.clip(
        jitter_s * rng.standard_normal(count), -0.45 * period_s, 0.45 * period_s
    )
    frames = np.sort(np.maximum(frames, -period_s))
    sampled = np.interp(frames, time, values)
    last = np.searchsorted(frames + late_s, time, side="right") - 1
    return np.asarray(np.where(last >= 0, sampled[np.maximum(last, 0)], values[0]))
