"""Term library: the terms from which a formula of an unknown disturbance may be built.

A term is an expression of the language with its values; one with an order is a sine of an angle.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

from diagnosis.data.array_types import Reals

ORDERS = (1, 2, 3, 4, 5, 6, 8, 9, 10, 12, 16, 18, 24, 36, 48)
"""Periods per turn that are tested."""
LAGS = (0.005, 0.02, 0.06)
"""Time constants [s] of lags that are tested."""
RISE_TIMES = (0.15, 0.4, 1.0)
"""Times [s] to the largest value at a limited rate that are tested."""
LIMIT_FRACTIONS = (0.4, 0.6, 0.8)
"""Limits that are tested, as fractions of the largest value."""


@dataclass(frozen=True)
class LibraryTerm:
    """A summand without its coefficient; with an `order`, `text` is the factor of a sine.

    `states` are name to unit and flow of added states; `th` is the angle of an order. `values` are
    the waves, (samples,) for each recording; a sine has two. `unit_expression` has the unit of a
    `text` that reads states.
    """

    name: str
    text: str
    values: tuple[tuple[Reals, ...], ...] = field(repr=False)
    states: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    order: int = 0
    per_recording: bool = False
    unit_expression: str = ""

    @property
    def has_recording_coefficients(self) -> bool:
        """Whether each recording has a coefficient or a phase of its own."""
        return self.per_recording or self.order > 0


@dataclass(frozen=True)
class Signals:
    """The values (samples,) of each recording, units and roles of the signals of terms."""

    values: Mapping[str, Sequence[Reals]] = field(repr=False)
    units: Mapping[str, str]
    speeds: tuple[str, ...]
    torques: tuple[str, ...]
    deflections: tuple[str, ...]
    angle_rates: tuple[str, ...]
    period: float

    def largest(self, name: str) -> float:
        """Return the largest magnitude of a signal over all recordings, or 1 if that is 0."""
        return float(max(np.max(np.abs(values)) for values in self.values[name])) or 1.0


def generate_terms(signals: Signals, section: str, output: str = "") -> Iterator[LibraryTerm]:
    """Yield the terms that may act at a place of a section, with their values.

    For "outputs" these are constants and terms of the signal `output`.
    """
    ones = [np.ones(len(values)) for values in next(iter(signals.values.values()))]
    yield _linear_term("a constant", "1", ones)
    yield LibraryTerm("a constant of each recording", "1", (tuple(ones),), per_recording=True)
    if section == "outputs":
        yield _linear_term(output, output, signals.values[output])
        yield from _lag_terms(signals, output)
        for rate in signals.angle_rates:
            yield from _order_terms(signals, rate, output, signals.values[output])
        return
    yield from _speed_terms(signals)
    for name in signals.torques:
        yield from _torque_terms(signals, name)
    for name in signals.deflections:
        yield from _power_terms(signals, name, (2, 3))
        yield from _lag_terms(signals, name)
    for rate in signals.angle_rates:
        yield from _order_terms(signals, rate, "1", ones)
        for name in signals.torques:
            yield from _order_terms(signals, rate, name, signals.values[name])


def _linear_term(name: str, text: str, values: Sequence[Reals]) -> LibraryTerm:
    """Return a term with one coefficient."""
    return LibraryTerm(name, text, (tuple(values),))


def _speed_terms(signals: Signals) -> Iterator[LibraryTerm]:
    """Yield the sign, the value and the square of each speed."""
    for name in signals.speeds:
        values, unit = signals.values[name], signals.units[name]
        bend = _round_two_digits(0.005 * signals.largest(name))
        sign = [np.tanh(x / bend) for x in values]
        yield _linear_term(f"the sign of {name}", f"tanh({name} / ({bend:g} {unit}))", sign)
        yield from _power_terms(signals, name, (1, 2))


def _power_terms(signals: Signals, name: str, powers: Sequence[int]) -> Iterator[LibraryTerm]:
    """Yield the value, the signed square and the cube of a signal, those in `powers`."""
    values = signals.values[name]
    forms = {
        1: (name, name, values),
        2: (f"the square of {name}", f"{name} * abs({name})", [x * np.abs(x) for x in values]),
        3: (f"the cube of {name}", f"{name}^3", [x**3 for x in values]),
    }
    yield from (_linear_term(*forms[power]) for power in powers)


def _torque_terms(signals: Signals, name: str) -> Iterator[LibraryTerm]:
    """Yield powers, limits, speed products, lags, rate limits and growth of a torque."""
    values = signals.values[name]
    yield from _power_terms(signals, name, (1, 2, 3))
    yield _linear_term(f"the amount of {name}", f"abs({name})", [np.abs(x) for x in values])
    unit = signals.units[name]
    for part in LIMIT_FRACTIONS:
        most = _round_two_digits(part * signals.largest(name))
        over = [x - np.clip(x, -most, most) for x in values]
        text = f"({name} - clip({name}, -{most:g} {unit}, {most:g} {unit}))"
        yield _linear_term(f"{name} beyond {most:g} {unit}", text, over)
    for speed in signals.speeds:
        yield from _torque_speed_terms(signals, name, speed)
    yield from _lag_terms(signals, name)
    yield from _rate_limit_terms(signals, name)
    clock, seconds = {"t": ("s", "der(t) = 1")}, f"{name} * (1 s)"
    growing = (tuple(x * signals.period * np.arange(len(x)) for x in values),)
    label, text = f"{name} that grows with time", f"{name} * t"
    yield LibraryTerm(label, text, growing, clock, unit_expression=seconds)


def _torque_speed_terms(signals: Signals, torque: str, speed: str) -> Iterator[LibraryTerm]:
    """Yield a loss that opposes the speed, the product of torque and speed, and power limits."""
    values = list(zip(signals.values[torque], signals.values[speed], strict=True))
    unit, of_speed = signals.units[torque], signals.units[speed]
    bend = _round_two_digits(0.005 * signals.largest(speed))
    sign = f"tanh({speed} / ({bend:g} {of_speed}))"
    lost = [np.abs(x) * np.tanh(w / bend) for x, w in values]
    yield _linear_term(f"the amount of {torque} against {speed}", f"abs({torque}) * {sign}", lost)
    yield _linear_term(f"{torque} times {speed}", f"{torque} * {speed}", [x * w for x, w in values])
    if (unit, of_speed) != ("N*m", "rad/s"):
        return
    power = max(float(np.max(np.abs(x * w))) for x, w in values)
    floor = _round_two_digits(0.02 * signals.largest(speed))
    for part in LIMIT_FRACTIONS:
        most = _round_two_digits(part * power)
        limit = [most / np.maximum(np.abs(w), floor) for _, w in values]
        over = [x - np.clip(x, -b, b) for (x, _), b in zip(values, limit, strict=True)]
        bound = f"{most:g} W / max(abs({speed}), {floor:g} {of_speed})"
        text = f"({torque} - clip({torque}, -({bound}), {bound}))"
        yield _linear_term(f"{torque} where its power is beyond {most:g} W", text, over)


def _lag_terms(signals: Signals, name: str) -> Iterator[LibraryTerm]:
    """Yield the differences between a first-order lag of a signal and the signal."""
    for lag in LAGS:
        late = [_low_pass(x, lag, signals.period) for x in signals.values[name]]
        less = [b - a for a, b in zip(signals.values[name], late, strict=True)]
        states = {"late": (signals.units[name], f"{lag:g} s * der(late) = {name} - late")}
        text = f"(late - {name})"
        label = f"{name} that is late by {1000 * lag:g} ms"
        yield LibraryTerm(label, text, (tuple(less),), states, unit_expression=name)


def _rate_limit_terms(signals: Signals, name: str) -> Iterator[LibraryTerm]:
    """Yield the differences between a rate-limited signal and the signal, for several rates."""
    unit = signals.units[name]
    for span in RISE_TIMES:
        rate = _round_two_digits(signals.largest(name) / span)
        less = [_limit_rate(x, rate * signals.period) - x for x in signals.values[name]]
        bound = f"({rate:g} {unit}) / (1 s)"
        flow = f"der(late) = clip(({name} - late) / (2 ms), -{bound}, {bound})"
        label = f"{name} that follows at most {rate:g} {unit}/s"
        states = {"late": (unit, flow)}
        yield LibraryTerm(label, f"(late - {name})", (tuple(less),), states, unit_expression=name)


def _limit_rate(values: Reals, max_change: float) -> Reals:
    """Return a signal that follows `values` by at most `max_change` a sample."""
    found, now = np.empty_like(values), float(values[0])
    for k, value in enumerate(values):
        now += min(max(float(value) - now, -max_change), max_change)
        found[k] = now
    return found


def _low_pass(values: Reals, lag: float, period: float) -> Reals:
    """Return a signal after a first-order lag with time constant `lag` [s]."""
    kept = np.exp(-period / lag)
    late, _ = lfilter([1.0 - kept], [1.0, -kept], values, zi=[kept * values[0]])
    return np.asarray(late, dtype=np.float64)


def _order_terms(
    signals: Signals, rate: str, name: str, factor: Sequence[Reals]
) -> Iterator[LibraryTerm]:
    """Yield waves of the orders of an angle below 0.3 of the sample rate, times a signal."""
    angles = [np.cumsum(w) * signals.period for w in signals.values[rate]]
    fastest = signals.largest(rate) / (2.0 * np.pi)
    for order in ORDERS:
        if order * fastest > 0.3 / signals.period:
            continue
        waves = [
            tuple(x * wave(order * angle) for x, angle in zip(factor, angles, strict=True))
            for wave in (np.sin, np.cos)
        ]
        label = f"order {order} of the angle of {rate}"
        label = label if name == "1" else f"{name} times {label}"
        turned = {"th": ("rad", f"der(th) = {rate}")}
        yield LibraryTerm(label, name, tuple(waves), turned, order)


def _round_two_digits(value: float) -> float:
    """Return a value rounded to two significant digits."""
    return float(f"{value:.2g}")
