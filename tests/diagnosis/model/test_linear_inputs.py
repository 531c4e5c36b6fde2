"""A prediction follows inputs that are linear between samples, also where they are scaled."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.innovations import KalmanGains, predict
from diagnosis.model.candidate import compile_candidate
from language.overlays.expand_document import Project, read_document

SPEC = """\
language: 1
automaton: follower
step: 0.05 s
parameters: {r: {value: 0.25 m}, tau: {value: 0.4 s, range: [0.1, 1]}}
inputs: {v: {unit: m/s}}
states: {w: {unit: rad/s, initial: 0 rad/s}}
flow: {w: tau * der(w) = v / r - w}
outputs: [w]
"""
PERIOD, SLOPE, TAU, R = 0.1, 2.0, 0.4, 0.25
SCHEME_ERROR = 0.01
"""Bound of the error [rad/s] of an input that is held at the middle of a step of 0.05 s."""


def test_a_scaled_input_is_linear_between_samples(tmp_path: Path) -> None:
    path = tmp_path / "follower.yaml"
    path.write_text(SPEC, "utf-8")
    candidate = compile_candidate(
        read_document(path), Project(tmp_path), (), (), ("w",), Fraction(1, 10), min_substeps=2
    )
    times = PERIOD * np.arange(40)
    exact = SLOPE / R * (times - TAU * (1.0 - np.exp(-times / TAU)))
    speed = np.asarray(SLOPE * times[:, np.newaxis], dtype=np.float64)
    start = np.asarray(exact[:, np.newaxis], dtype=np.float64)
    ramp = SampledRecording("ramp", Fraction(1, 10), Fraction(0), speed, start, holds=("linear",))
    gains = KalmanGains(np.zeros((0, 1, 1)), np.zeros((1, 1, 1)))
    run = predict(candidate, [ramp], [{}], gains, np.full(1, np.inf)).predictions[0]
    assert np.max(np.abs(run.outputs[:, 0] - exact)) < SCHEME_ERROR
