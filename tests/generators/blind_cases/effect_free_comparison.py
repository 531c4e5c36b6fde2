"""A case and its clean twin side by side, in units of the recorder's noise."""

from functools import cache

import numpy as np

from tests.generators.blind_cases.case import Case
from tests.generators.blind_cases.recording import Recording, simulate_motion
from tests.generators.blind_cases.solver import SUBSTEPS, Array, Motion


@cache
def case_of(effects: tuple[str, ...], strength: float = 1.0, number: int = 3) -> Case:
    """A case of seed 5 at 200 Hz."""
    return Case(5, number, effects, strength, 200)


@cache
def clean_recordings(number: int = 3) -> tuple[Recording, ...]:
    """Training recordings of that case, whatever its effects."""
    clean = case_of((), number=number)
    return tuple(one for one in clean.recordings if one.part == "train")


@cache
def motion_of(
    effects: tuple[str, ...], serial: int, strength: float = 1.0, substeps: int = SUBSTEPS
) -> Motion:
    """What the training recording `serial` moves."""
    return simulate_motion(case_of(effects, strength).physics, clean_recordings()[serial], substeps)


def rms_difference(one: Array, other: Array, scaled: bool) -> float:
    """Root mean square of the difference, after the best constant re-scaling if `scaled`."""
    gain = float(one @ other / (other @ other)) if scaled else 1.0
    return float(np.sqrt(np.mean((one - gain * other) ** 2)))


def contrast(effects: tuple[str, ...], serial: int, strength: float, scaled: bool = True) -> float:
    """Larger one of the two outputs' differences from the clean twin, over its noise [-]."""
    instruments = case_of(()).instruments
    motion, clean = motion_of(effects, serial, strength), motion_of((), serial)
    return max(
        rms_difference(motion.w_em, clean.w_em, scaled) / instruments.w_em.sd,
        rms_difference(motion.w_w, clean.w_w, scaled) / instruments.w_w.sd,
    )
