"""Sensing: a sensor as a small sampled automaton - lag, delay, noise, quantisation, sample."""

from __future__ import annotations

import hashlib
import math
from collections import deque
from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache

import numpy as np

from language.model.system import Sensor
from language.numerics.evaluate import apply_function

NOISE_CHUNK = 1024
"""Noise numbers drawn at once; the stream does not depend on it."""


@lru_cache(maxsize=1024)
def _decay(exponent: float) -> float:
    """Return e^-exponent by the language's own function: the same bits on every machine."""
    return float(apply_function("exp", [-exponent]))


class FirstOrderLag:
    """A lag of first order, exact for an input that is linear between the points it is told.

    L y' = u - y. With u = u0 + r s: y(h) = u(h) - r L + (y0 - u0 + r L) e^(-h / L).
    """

    def __init__(self, lag: Fraction) -> None:
        """Take the time constant [s]; 0: no lag."""
        self._lag = float(lag)
        self._time: Fraction | None = None
        self._input = 0.0
        self._value = 0.0

    def advance(self, time: Fraction, value: float) -> None:
        """Carry the lag on to a time with the input there; at the same time the input jumps.

        At the first time the lag is settled.
        """
        if self._time is None:
            self._value = value
        else:
            self._value = self.evaluate(time, value)
        self._time, self._input = time, value

    def evaluate(self, time: Fraction, value: float) -> float:
        """Return what the lag gives at a time with the input there, without moving it."""
        if self._lag == 0.0:
            return value
        if self._time is None or time <= self._time:
            return self._value
        h = float(time - self._time)
        slope = (value - self._input) * (self._lag / h)
        return value - slope + (self._value - self._input + slope) * _decay(h / self._lag)


def noise_stream(seed: int, name: str) -> Iterator[float]:
    """Yield normal numbers with variance 1: a stream per sensor, whatever else is simulated.

    Philox 4x64 (Salmon and others, Parallel random numbers: as easy as 1, 2, 3, SC 2011), keyed
    by the seed and the first 8 bytes of the SHA-256 of the sensor's name.
    """
    digest = hashlib.sha256(name.encode()).digest()
    key = np.array([seed, int.from_bytes(digest[:8], "little")], dtype=np.uint64)
    generator = np.random.Generator(np.random.Philox(key=key))
    while True:
        yield from generator.standard_normal(NOISE_CHUNK).tolist()


class SensorRun:
    """A sensor over time. `value` is its latest sample, `count` how many there were."""

    def __init__(self, sensor: Sensor, seed: int) -> None:
        """Take the sensor and the seed of the scenario."""
        self.sensor = sensor
        self.lag = FirstOrderLag(sensor.lag)
        self.value = 0.0
        self.count = 0
        self._on_the_way: deque[float] = deque()
        self._first = 0.0
        self._sd = float(sensor.noise)
        self._quantum = float(sensor.quantum)
        self._noise = noise_stream(seed, sensor.name)

    def start(self, measured: float) -> None:
        """Begin at time 0: until its first sample a sensor gives the first value, not new."""
        self.lag.advance(Fraction(0), measured)
        self._first = measured
        self.value = self._quantise(measured)

    def capture(self, time: Fraction, measured: float) -> None:
        """Keep what will arrive one delay later."""
        self._on_the_way.append(self.lag.evaluate(time, measured))

    def sample(self, time: Fraction, measured: float) -> None:
        """Take a sample: what was captured one delay ago, or what is there now."""
        if not self.sensor.delay:
            reading = self.lag.evaluate(time, measured)
        elif time < self.sensor.delay:
            reading = self._first
        else:
            reading = self._on_the_way.popleft()
        if self._sd:
            reading += self._sd * next(self._noise)
        self.value = self._quantise(reading)
        self.count += 1

    def evaluate(self, time: Fraction, measured: float) -> float:
        """Return what a sensor without `sample` gives at a time."""
        return self._quantise(self.lag.evaluate(time, measured))

    def _quantise(self, value: float) -> float:
        """floor(x / q + 1/2) * q (rule 19); what is not finite stays as it is."""
        if not self._quantum or not math.isfinite(value):
            return value
        return math.floor(value / self._quantum + 0.5) * self._quantum
