"""Term: what a formula of something unknown may be made of - a text of the language with values.

Each has a coefficient of its own; a `phased` one is a sine of an angle, with a phase besides.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
ORDERS = (1, 2, 3, 4, 5, 6, 8, 9, 10, 12, 16, 18, 24, 36, 48)
"""Periods per turn that are tried."""
LAGS = (0.005, 0.02, 0.06)
"""Time constants [s] by which an input may be late."""
RISES = (0.15, 0.4, 1.0)
"""Times [s] in which the largest value may be reached at a limited rate."""
PARTS = (0.4, 0.6, 0.8)
"""Limits that are tried, as parts of the largest value."""


@dataclass(frozen=True)
class Term:
    """One summand without its coefficient.

    `text` is an expression; with an `angle` (a state that the term brings) it is what stands
    before the sine of `order` times that angle. `states` are those it brings: name to unit and
    balance. `values` (samples,) by recording; of a sine these are its two parts. `each`: one
    coefficient for every recording.
    """

    name: str
    text: str
    values: tuple[tuple[Reals, ...], ...] = field(repr=False)
    states: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    order: int = 0
    each: bool = False
    like: str = ""

    @property
    def has_own(self) -> bool:
        """Whether each recording has a coefficient or phase of its own."""
        return self.each or self.order > 0


@dataclass(frozen=True)
class Signals:
    """What terms are made of: names to values (samples,) of each recording, and their units."""

    values: Mapping[str, Sequence[Reals]] = field(repr=False)
    units: Mapping[str, str]
    speeds: tuple[str, ...]
    torques: tuple[str, ...]
    stretches: tuple[str, ...]
    angle_rates: tuple[str, ...]
    period: float

    def largest(self, name: str) -> float:
        """Return the largest amount of a signal."""
        return float(max(np.max(np.abs(values)) for values in self.values[name])) or 1.0


def terms_of(signals: Signals, section: str, shown: str = "") -> Iterator[Term]:
    """Yield the terms that may stand at a place; at an output `shown` is what it shows."""
    count = {name: [len(one) for one in values] for name, values in signals.values.items()}
    lengths = next(iter(count.values()))
    ones = [np.ones(n) for n in lengths]
    yield _plain("a constant", "1", ones)
    yield Term("a constant of each recording", "1", (tuple(ones),), each=True)
    if section == "outputs":
        yield from _of_signal(signals, shown)
        return
    yield from _of_speeds(signals)
    for name in signals.torques:
        yield from _of_torque(signals, name)
    for name in signals.stretches:
        yield from _powers(signals, name, (2, 3))
        yield from _late(signals, name)
    for rate in signals.angle_rates:
        yield from _of_angle(signals, rate, "1", ones)
        for name in signals.torques:
            yield from _of_angle(signals, rate, name, signals.values[name])


def _plain(name: str, text: str, values: Sequence[Reals]) -> Term:
    return Term(name, text, (tuple(values),))


def _of_signal(signals: Signals, shown: str) -> Iterator[Term]:
    yield _plain(shown, shown, signals.values[shown])
    yield from _late(signals, shown)
    for rate in signals.angle_rates:
        yield from _of_angle(signals, rate, shown, signals.values[shown])


def _of_speeds(signals: Signals) -> Iterator[Term]:
    for name in signals.speeds:
        values, unit = signals.values[name], signals.units[name]
        bend = _rounded(0.005 * signals.largest(name))
        sign = [np.tanh(x / bend) for x in values]
        yield _plain(f"the sign of {name}", f"tanh({name} / ({bend:g} {unit}))", sign)
        yield from _powers(signals, name, (1, 2))


def _powers(signals: Signals, name: str, powers: Sequence[int]) -> Iterator[Term]:
    values = signals.values[name]
    if 1 in powers:
        yield _plain(name, name, values)
    if 2 in powers:
        squares = [x * np.abs(x) for x in values]
        yield _plain(f"the square of {name}", f"{name} * abs({name})", squares)
    if 3 in powers:
        yield _plain(f"the cube of {name}", f"{name}^3", [x**3 for x in values])


def _of_torque(signals: Signals, name: str) -> Iterator[Term]:
    values = signals.values[name]
    yield from _powers(signals, name, (1, 2, 3))
    yield _plain(f"the amount of {name}", f"abs({name})", [np.abs(x) for x in values])
    unit = signals.units[name]
    for part in PARTS:
        most = _rounded(part * signals.largest(name))
        over = [x - np.clip(x, -most, most) for x in values]
        text = f"({name} - clip({name}, -{most:g} {unit}, {most:g} {unit}))"
        yield _plain(f"{name} beyond {most:g} {unit}", text, over)
    for speed in signals.speeds:
        yield from _of_both(signals, name, speed)
    yield from _late(signals, name)
    yield from _slow(signals, name)
    period = signals.period
    clock = {"t": ("s", "der(t) = 1")}
    growing = [x * period * np.arange(len(x)) for x in values]
    yield Term(
        f"{name} that grows with time",
        f"{name} * t",
        (tuple(growing),),
        clock,
        like=f"{name} * (1 s)",
    )


def _of_both(signals: Signals, torque: str, speed: str) -> Iterator[Term]:
    values = list(zip(signals.values[torque], signals.values[speed], strict=True))
    unit, of_speed = signals.units[torque], signals.units[speed]
    bend = _rounded(0.005 * signals.largest(speed))
    sign = f"tanh({speed} / ({bend:g} {of_speed}))"
    lost = [np.abs(x) * np.tanh(w / bend) for x, w in values]
    yield _plain(f"the amount of {torque} against {speed}", f"abs({torque}) * {sign}", lost)
    yield _plain(f"{torque} times {speed}", f"{torque} * {speed}", [x * w for x, w in values])
    power = max(float(np.max(np.abs(x * w))) for x, w in values)
    for part in PARTS:
        most = _rounded(part * power)
        floor = _rounded(0.02 * signals.largest(speed))
        limit = [most / np.maximum(np.abs(w), floor) for _, w in values]
        over = [x - np.clip(x, -b, b) for (x, _), b in zip(values, limit, strict=True)]
        bound = f"{most:g} W / max(abs({speed}), {floor:g} {of_speed})"
        text = f"({torque} - clip({torque}, -({bound}), {bound}))"
        if (unit, of_speed) == ("N*m", "rad/s"):
            yield _plain(f"{torque} where its power is beyond {most:g} W", text, over)


def _late(signals: Signals, name: str) -> Iterator[Term]:
    for lag in LAGS:
        late = [_lagged(x, lag, signals.period) for x in signals.values[name]]
        less = [b - a for a, b in zip(signals.values[name], late, strict=True)]
        states = {"late": (signals.units[name], f"{lag:g} s * der(late) = {name} - late")}
        text = f"(late - {name})"
        told = f"{name} that is late by {1000 * lag:g} ms"
        yield Term(told, text, (tuple(less),), states, like=name)


def _slow(signals: Signals, name: str) -> Iterator[Term]:
    """What follows at a limited rate: the rates that would take some tenths of a second."""
    unit = signals.units[name]
    for span in RISES:
        rate = _rounded(signals.largest(name) / span)
        less = [_followed(x, rate * signals.period) - x for x in signals.values[name]]
        bound = f"({rate:g} {unit}) / (1 s)"
        flow = f"der(late) = clip(({name} - late) / (2 ms), -{bound}, {bound})"
        told = f"{name} that follows at most {rate:g} {unit}/s"
        states = {"late": (unit, flow)}
        yield Term(told, f"(late - {name})", (tuple(less),), states, like=name)


def _followed(values: Reals, most: float) -> Reals:
    found, now = np.empty_like(values), float(values[0])
    for k, value in enumerate(values):
        now += min(max(float(value) - now, -most), most)
        found[k] = now
    return found


def _lagged(values: Reals, lag: float, period: float) -> Reals:
    kept = np.exp(-period / lag)
    found, now = np.empty_like(values), float(values[0])
    for k, value in enumerate(values):
        now = kept * now + (1.0 - kept) * float(value)
        found[k] = now
    return found


def _of_angle(signals: Signals, rate: str, name: str, factor: Sequence[Reals]) -> Iterator[Term]:
    angles = [np.cumsum(w) * signals.period for w in signals.values[rate]]
    fastest = signals.largest(rate) / (2.0 * np.pi)
    for order in ORDERS:
        if order * fastest > 0.3 / signals.period:
            continue
        waves = [
            tuple(x * wave(order * angle) for x, angle in zip(factor, angles, strict=True))
            for wave in (np.sin, np.cos)
        ]
        told = f"order {order} of the angle of {rate}"
        told = told if name == "1" else f"{name} times {told}"
        turned = {"th": ("rad", f"der(th) = {rate}")}
        yield Term(told, name, tuple(waves), turned, order)


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")
