"""Excitation: steps, bands and ranges of recorded signals, and the effects they can show."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from scipy.signal import welch

from diagnosis.data.array_types import Reals
from diagnosis.data_quality.channel import ChannelCheck, check_channel
from diagnosis.model.placed_effect import shipped_effects
from engine.recordings.recording import Channel, Recording, split_by_windows
from language.expressions.units import PURE_NUMBER, are_compatible, parse_unit
from language.loading.recording_map_reader import column_dimension

NEED_DESCRIPTIONS: Mapping[str, str] = {
    "fast": "steps or a sweep to 5 Hz or more",
    "sampled_fast": "a rate of 50 Hz or more",
    "torque_reverses": "an input that changes its sign",
    "speed_reverses": "a speed that passes through zero",
    "both_signs": "positive and negative input at the same speed",
    "speed_range": "a wide range of speed",
    "two_sizes": "steps of two sizes, one at least twice the other",
    "turns": "five turns or more",
    "moves": "motion for 2 s or more",
    "long": "a recording of 8 s or more",
    "power": "a large input at high and at low speed",
    "brakes": "a brake that is applied and let go",
}
"""Each need in words, as a manoeuvre."""


STEP_TIME = 0.06
"""A change within this time [s] is a step."""

STEP_SIZE = 0.15
"""Smallest size of a step, relative to the range of the signal."""

REVERSAL_FRACTION = 0.02
"""Fraction of its largest value that a signal must exceed on both sides of 0 to reverse."""

MAX_WINDOW = 512
"""Samples of a window of a spectrum."""

MIN_POWER_RATIO = 10.0
"""Power relative to that of the noise from which a frequency is excited."""

SPEEDS, POSITIONS = ("rad/s", "m/s"), ("rad", "m")


@dataclass(frozen=True)
class SignalExcitation:
    """The excitation of a signal: range and steps [SI], sign changes and bandwidth [Hz]."""

    name: str
    unit: str
    low: float
    high: float
    sign_changes: int
    steps: tuple[float, ...]
    band: float


@dataclass(frozen=True)
class EffectTestability:
    """Whether recordings can show an effect; `lacking` are the needs that are not met, in words."""

    effect: str
    lacking: tuple[str, ...]

    @property
    def is_testable(self) -> bool:
        """Whether all needs of the effect are met (`lacking` is empty)."""
        return not self.lacking


@dataclass(frozen=True)
class Excitation:
    """The excitation of all recordings: total time [s], inputs, speeds and the testable effects."""

    duration: float
    inputs: tuple[SignalExcitation, ...]
    speeds: tuple[SignalExcitation, ...]
    effects: tuple[EffectTestability, ...]

    @property
    def is_absent(self) -> bool:
        """Whether there are inputs and none of them has a step or an excited frequency."""
        idle = [not signal.steps and signal.band == 0.0 for signal in self.inputs]
        return bool(idle) and all(idle)

    @property
    def untestable(self) -> dict[str, list[str]]:
        """The effects that cannot be tested, by the needs that are not met, in words."""
        found: dict[str, list[str]] = {}
        for one in self.effects:
            if one.lacking:
                found.setdefault(" and ".join(one.lacking), []).append(one.effect)
        return found


def analyse_excitation(
    recordings: Sequence[Recording], checks: Sequence[ChannelCheck]
) -> Excitation:
    """Return the excitation of recordings, cut into the windows that are used.

    `checks` give the noise of channels. A recording without a speed has the rates of its positions
    instead; without another input, speeds that are inputs count as inputs.
    """
    used = [
        _with_derived_speeds(piece)
        for recording in recordings
        for piece in split_by_windows(recording)
    ]
    noise = {(check.recording, check.name): check for check in checks}
    names = dict.fromkeys(name for piece in used for name in piece.channels)
    inputs, speeds = [], []
    for name in names:
        channels = [(piece, piece.channels[name]) for piece in used if name in piece.channels]
        column = channels[0][1].column
        found = _signal_excitation(name, channels, noise)
        if is_speed(channels[0][1]):
            speeds.append(found)
        elif column.to is not None:
            inputs.append(found)
    if not inputs:  # A speed that is an input is the only excitation.
        inputs = [s for s in speeds if used[0].channels[s.name].column.to is not None]
    met = _met_needs(used, inputs, speeds, checks)
    effects = tuple(
        EffectTestability(one.name, tuple(NEED_DESCRIPTIONS[n] for n in one.needs if n not in met))
        for one in shipped_effects()
    )
    total = sum(float(piece.end - piece.start) for piece in used)
    return Excitation(total, tuple(inputs), tuple(speeds), effects)


def _with_derived_speeds(piece: Recording) -> Recording:
    """Return a recording with rates of its positions as channels, if it has no speed."""
    if any(is_speed(channel) for channel in piece.channels.values()):
        return piece
    found = dict(piece.channels)
    for name, channel in piece.channels.items():
        per = [parse_unit(f"{text}/s") for text in POSITIONS if _has_dimension_of(channel, text)]
        if per and len(channel.values) > 2:
            column = replace(channel.column, unit=per[0], to=None, scale=(Fraction(1), PURE_NUMBER))
            rate = np.gradient(channel.array, channel.seconds)
            found[f"rate of {name}"] = Channel(column, channel.times, tuple(rate.tolist()))
    return replace(piece, channels=found)


def is_speed(channel: Channel) -> bool:
    """Return whether the dimension of a channel's unit is that of rad/s or m/s."""
    return any(_has_dimension_of(channel, text) for text in SPEEDS)


def _has_dimension_of(channel: Channel, unit: str) -> bool:
    """Return whether the dimension of a channel is that of a unit."""
    return are_compatible(column_dimension(channel.column), parse_unit(unit).dimension)


def _signal_excitation(
    name: str,
    channels: Sequence[tuple[Recording, Channel]],
    checks: Mapping[tuple[str, str], ChannelCheck],
) -> SignalExcitation:
    """Return the excitation of one signal over all recordings that have it."""
    every = np.concatenate([channel.array for _, channel in channels])
    low, high = float(every.min()), float(every.max())
    steps: list[float] = []
    changes, band = 0, 0.0
    for recording, channel in channels:
        check = checks.get((recording.name, name)) or check_channel(recording, channel)
        floor = max(check.noise, check.quantum / np.sqrt(12.0), 1e-9 * max(abs(low), abs(high)))
        steps += _step_sizes(channel.seconds, channel.array, high - low, floor)
        changes += _count_sign_changes(channel.array, max(abs(low), abs(high)), floor)
        band = max(band, _excited_bandwidth(channel.array, check.rate, floor))
    return SignalExcitation(
        name, channels[0][1].column.unit.text, low, high, changes, tuple(steps), band
    )


def _step_sizes(times: Reals, values: Reals, span: float, floor: float) -> list[float]:
    """Return the signed sizes of changes within `STEP_TIME` well above the noise `floor`."""
    if len(values) < 3 or span <= 6.0 * floor:
        return []
    later = np.minimum(np.searchsorted(times, times + STEP_TIME), len(times) - 1)
    change = values[later] - values
    large = np.flatnonzero(np.abs(change) > max(STEP_SIZE * span, 6.0 * floor))
    found, free = [], 0
    for k in large.tolist():
        if k >= free:
            inside = change[k : later[k] + 1]
            found.append(float(inside[np.argmax(np.abs(inside))]))
            free = 2 * int(later[k]) - k + 1
    return found


def _count_sign_changes(values: Reals, largest: float, floor: float) -> int:
    """Return the number of sign changes beyond noise."""
    bound = max(REVERSAL_FRACTION * largest, 4.0 * floor)
    signs = np.sign(values[np.abs(values) > bound])
    return int(np.sum(np.diff(signs) != 0.0))


def _excited_bandwidth(values: Reals, rate: float, floor: float) -> float:
    """Return the highest frequency [Hz] with power well above the noise; 0 for a short signal."""
    if len(values) < 64 or not rate:
        return 0.0
    frequencies, power = spectrum(values, rate, MAX_WINDOW)
    excited = frequencies[1:][power[1:] > MIN_POWER_RATIO * 2.0 * floor**2 / rate]
    return float(excited.max()) if len(excited) else 0.0


def _met_needs(
    used: Sequence[Recording],
    inputs: Sequence[SignalExcitation],
    speeds: Sequence[SignalExcitation],
    checks: Sequence[ChannelCheck],
) -> set[str]:
    """Return the needs that recordings meet."""
    sizes = [abs(size) for signal in inputs for size in signal.steps]
    pairs = list(itertools.product(inputs, speeds))
    tests = {
        "fast": any(signal.steps or signal.band >= 5.0 for signal in inputs),
        "sampled_fast": max((check.rate for check in checks), default=0.0) >= 49.0,
        "torque_reverses": any(signal.sign_changes for signal in inputs),
        "speed_reverses": any(signal.sign_changes for signal in speeds),
        "two_sizes": bool(sizes) and max(sizes) >= 2.0 * min(sizes),
        "speed_range": any(
            signal.high - signal.low > 0.4 * max(abs(signal.high), abs(signal.low))
            for signal in speeds
        ),
        "long": any(piece.end - piece.start >= 8 for piece in used),
        "turns": any(_revolutions(used, signal) >= 5.0 for signal in speeds),
        "moves": any(_time_moving(used, signal) >= 2.0 for signal in speeds),
        "brakes": any(_is_brake(signal) for signal in inputs),
        "both_signs": any(_has_both_signs_at_one_speed(used, *pair) for pair in pairs),
        "power": any(_has_power_range(used, *pair) for pair in pairs),
    }
    return {need for need, is_met in tests.items() if is_met}


def _is_brake(signal: SignalExcitation) -> bool:
    """Return whether an input is never negative and has at least two steps."""
    is_positive = signal.high > 0.0 and signal.low >= -REVERSAL_FRACTION * signal.high
    return is_positive and len(signal.steps) >= 2


def _revolutions(used: Sequence[Recording], signal: SignalExcitation) -> float:
    """Return the number of turns in both directions [1] by the integral of a speed's magnitude."""
    channels = _channels_of(used, signal)
    angle = sum(float(np.trapezoid(np.abs(c.array), c.seconds)) for c in channels)
    return angle / (2.0 * np.pi)


def _time_moving(used: Sequence[Recording], signal: SignalExcitation) -> float:
    """Return the time [s] for which a speed exceeds 5 % of its largest magnitude."""
    limit = 0.05 * max(abs(signal.low), abs(signal.high))
    channels = _channels_of(used, signal)
    steps = [np.diff(c.seconds)[np.abs(c.array[1:]) > limit] for c in channels]
    return float(sum(moving.sum() for moving in steps))


def _channels_of(used: Sequence[Recording], signal: SignalExcitation) -> list[Channel]:
    """Return the channels of a signal with at least two values."""
    channels = [piece.channels.get(signal.name) for piece in used]
    return [channel for channel in channels if channel and len(channel.array) > 1]


def _paired_samples(
    used: Sequence[Recording], first: SignalExcitation, second: SignalExcitation
) -> tuple[Reals, Reals]:
    """Return an input and a speed at the same times, all recordings concatenated."""
    one, two = [], []
    for piece in used:
        a, b = piece.channels.get(first.name), piece.channels.get(second.name)
        if a and b:
            one.append(a.array)
            two.append(np.interp(a.seconds, b.seconds, b.array))
    return np.concatenate(one or [np.zeros(0)]), np.concatenate(two or [np.zeros(0)])


def _has_both_signs_at_one_speed(
    used: Sequence[Recording], first: SignalExcitation, second: SignalExcitation
) -> bool:
    """Return whether each sign has a tenth of the samples of one of eight speed classes."""
    torque, speed = _paired_samples(used, first, second)
    if not len(torque) or second.low == second.high:
        return False
    bound = 0.1 * max(abs(first.low), abs(first.high))
    edges = np.linspace(second.low, second.high, 9)[1:-1]
    classes = np.digitize(speed, edges)
    shares = [
        float(min(np.mean(torque[classes == k] > bound), np.mean(torque[classes == k] < -bound)))
        for k in np.unique(classes)
    ]
    return max(shares) > 0.1


def _has_power_range(
    used: Sequence[Recording], first: SignalExcitation, second: SignalExcitation
) -> bool:
    """Return whether more than 60 % of the largest input occurs at high and at low speed."""
    torque, speed = _paired_samples(used, first, second)
    largest = max(abs(second.low), abs(second.high))
    strong = np.abs(torque) > 0.6 * max(abs(first.low), abs(first.high))
    fast = np.abs(speed) > 0.6 * largest
    return bool((strong & fast).any() and (strong & ~fast).any())


def spectrum(values: Reals, rate: float, max_window: int) -> tuple[Reals, Reals]:
    """Return frequencies [Hz] and one-sided power spectral density (Welch 1967) at `rate` [Hz].

    Hann windows of `max_window` samples (all if fewer) overlap by half.
    """
    length = min(len(values), max_window)
    frequencies, power = welch(
        values, rate, np.hanning(length), noverlap=length // 2, detrend="constant"
    )
    return frequencies, power
