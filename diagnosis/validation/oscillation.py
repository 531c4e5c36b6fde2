"""Driveline oscillation (shuffle): frequency and damping after the largest step, cycle by cycle."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.innovations import predict

TREND_DEGREE = 3
"""Degree of the polynomial that is removed before an oscillation is sought."""
OBSERVED_TIME = 0.5
"""Shortest time [s] of observation before the step."""
MAX_TIME = 2.5
"""Longest time [s] after the step that is analysed."""
STEP_TIME = 0.06
"""Duration [s] of a step."""
MIN_FREQUENCY, MAX_FREQUENCY = 1.0, 25.0
"""Range of frequencies [Hz] that is searched."""
MIN_NOISE_RATIO = 8.0
"""Smallest amplitude of a cycle relative to the noise."""
MAX_ERROR_FRACTION = 0.35
"""Largest error of the model, relative to the amplitude at that time.

It is a phase error of 20 degrees, which is visible in a plot.
"""
LARGE_AMPLITUDE, SMALL_AMPLITUDE = 0.5, 0.25
"""Cycles above and below these fractions of the largest amplitude are compared."""
FREQUENCY_TOLERANCE = 0.02
"""Frequencies with a smaller relative difference are equal."""


@dataclass(frozen=True)
class Cycles:
    """Half-overlapping cycles: `times` [s] after the step, `frequencies` [Hz] and `amplitudes`."""

    times: Reals
    frequencies: Reals
    amplitudes: Reals

    def mean_frequency_after(self, time: float) -> float:
        """Return the mean frequency [Hz] of the cycles from a time [s] on; NaN without any."""
        late = self.frequencies[self.times >= time]
        return float(np.mean(late)) if len(late) else float("nan")

    def frequency_trend(self) -> float:
        """Return the mean frequency of small cycles over that of large ones, minus 1, or NaN."""
        part = self.amplitudes / max(float(np.max(self.amplitudes, initial=0.0)), 1e-300)
        large = self.frequencies[part > LARGE_AMPLITUDE]
        little = self.frequencies[part < SMALL_AMPLITUDE]
        if not len(large) or not len(little):
            return float("nan")
        return float(np.mean(little) / np.mean(large) - 1.0)

    def damping_ratio(self) -> float:
        """Return the damping ratio from the logarithmic decrement; NaN below three cycles."""
        if len(self.amplitudes) < 3:
            return float("nan")
        slope = np.polyfit(np.arange(len(self.amplitudes)), np.log(self.amplitudes), 1)[0]
        return float(-slope / np.pi)


@dataclass(frozen=True)
class Oscillation:
    """The clearest oscillation after a step at `start` [s], and how long [s] a model follows."""

    recording: str
    start: float
    signal: str
    followed_time: float
    length: float
    recorded: Cycles = field(repr=False)
    simulated: Cycles = field(repr=False)

    @property
    def has_other_frequency(self) -> bool:
        """Whether the frequency is another one after the model stops following."""
        rates = [
            one.mean_frequency_after(self.followed_time) for one in (self.recorded, self.simulated)
        ]
        known = all(np.isfinite(rates)) and self.followed_time < self.length
        return bool(known and abs(rates[0] / rates[1] - 1.0) > FREQUENCY_TOLERANCE)

    def format_sentence(self) -> str:
        """Return how long the model follows, and frequencies, trends and damping after that."""
        begin = f"after the step at {self.start:.2f} s of {self.recording}"
        if self.followed_time >= self.length:
            return f"{self.signal} fits to the end, {self.length:.2f} s {begin}"
        measured = self.recorded.mean_frequency_after(self.followed_time)
        model = self.simulated.mean_frequency_after(self.followed_time)
        text = f"{self.signal} fits until t = {self.followed_time:.2f} s {begin}"
        if not (np.isfinite(measured) and np.isfinite(model)):
            return text
        text += f", then the shuffle's frequency is {measured:.2f} Hz in the recording"
        text += f" and {model:.2f} Hz in the model"
        first, second = (one.frequency_trend() for one in (self.recorded, self.simulated))
        if abs(first - second) >= FREQUENCY_TOLERANCE:  # false for NaN
            word = "growing" if first > second else "falling"
            parts = f"{100.0 * first:+.0f} %, in the model {100.0 * second:+.0f} %"
            text += f", {word} as the amplitude falls ({parts})"
        first, second = (100.0 * one.damping_ratio() for one in (self.recorded, self.simulated))
        if abs(first - second) >= 0.5:
            text += f"; its damping {first:.1f} % and {second:.1f} %"
        return text


def analyse_oscillation(model: Estimate, series: Sequence[SampledRecording]) -> Oscillation | None:
    """Return the oscillation after the largest step, recorded and simulated freely.

    The model follows until two samples in a row have an error above `MAX_ERROR_FRACTION` of the
    amplitude and `MIN_NOISE_RATIO` times the noise. None without a step, two clear cycles in both,
    or a complete run.
    """
    place = _largest_step(series)
    if place is None:
        return None
    recording, start, end = place
    one = series[recording]
    masked = one.measured.copy()
    masked[start:end] = np.nan
    alone = dataclasses.replace(one, measured=np.ascontiguousarray(masked))
    values = model.values(recording)
    run = predict(model.candidate, [alone], [values], model.gains, model.noise_levels.huber_limits)
    if not run.is_complete:
        return None
    period, names = float(one.period), model.candidate.predictor.outputs
    measured, simulated = one.measured[start:end], run.predictions[0].outputs[start:end]
    width = _cycle_samples(simulated[:, 0], period)
    if width is None:
        return None
    waves = [_remove_moving_mean(measured[:, k], width) for k in range(len(names))]
    noise = model.noise_levels.outputs
    clear = [float(np.nanstd(wave)) / noise[k] for k, wave in enumerate(waves)]
    k = int(np.argmax(clear))
    cycles_pair = [
        _find_cycles(_remove_moving_mean(x[:, k], width), period, MIN_NOISE_RATIO * noise[k])
        for x in (measured, simulated)
    ]
    if not all(len(cycles.times) >= 2 for cycles in cycles_pair):
        return None
    times = np.arange(end - start) * period
    amplitude = np.interp(times, cycles_pair[0].times, cycles_pair[0].amplitudes)
    least = np.maximum(MAX_ERROR_FRACTION * amplitude, MIN_NOISE_RATIO * noise[k])
    missed = np.abs(measured[:, k] - simulated[:, k]) > least
    lasting = np.flatnonzero(missed[1:] & missed[:-1])
    length = (end - start) * period
    followed_time = float(lasting[0] * period) if len(lasting) else length
    start_time = float(one.start) + start * period
    return Oscillation(one.name, start_time, names[k], followed_time, length, *cycles_pair)


def _largest_step(series: Sequence[SampledRecording]) -> tuple[int, int, int] | None:
    """Return recording, sample and end of the largest input step relative to the input's range."""
    scale = np.max([np.ptp(one.inputs, axis=0) for one in series], axis=0)
    scale = np.where(scale > 0.0, scale, np.inf)
    best, found = 0.0, None
    for k, one in enumerate(series):
        period = float(one.period)
        few, first = max(1, round(STEP_TIME / period)), round(OBSERVED_TIME / period)
        steps = np.max(np.abs(one.inputs[few:] - one.inputs[:-few]) / scale, axis=1, initial=0.0)
        last = one.count - round(0.5 / period)
        if last <= first or not np.max(steps[first:last], initial=0.0) > best:
            continue
        start = first + int(np.argmax(steps[first:last]))
        best = float(steps[start])
        later = np.flatnonzero(steps[start + 3 * few :] > 0.3 * best)
        end = start + 3 * few + int(later[0]) if len(later) else one.count
        found = (k, start, min(end, one.count, start + round(MAX_TIME / period)))
    return found


def _cycle_samples(values: Reals, period: float) -> int | None:
    """Return the samples of a cycle of the strongest oscillation; None without one."""
    if len(values) <= TREND_DEGREE or not np.all(np.isfinite(values)):
        return None
    time = np.arange(len(values))
    rest = values - np.polyval(np.polyfit(time, values, TREND_DEGREE), time)
    rates = np.fft.rfftfreq(len(rest), period)
    power = np.abs(np.fft.rfft(rest * np.hanning(len(rest)))) ** 2
    power[(rates < MIN_FREQUENCY) | (rates > MAX_FREQUENCY)] = 0.0
    if not np.max(power) > 0.0:
        return None
    width = round(1.0 / (float(rates[int(np.argmax(power))]) * period))
    return width if 4 <= width < len(values) // 2 else None


def _remove_moving_mean(values: Reals, width: int) -> Reals:
    """Return a signal without its moving mean over one cycle, NaN at the ends."""
    known = np.isfinite(values)
    if not np.any(known):
        return np.full(len(values), np.nan)
    whole = np.interp(np.arange(len(values)), np.flatnonzero(known), values[known])
    kernel = np.full(width + 1 - width % 2, 1.0)
    if width % 2 == 0:
        kernel[0] = kernel[-1] = 0.5
    mean = np.convolve(whole, kernel / np.sum(kernel), mode="same")
    found = whole - mean
    found[: width // 2] = np.nan
    found[len(found) - width // 2 :] = np.nan
    return found


def _find_cycles(wave: Reals, period: float, min_gain: float) -> Cycles:
    """Return the cycles between zero crossings, until an amplitude is below `min_gain`."""
    known = np.flatnonzero(np.isfinite(wave))
    x, offset = wave[known], int(known[0]) if len(known) else 0
    places = np.flatnonzero(np.sign(x[1:]) * np.sign(x[:-1]) < 0.0)
    crossings = places + x[places] / (x[places] - x[places + 1])
    times, rates, amplitudes = [], [], []
    for low, high in zip(crossings[:-2], crossings[2:], strict=True):
        amplitude = float(np.max(np.abs(x[int(low) + 1 : int(high) + 1]), initial=0.0))
        if amplitude < min_gain:
            break
        times.append((offset + 0.5 * (low + high)) * period)
        rates.append(1.0 / ((high - low) * period))
        amplitudes.append(amplitude)
    return Cycles(np.array(times), np.array(rates), np.array(amplitudes))
