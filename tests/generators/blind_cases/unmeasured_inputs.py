"""What nobody records: road roughness, motor torque noise, slopes, unrecorded torques."""

from dataclasses import dataclass

import numpy as np

from tests.generators.blind_cases.solver import STEP_S, Array
from tests.generators.blind_cases.true_parameters import Base

GRAVITY = 9.81
WHEEL_RADIUS_M = 0.30


@dataclass(frozen=True)
class Slope:
    """Torques of the road's slope at the wheel [N*m], the change by wheel angle [rad]."""

    first: float
    last: float
    at: float
    length: float


@dataclass(frozen=True)
class Window:
    """A torque that nobody recorded: `brake` opposes motion, `hit` and `push` do not ask."""

    kind: str
    begin_s: float
    end_s: float
    torque: float


def coloured(rng: np.random.Generator, rows: int, sd: float, memory_s: float) -> Array:
    """Stationary noise of that standard deviation and correlation time, every STEP_S [N*m]."""
    decay = np.exp(-STEP_S / memory_s * np.arange(round(8.0 * memory_s / STEP_S)))
    kernel = decay / np.sqrt(np.sum(decay * decay))
    length = rows + len(kernel) - 1
    white = np.fft.rfft(rng.standard_normal(length))
    shaped = np.fft.irfft(white * np.fft.rfft(kernel, length), length)
    return np.asarray(sd * shaped[-rows:], dtype=np.float64)


def roughness(rng: np.random.Generator, rows: int) -> Array:
    """Road torque at the wheel, 2 to 5 N*m, 20 to 150 ms of correlation."""
    return coloured(rng, rows, rng.uniform(2.0, 5.0), rng.uniform(0.02, 0.15))


def motor_noise(rng: np.random.Generator, rows: int) -> Array:
    """Torque noise of the machine, 0.1 to 0.4 N*m, 3 to 10 ms of correlation."""
    return coloured(rng, rows, rng.uniform(0.1, 0.4), rng.uniform(0.003, 0.010))


def draw_slope(rng: np.random.Generator, base: Base) -> Slope:
    """Slopes of 1 to 5 % up or down, in half of the recordings changing by 1 to 3 %."""
    weight = base.J_v / WHEEL_RADIUS_M**2 * GRAVITY * WHEEL_RADIUS_M
    first = rng.choice([-1.0, 1.0]) * rng.uniform(0.01, 0.05)
    change = rng.choice([-1.0, 1.0]) * rng.uniform(0.01, 0.03) * (rng.random() < 0.5)
    at, length = rng.uniform(10.0, 120.0), rng.uniform(40.0, 160.0)
    return Slope(float(weight * first), float(weight * (first + change)), float(at), float(length))


def draw_windows(rng: np.random.Generator, seconds: float, certain: bool) -> tuple[Window, ...]:
    """None to two windows, at least one if `certain`, apart from each other."""
    count = int(rng.integers(1, 3)) if certain else int(rng.integers(0, 3))
    windows = []
    for index in range(count):
        kind = str(rng.choice(["brake", "hit", "push"]))
        low, high = {"brake": (0.5, 1.3), "hit": (0.06, 0.16), "push": (0.4, 1.0)}[kind]
        size = {"brake": (160.0, 420.0), "hit": (500.0, 1100.0), "push": (150.0, 350.0)}[kind]
        sign = 1.0 if kind == "brake" or rng.random() < 0.5 else -1.0
        begin = 0.5 + (seconds - 2.2) * (index + rng.uniform(0.1, 0.9)) / count
        end = begin + rng.uniform(low, high)
        windows.append(Window(kind, float(begin), float(end), float(sign * rng.uniform(*size))))
    return tuple(windows)


def window_torque(windows: tuple[Window, ...], rows: int, brake: bool) -> Array:
    """Sum of the windows that are brakes, or of the others [N*m] every STEP_S."""
    time = np.arange(rows) * STEP_S
    total = np.zeros(rows)
    for window in windows:
        if (window.kind == "brake") != brake:
            continue
        part = np.clip((time - window.begin_s) / (window.end_s - window.begin_s), 0.0, 1.0)
        bell = np.sin(np.pi * part)
        shape = bell if window.kind == "hit" else np.minimum(1.0, 2.5 * bell)
        total += window.torque * shape
    return total
