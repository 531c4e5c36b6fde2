"""A fit and a diagnosis read the words of a recording for truth values, as a simulation does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from modewright.api.recordings import check_recordings

SPEC = """\
language: 1
automaton: cart
step: 5 ms
recording_map: cart_columns
parameters:
  m: {value: 1 kg, range: [0.5, 2]}
  c: {value: 1.7 N*s/m}
  b: {value: 3 N*s/m}
inputs: {F: {unit: N}, brake: {type: bool, default: false}}
states: {v: {unit: m/s, initial: 0 m/s}}
equations: {F_b: "if brake then b * v else 0 N"}
flow: {v: m * der(v) = F - c * v - F_b}
elements: {cart: {kind: inertia, speed: v, inertia: m}}
outputs: [v]
"""
MAP = """\
language: 1
map: cart_columns
time: {column: t, unit: s}
columns:
  F: {to: F, unit: N}
  brake: {to: brake, unit: 1}
  v: {compare: v, unit: m/s}
"""
MASS = 1.3


@pytest.fixture
def recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A recording of a cart of MASS whose brake is ON or OFF."""
    (tmp_path / "spec").mkdir()
    (tmp_path / "spec" / "cart.yaml").write_text(SPEC, "utf-8")
    (tmp_path / "spec" / "cart_columns.yaml").write_text(MAP, "utf-8")
    monkeypatch.chdir(tmp_path)
    noise = np.random.default_rng(1).normal(scale=0.01, size=1000)
    v, rows = 0.0, ["t,F,brake,v"]
    for k in range(1000):
        t = 0.005 * k
        force, brakes = 3 * np.sin(2 * t) + 2 * (t % 3 < 1), t % 2 > 1.2
        rows.append(f"{t:.3f},{force:.4f},{'ON' if brakes else 'OFF'},{v + noise[k]:.4f}")
        v += 0.005 * (force - 1.7 * v - (3 * v if brakes else 0.0)) / MASS
    path = tmp_path / "run.csv"
    path.write_text("\n".join(rows) + "\n", "utf-8")
    return path


def test_a_fit_reads_truth_words(recording: Path) -> None:
    fitted = mw.fit("cart", [recording], anyway=True)
    (mass,) = fitted.parameters
    assert mass.quantity.value == pytest.approx(MASS, rel=0.02)


def test_a_check_reads_truth_words(recording: Path) -> None:
    found = check_recordings([recording], spec="cart").check
    (brake,) = (one for one in found.channels if one.name == "brake")
    assert (brake.low, brake.high) == (0.0, 1.0)
