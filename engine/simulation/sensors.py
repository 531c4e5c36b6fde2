"""Sensors: lag, delay, noise, quantisation and sampling of a signal (rule 19)."""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from engine.interpreter.interpreter import Interpreter
from language.lowering.program_builder import FORMULA_RESULT
from language.model.system import Sensor
from language.programs.sensor_program import (
    ELAPSED,
    INPUT,
    LAST_INPUT,
    LAST_OUTPUT,
    RESOLUTION,
    TIME_CONSTANT,
    sensor_program,
)

NOISE_CHUNK = 1024
"""Number of noise values drawn at once; the stream does not depend on it."""


class FirstOrderLag:
    """State of the filter of a sensor, a first-order lag (language/programs/sensor_program.py)."""

    def __init__(self, lag: Fraction) -> None:
        """Take the time constant [s]; 0 means no lag."""
        self._lag = float(lag)
        self._time: Fraction | None = None
        self._input = 0.0
        self._value = 0.0
        self._elapsed: float | None = None
        self._numerics = Interpreter(sensor_program())
        self._numerics.set(TIME_CONSTANT, self._lag)

    def advance(self, time: Fraction, value: float) -> None:
        """Advance the lag to a time [s] at which the input is `value`.

        The input is linear since the last call. The first call sets the output to the input. A
        second call at the same time is a step of the input: the output is unchanged.
        """
        if self._time is None:
            self._value = value
        else:
            self._value = self.evaluate(time, value)
        self._time, self._input = time, value

    def evaluate(self, time: Fraction, value: float) -> float:
        """Return the output at a time [s] at which the input is `value`; the lag is not advanced.

        Without a lag this is `value`. Before the first `advance`, for a time that is not after the
        last one, and if the time between them is too short to divide by it, it is the present
        output.
        """
        if self._lag == 0.0:
            return value
        if self._time is None:
            return self._value
        numerics, elapsed = self._numerics, float(time - self._time)
        numerics.set(INPUT, value)
        numerics.set(LAST_INPUT, self._input)
        numerics.set(LAST_OUTPUT, self._value)
        if elapsed != self._elapsed:
            numerics.set(ELAPSED, elapsed)
            numerics.run("decay")
            self._elapsed = elapsed
        numerics.run("lag")
        return float(numerics.get(FORMULA_RESULT))


def philox_of(seed: int, name: str) -> np.random.Philox:
    """Return the generator of a named stream, keyed by the seed and the SHA-256 of the name."""
    digest = hashlib.sha256(name.encode()).digest()
    return np.random.Philox(key=np.array([seed, int.from_bytes(digest[:8], "little")], np.uint64))


def noise_stream(seed: int, name: str) -> Iterator[float]:
    """Yield standard normal numbers of the sensor `name`, without end.

    They depend on the seed and the name only. The generator is Philox 4x64 (Salmon and others,
    Parallel random numbers: as easy as 1, 2, 3, SC 2011), keyed by the seed and the first 8 bytes
    of the SHA-256 of the name.
    """
    generator = np.random.Generator(philox_of(seed, name))
    while True:
        yield from generator.standard_normal(NOISE_CHUNK).tolist()


class SensorRun:
    """State of a sensor in a run: `value` is its latest sample, `count` the number of samples."""

    def __init__(self, sensor: Sensor, seed: int) -> None:
        """Take the sensor and the seed of the scenario."""
        self.sensor = sensor
        self.lag = FirstOrderLag(sensor.lag)
        self.value = 0.0
        self.count = 0
        self._in_transit: deque[float] = deque()
        self._first = 0.0
        self._sd = float(sensor.noise)
        self._numerics = Interpreter(sensor_program())
        self._numerics.set(RESOLUTION, float(sensor.quantum))
        self._noise = noise_stream(seed, sensor.name)

    def start(self, measured: float) -> None:
        """Set the value before the first sample: the measured signal at time 0, quantised.

        It has no noise. The lag starts at this signal; `count` is unchanged.
        """
        self.lag.advance(Fraction(0), measured)
        self._first = measured
        self.value = self._quantise(measured)

    def capture(self, time: Fraction, measured: float) -> None:
        """Store the lagged signal at a time [s]; `sample` takes it one delay later."""
        self._in_transit.append(self.lag.evaluate(time, measured))

    def sample(self, time: Fraction, measured: float) -> None:
        """Set `value` to a sample at a time [s], with noise and then quantisation, and count it.

        Without a delay it is the lagged signal `measured` [SI]; the lag is not advanced. With a
        delay `measured` is not used: before one delay [s] it is the signal of `start`, without the
        lag, later the oldest captured value, which is removed (IndexError if there is none). Noise
        takes the next number of the stream; without noise no number is taken.
        """
        if not self.sensor.delay:
            reading = self.lag.evaluate(time, measured)
        elif time < self.sensor.delay:
            reading = self._first
        else:
            reading = self._in_transit.popleft()
        if self._sd:
            reading += self._sd * next(self._noise)
        self.value = self._quantise(reading)
        self.count += 1

    def evaluate(self, time: Fraction, measured: float) -> float:
        """Return the lagged and quantised signal at a time [s], for a sensor without `sample`.

        It has no noise, and the state of the sensor is unchanged.
        """
        return self._quantise(self.lag.evaluate(time, measured))

    def _quantise(self, value: float) -> float:
        """Return the multiple of the resolution next to a value (rule 19c)."""
        if not self.sensor.quantum:
            return value
        self._numerics.set(INPUT, value)
        self._numerics.run("quantise")
        return float(self._numerics.get(FORMULA_RESULT))
