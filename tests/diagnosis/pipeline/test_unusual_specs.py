"""A spec without inputs is diagnosed; sampled, fixed and diverging specs give a reason."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from modewright.api.diagnosis import UnusableRecordings
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from tests.language.spec_builders import ROOT

HEAD = "language: 1\nautomaton: block\n"
PARAMETERS = """\
parameters:
  m: {value: 2 kg, range: [1, 4]}
  k: {value: 200 N/m, range: [100, 400]}
  c: {value: 1 N*s/m, range: [0.1, 5]}
"""
RANGE = re.compile(r", range: \[[^]]*\]")
STATES = "states: {x: {unit: m, initial: 0.1 m}, v: {unit: m/s, initial: 0 m/s}}\n"
FREE = f"""\
{HEAD}step: 5 ms
{PARAMETERS}{STATES}flow: {{x: der(x) = v, v: m * der(v) = -k * x - c * v}}
outputs: [x]
"""
FIXED = FREE.replace(PARAMETERS, RANGE.sub("", PARAMETERS))
DIVERGING = f"""\
{HEAD}step: 5 ms
{PARAMETERS}states:
  x: {{unit: m, initial: 0.1 m}}
  v: {{unit: m/s, initial: 0 m/s}}
  z: {{unit: m, initial: 1 m}}
flow:
  x: der(x) = v
  v: "m * der(v) = -k * x - c * v + 1 N/m * max(z - 1000 m, 0 m)"
  z: der(z) = z * z / 1 m / 1 s
outputs: [x]
"""
"""The state z grows beyond all bounds within a second, which no output shows before."""
SAMPLED = f"""\
{HEAD}period: 10 ms
numbers: float64
discrete: {{x: {{unit: m, initial: 0.1 m, range: [-9, 9]}}}}
initial: run
modes: {{run: {{update: {{x: 0.9 * x}}}}}}
outputs: [x]
"""
STATELESS = f"""\
{HEAD}step: 5 ms
parameters: {{k: {{value: 10 N/m, range: [5, 20]}}}}
inputs: {{x_0: {{unit: m}}}}
equations: {{F: k * x_0}}
outputs: [F]
"""
MAP = """\
language: 1
map: block_columns
time: {column: t_s, unit: s}
columns: {x_m: {compare: x, unit: m}}
"""


@pytest.fixture(autouse=True)
def _there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with a map, an effect, and the recording of a block that swings freely."""
    monkeypatch.chdir(tmp_path)
    Path("map.yaml").write_text(MAP)
    Path("effects").mkdir()
    shutil.copy(ROOT / "spec" / "effects" / "coulomb_friction.yaml", "effects")
    time, chance = 0.01 * np.arange(300), np.random.default_rng(2)
    swing = 0.1 * np.exp(-0.3 * time) * np.cos(10.0 * time) + 1e-4 * chance.normal(size=300)
    rows = [f"{t:.2f},{x:.5f}" for t, x in zip(time, swing, strict=True)]
    Path("run.csv").write_text("\n".join(["t_s,x_m", *rows]) + "\n")


def write_spec(text: str) -> str:
    Path("block.yaml").write_text(text)
    return "block.yaml"


def test_a_spec_without_inputs_is_diagnosed() -> None:
    spec = write_spec(FREE)
    found = mw.diagnose(spec, ["run.csv"], map="map.yaml", effects="effects", out="found")
    assert found.diagnosis is not None
    assert found.verdict.verdict == "nothing_missing"
    assert found.diagnosis.model_set.series[0].inputs.shape[1] == 0
    head = Path("found/window.csv").read_text().splitlines()
    assert any(line.startswith("t_s,x") for line in head)


def test_a_spec_without_states_is_fitted() -> None:
    spec = write_spec(STATELESS)
    columns = "{x_m: {to: x_0, unit: m}, F_N: {compare: F, unit: N}}"
    Path("map.yaml").write_text(MAP.replace("{x_m: {compare: x, unit: m}}", columns))
    chance = np.random.default_rng(4)
    rows = [f"{k / 100:.2f},{x:.5f},{12.0 * x:.5f}" for k, x in enumerate(chance.normal(size=99))]
    Path("run.csv").write_text("\n".join(["t_s,x_m,F_N", *rows]) + "\n")
    assert mw.check_recordings(["run.csv"], "map.yaml", spec).check.channels
    found = mw.fit(spec, ["run.csv"], map="map.yaml", anyway=True)
    assert found.parameters[0].quantity.value == pytest.approx(12.0, rel=0.01)


def test_a_sampled_spec_is_refused() -> None:
    spec = write_spec(SAMPLED)
    with pytest.raises(mw.SpecError) as refused:
        mw.diagnose(spec, ["run.csv"], map="map.yaml", anyway=True)
    assert [one.label for one in refused.value.problems] == ["`block` is sampled: it has a period"]


def test_a_fit_of_a_spec_without_ranges_is_refused() -> None:
    spec = write_spec(FIXED)
    with pytest.raises(mw.SpecError) as refused:
        mw.fit(spec, ["run.csv"], map="map.yaml")
    label = "no parameter of `block` has a range to be fitted in"
    assert [one.label for one in refused.value.problems] == [label]


def test_a_model_that_diverges_gives_no_verdict_on_the_physics(
    capsys: pytest.CaptureFixture[str],
) -> None:
    spec = write_spec(DIVERGING)
    found = mw.diagnose(spec, ["run.csv"], map="map.yaml", effects="effects", anyway=True)
    assert found.diagnosis is None
    assert found.verdict.verdict == "unknown"
    reason = found.verdict.messages[-1]
    assert reason.startswith("run.csv: `block` diverges at ")
    with pytest.raises(UnusableRecordings, match="`block` diverges at "):
        mw.fit(spec, ["run.csv"], map="map.yaml", anyway=True)
    words = ["fit", spec, "--train", "run.csv", "--map", "map.yaml", "--anyway"]
    assert run_with_exit_code(lambda: app(words, standalone_mode=False)) == 1
    told = capsys.readouterr().err
    assert "diverges at" in told
    assert "nevertheless" not in told and "inf" not in told
