"""Spinning: a rotor that rubs and a spec that does not know it, diagnosed once for all tests."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from tests.language.spec_builders import ROOT

SPEC = """\
language: 1
automaton: spinner
about: a rotor with viscous friction
step: 5 ms
recording_map: bench_columns
parameters:
  J: {value: 0.5 kg*m^2, range: [0.3, 0.8]}
  b: {value: 0.1 N*m*s/rad, range: [0.01, 0.5]}
inputs: {T: {unit: N*m}}
states: {w: {unit: rad/s, initial: 0 rad/s, range: [-300, 300]}}
flow: {w: J * der(w) = T - b * w}
modes: {turning: {}}
outputs: [w]
"""
MAP = """\
language: 1
map: bench_columns
time: {column: t_s, unit: s}
columns: {torque: {to: T, unit: N*m}, speed: {compare: w, unit: rad/s}}
"""
RIDER = """language: 1
automaton: rider
period: 5 ms
numbers: float64
model: spinner_diagnosed
inputs: {T: {unit: N*m, range: [-50, 50]}}
states: {w: {initial: 0 rad/s, range: [-300, 300]}}
modes: {run: {runs: {of: spinner_diagnosed.turning, method: rk4, substeps: 2, events: 4}}}
outputs: [w]
"""
EFFECTS = ("coulomb_friction", "torque_gain", "unknown_input", "viscous_friction")
J, B, T_C = 0.55, 0.12, 2.0
"""What the rotor really has: inertia [kg*m^2], viscous [N*m*s/rad] and dry friction [N*m]."""
RATE, SECONDS, FINE, LATE = 100, 10, 20, 30


def write_project(folder: Path, T_c: float = T_C, hit: float = 0.0) -> Path:
    """Make a project with recordings `run_0.csv` ... `run_2.csv` and a library of effects.

    In each a torque that is not recorded acts for a second: a `hit` [N*m], `LATE` samples after a
    step of the recorded one.
    """
    (folder / "spec").mkdir(parents=True)
    (folder / "spec" / "spinner.yaml").write_text(SPEC, "utf-8")
    (folder / "spec" / "bench_columns.yaml").write_text(MAP, "utf-8")
    (folder / "library").mkdir()
    for name in EFFECTS:
        shutil.copy(ROOT / "spec" / "effects" / f"{name}.yaml", folder / "library")
    for k, rows in enumerate(recordings(T_c, hit)):
        text = "\n".join(f"{k / RATE:.2f},{T:.6f},{w:.6f}" for k, (T, w) in enumerate(rows))
        (folder / f"run_{k}.csv").write_text(f"t_s,torque,speed\n{text}\n", "utf-8")
    return folder


def recordings(T_c: float, hit: float = 0.0) -> Sequence[np.ndarray]:
    """Return rows of torque and speed of three runs: steps of the torque through zero speed."""
    random = np.random.default_rng(1)
    count = RATE * SECONDS
    T = np.repeat(random.uniform(-12.0, 12.0, (3, SECONDS)), RATE, axis=1)
    w, seen = np.zeros(3), np.zeros((3, count))
    h = 1.0 / (RATE * FINE)
    for k in range(count):
        seen[:, k] = w
        struck = np.where((k - LATE) // RATE == np.array([2, 5, 7]), hit, 0.0)
        for _ in range(FINE):
            w = w + h * (T[:, k] + struck - B * w - T_c * np.tanh(w / 0.1)) / J
    seen = seen + random.normal(0.0, 0.05, seen.shape)
    return list(np.stack([T, seen], axis=-1))


SCHEMA = json.loads((ROOT / "spec" / "verdict.schema.json").read_text("utf-8"))
COMMAND = (
    *("diagnose", "spinner", "--train", "run_0.csv", "--train", "run_1.csv"),
    *("--held-out", "run_2.csv", "--effects", "library"),
)


def run_command(folder: Path, *arguments: str) -> int:
    """Run the command line in a folder; return its exit code."""
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        return run_with_exit_code(lambda: app(list(arguments), standalone_mode=False))
