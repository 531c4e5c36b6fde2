"""Driving: a small driveline, recordings of it that we made ourselves, and ways to spoil them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from diagnosis.data_quality.output_comparison import simulate_free_run
from engine.recordings.recording import Channel, Recording
from language.loading.load import automaton_of, command_line_value
from language.loading.recording_map_reader import read_map
from language.model.automaton import Automaton
from language.model.system import RecordingMap
from language.overlays.expand_document import Project
from language.text.diagnostic import Source
from language.text.document import Document
from language.text.project_files import parse_document

Values = NDArray[np.float64]
Spoil = Callable[[Values, dict[str, Values]], None]
RATE = 100
SPEC = """\
language: 1
automaton: small_driveline
step: 5 ms
parameters:
  R:    {value: 9}
  J_em: {value: 0.05 kg*m^2}
  k:    {value: 6000 N*m/rad}
  c:    {value: 100 N*m*s/rad}
  J_v:  {value: 135 kg*m^2}
  b_w:  {value: 2 N*m*s/rad}
inputs: {T_em: {unit: N*m}, T_br: {unit: N*m, default: 0 N*m}}
states:
  w_em:    {unit: rad/s, initial: R * w_w}
  w_w:     {unit: rad/s, initial: 0 rad/s}
  theta_d: {unit: rad, initial: R * T_em / k}
equations:
  w_d:  w_em / R - w_w
  T_hs: k * theta_d + c * w_d
flow:
  w_em:    J_em * der(w_em) = T_em - T_hs / R
  w_w:     J_v * der(w_w) = T_hs - T_br - b_w * w_w
  theta_d: der(theta_d) = w_d
outputs: [w_em, w_w]
"""
MAP = """\
language: 1
map: bench
time: {column: t_s, unit: s}
columns:
  torque: {to: T_em, unit: N*m, blank: skip}
  brake:  {to: T_br, unit: N*m, blank: skip}
  motor:  {compare: w_em, unit: rad/s, blank: skip}
  wheel:  {compare: w_w, unit: rad/s, blank: skip}
"""
TRUE = {"J_em": "0.057 kg*m^2", "k": "5000 N*m/rad", "J_v": "155 kg*m^2"}
"""What the recorded driveline has instead: 10 to 20 per cent off, as in life."""


@cache
def driveline(*values: tuple[str, str]) -> Automaton:
    given = {key: command_line_value(text, name=key) for key, text in values}
    return automaton_of(document(), Project(Path()), given)


@cache
def document() -> Document:
    return parse_document(Source("small_driveline.yaml", tuple(SPEC.splitlines())), SPEC)


@cache
def read_recording_map() -> RecordingMap:
    return read_map(
        parse_document(Source("map.yaml", tuple(MAP.splitlines())), MAP), Project(Path())
    )


def recording_of(name: str, times: Values, values: dict[str, Values]) -> Recording:
    """A recording of these values; NaN is a sample that lacks."""
    channels = {}
    for key, column in values.items():
        kept = np.isfinite(column)
        if not kept.any():
            continue
        stamps = tuple(Fraction(round(float(t) * 10000), 10000) for t in times[kept])
        channels[key] = Channel(
            read_recording_map().columns[key], stamps, tuple(column[kept].tolist())
        )
    first = channels["torque"].times
    return Recording(name, channels, first[-1], first[0])


@cache
def tip_in(constant: bool = False) -> tuple[Values, dict[str, Values]]:
    """Times and noisy values of a drive with tip-ins, tip-outs, a launch and a brake."""
    times = np.arange(0.0, 9.0, 1.0 / RATE)
    steps = [(0.0, 5.0), (1.0, 120.0), (2.5, -60.0), (4.0, 90.0), (6.0, -20.0)]
    torque = np.array([[T for start, T in steps if start <= t][-1] for t in times])
    brake = np.where((times > 7.0) & (times < 8.0), 300.0, 0.0)
    if constant:
        torque, brake = 0.0 * times + 20.0, 0.0 * times
    blank = {"torque": torque, "brake": brake, "motor": 0.0 * times - 9.0, "wheel": 0.0 * times - 1}
    run = simulate_free_run(
        driveline(*TRUE.items()), recording_of("true", times, blank), read_recording_map()
    )
    chance = np.random.default_rng(1)

    def measured(values: Values, noise: float, quantum: float) -> Values:
        noisy = values + chance.normal(0.0, noise, len(values))
        return np.asarray(np.round(noisy / quantum) * quantum)

    return times, {
        "torque": measured(torque, 0.3, 0.25),
        "brake": brake,
        "motor": measured(run.comparisons["motor"].simulated, 0.1, 0.05),
        "wheel": measured(run.comparisons["wheel"].simulated, 0.02, 0.01),
    }


def spoil_recording(spoil: Spoil | None = None, name: str = "tip_in") -> Recording:
    """The recording, spoiled."""
    times, values = tip_in()
    copy = {key: column.copy() for key, column in values.items()}
    if spoil:
        spoil(times, copy)
    return recording_of(name, times, copy)


def delay_channel(key: str, seconds: float) -> Spoil:
    """Spoil by a logger of one channel whose clock is late."""

    def spoil(_: Values, values: dict[str, Values]) -> None:
        count = round(seconds * RATE)
        values[key] = np.concatenate((np.full(count, np.nan), values[key][:-count]))

    return spoil


def scale_channel(key: str, factor: float) -> Spoil:
    """Spoil by a wrong unit or sign."""

    def spoil(_: Values, values: dict[str, Values]) -> None:
        values[key] = values[key] * factor

    return spoil


def truncate_recording(recording: Recording, seconds: float) -> Recording:
    """The first seconds of a recording."""
    from engine.recordings.recording import crop

    return replace(crop(recording, (Fraction(0), Fraction(seconds))), windows=())
