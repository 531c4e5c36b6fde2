"""Reference motions that a test engineer drives, and recordings planned from them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .machines import Machine
from .simulation import Array

REST = 0.25  # s, at the start of each recording
MOST_SAMPLES = 12000


@dataclass(frozen=True)
class Plan:
    """A recording before it is run: the reference (4, n) and the noise (n, ny)."""

    kind: str
    reference: Array  # place, speed, acceleration, injected force
    noise: Array

    @property
    def n(self) -> int:
        """Number of samples."""
        return int(self.reference.shape[1])


Speed = Callable[[np.random.Generator, Array, Machine], Array]


def _trapezoids(
    t: Array,
    m: Machine,
    target: Callable[[float], float],
    speed: Callable[[], float],
    pause: Callable[[], float],
) -> Array:
    """Speed of moves to `target(place)` with peak speeds and pauses between the moves."""
    times, speeds, x = [0.0, REST], [0.0, 0.0], 0.0
    while times[-1] < t[-1]:
        way = target(x) - x
        accel = 0.8 * m.a_max
        peak = min(speed(), (abs(way) * accel) ** 0.5)
        ramp = peak / accel
        flat = abs(way) / peak - ramp
        for duration, v in ((ramp, peak), (flat, peak), (ramp, 0.0), (pause(), 0.0)):
            times.append(times[-1] + duration)
            speeds.append(float(np.copysign(v, way)))
        x += way
    return np.interp(t, times, speeds)


def _targets(rng: np.random.Generator, m: Machine, least: float) -> Callable[[float], float]:
    """Random places in the travel, at least the fraction `least` of its half away."""

    def draw(x: float) -> float:
        while True:
            place = m.half * rng.uniform(-0.9, 0.9)
            if abs(place - x) > least * m.half:
                return float(place)

    return draw


def _moves(rng: np.random.Generator, t: Array, m: Machine) -> Array:
    def speed() -> float:
        return m.v_max * rng.uniform(0.3, 1.0)

    return _trapezoids(t, m, _targets(rng, m, 0.2), speed, lambda: rng.uniform(0.05, 0.5))


def _cycle(rng: np.random.Generator, t: Array, m: Machine) -> Array:
    end, dwell, fast = m.half * rng.uniform(0.6, 0.9), rng.uniform(0.1, 0.4), rng.uniform(0.85, 1)
    return _trapezoids(
        t, m, lambda x: -end if x > 0 else end, lambda: m.v_max * fast, lambda: dwell
    )


def _crawl(rng: np.random.Generator, t: Array, m: Machine) -> Array:
    end = m.half * rng.uniform(0.03, 0.1)

    def speed() -> float:
        return m.v_max * float(rng.choice([0.02, 0.04, 0.08, 0.15]))

    return _trapezoids(t, m, lambda x: -end if x > 0 else end, speed, lambda: 0.05)


def _slow(rng: np.random.Generator, t: Array, m: Machine) -> Array:
    def speed() -> float:
        return m.v_max * rng.uniform(0.15, 0.4)

    return _trapezoids(t, m, _targets(rng, m, 0.5), speed, lambda: 0.02)


def _jog(rng: np.random.Generator, t: Array, m: Machine) -> Array:
    times, speeds, x = [0.0, REST], [0.0, 0.0], 0.0
    while times[-1] < t[-1]:
        v = m.v_max * rng.uniform(0.1, 0.9) * (rng.choice([-1, 1]) if abs(x) < 0.2 * m.half else 1)
        v = -float(np.copysign(v, x)) if abs(x) >= 0.2 * m.half else float(v)
        ramp = abs(v - speeds[-1]) / m.a_max
        room = m.half * 0.9 - x * float(np.sign(v))
        hold = min(rng.uniform(0.2, 1.0), max(0.02, room / abs(v) - 2 * ramp))
        x += (speeds[-1] + v) / 2 * ramp + v * hold
        times += [times[-1] + ramp, times[-1] + ramp + hold]
        speeds += [v, v]
    return np.interp(t, times, speeds)


def _multisine(rng: np.random.Generator, t: Array, m: Machine) -> Array:
    f = np.sort(rng.uniform(0.3, 4.5, 7))
    phase = rng.uniform(0, 2 * np.pi, 7)
    late = np.maximum(t - REST, 0)
    place = np.sum(np.sin(2 * np.pi * f[:, None] * late + phase[:, None]) / f[:, None], axis=0)
    place = (place - place[0]) * np.minimum(late / 1.0, 1) ** 2 * (3 - 2 * np.minimum(late, 1))
    v = np.gradient(place, t)
    scale = min(
        rng.uniform(0.6, 0.95) * m.v_max / np.abs(v).max(),
        0.9 * m.half / np.abs(place).max(),
        0.8 * m.a_max / np.abs(np.gradient(v, t)).max(),
    )
    return np.asarray(scale * v)


def _none(rng: np.random.Generator, t: Array, m: Machine) -> Array:
    del rng, m
    return np.zeros_like(t)


def _chirp(rng: np.random.Generator, t: Array, m: Machine) -> Array:
    low, high = m.w_high * rng.uniform(0.1, 0.4), m.w_high * rng.uniform(1.15, 1.4)
    span = t[-1] - REST
    late = np.clip(t - REST, 0, span)
    phase = low * late + (high - low) * late**2 / (2 * span)
    return np.asarray(m.f_max * rng.uniform(0.3, 0.5) * np.sin(phase))


def _binary(rng: np.random.Generator, t: Array, m: Machine) -> Array:
    clock = rng.uniform(1.0, 3.0) * 2 * np.pi / m.w_high / 2  # s
    bits = rng.choice([-1.0, 1.0], int(t[-1] / clock) + 2)
    force = m.f_max * rng.uniform(0.15, 0.35) * bits[(t / clock).astype(int)]
    return np.where(t > REST, force, 0)


def _bumps(rng: np.random.Generator, t: Array, m: Machine) -> Array:
    force, at = np.zeros_like(t), REST + 0.1
    while at < t[-1]:
        width = rng.uniform(1.0, 4.0) / (m.w_high / (2 * np.pi))
        shape = np.sin(np.pi * np.clip((t - at) / width, 0, 1))
        force += m.f_max * rng.uniform(0.3, 0.6) * rng.choice([-1, 1]) * shape
        at += width + rng.uniform(0.2, 0.6)
    return force


KINDS: dict[str, tuple[Speed, Speed]] = {  # speed and injected force
    "moves": (_moves, _none),
    "cycle": (_cycle, _none),
    "crawl": (_crawl, _none),
    "jog": (_jog, _none),
    "multisine": (_multisine, _none),
    "sweep": (_slow, _chirp),
    "binary": (_slow, _binary),
    "bumps": (_slow, _bumps),
}


def draw_plan(rng: np.random.Generator, m: Machine, kind: str) -> Plan:
    """A recording of this kind, 4 to 20 s long, with fresh noise."""
    longest = min(20.0, max(4.0, MOST_SAMPLES / m.rate))
    n = int(rng.uniform(4.0, longest) * m.rate)
    t = np.arange(n) / m.rate
    motion, force = KINDS[kind]
    v = motion(rng, t, m)
    a = np.append(np.diff(v), 0) * m.rate
    x = np.append(0, np.cumsum((v[1:] + v[:-1]) / 2)) / m.rate
    noise = rng.standard_normal((n, len(m.noise))) * np.array(m.noise)
    return Plan(kind, np.array([x, v, a, force(rng, t, m)]), noise)


def draw_plans(rng: np.random.Generator, m: Machine) -> tuple[list[Plan], list[Plan]]:
    """Plans for training (5 to 8, each of another kind) and for holding out (3)."""
    fast = ["sweep", "binary", "moves"]
    rest = [k for k in KINDS if k not in fast]
    kinds = fast + [str(k) for k in rng.permutation(rest)[: int(rng.integers(2, 6))]]
    train = [draw_plan(rng, m, str(k)) for k in rng.permutation(kinds)]
    held_out = [draw_plan(rng, m, str(k)) for k in rng.permutation(list(KINDS))[:3]]
    return train, held_out
