"""Tests of the generator of relay plants: bytes, twins, integrator, visibility, labels."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ..cases import (
    COARSE,
    Drawn,
    draw_case,
    grid,
    known_effects,
    naive_signals,
    true_signals,
    visibility,
)
from ..effects import build, choices
from ..kernel import BRIDGE, TANK, simulate
from ..machines import MACHINES, draw

pytestmark = pytest.mark.long
PACKAGE = Path(__file__).parents[1]


def write(folder: Path, *options: str) -> dict[str, dict[str, Any]]:
    module = __package__.rpartition(".")[0]
    root = PACKAGE.parents[module.count(".")]
    command = [sys.executable, "-m", module, "--out", str(folder / "out")]
    command += ["--labels", str(folder / "labels.json"), "--seed", "5", *options]
    subprocess.run(command, check=True, cwd=root)
    cases: dict[str, dict[str, Any]] = json.loads((folder / "labels.json").read_text())["cases"]
    return cases


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def without(machine: str, seed: int) -> Drawn:
    return Drawn(draw(machine, np.random.default_rng(seed)), [], [], (seed, 0))


def test_same_arguments_give_the_same_bytes(tmp_path: Path) -> None:
    options = ("--effects", "none:1,sensor_offset:1", "--jobs", "1")
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        write(tmp_path / name, *options)
    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_strength_zero_is_the_clean_twin(tmp_path: Path) -> None:
    labels = {}
    for strength in ("0", "1"):
        (tmp_path / strength).mkdir()
        labels[strength] = write(
            tmp_path / strength, "--effects", "torque_gain:1", "--strength", strength
        )
    clean, full = labels["0"]["case_000"], labels["1"]["case_000"]
    assert clean["effects"] == [] and clean["base"] == full["base"]
    assert all(v["raw"] < 0.01 for v in clean["visibility"].values())
    a, b = (np.genfromtxt(tmp_path / s / "out/case_000/train/run_0.csv", delimiter=",",
                          names=True) for s in "01")  # fmt: skip
    assert np.array_equal(a["supply_V"], b["supply_V"]) and np.array_equal(a["gate"], b["gate"])
    assert not np.array_equal(a["link_V"], b["link_V"])


@pytest.mark.parametrize("machine", MACHINES)
def test_clean_truth_is_the_naive_model(machine: str) -> None:
    drawn = without(machine, 4)
    case = drawn.case
    for k, program in enumerate(case.programs):
        truth, _ = true_signals(drawn, k, 1.0)
        naive = naive_signals(case, grid(program, COARSE), case.base)
        sd = [column.sd for column in case.outputs]
        assert np.all(np.abs(truth - naive) < 1e-3 * np.array(sd))


@pytest.mark.parametrize("machine", MACHINES)
def test_parameters_differ_from_the_nominal_ones(machine: str) -> None:
    case = draw(machine, np.random.default_rng(8))
    assert 5 <= case.trains <= 8 and len(case.programs) == case.trains + 3
    for name, value in case.nominal.items():
        assert 0.0499 <= abs(case.base[name] / value - 1) <= 0.2001


def constant(n: int, main: float, second: float) -> tuple[np.ndarray, np.ndarray]:
    inputs = np.tile([main, second, 0.0, 0.0, 0.0], (n, 1))
    return inputs, inputs.copy()


def test_freewheeling_current_ends_at_the_analytic_instant() -> None:
    ohms, henry, volts, amps, step = 2.0, 0.05, 0.8, 5.0, 1.37e-3
    p = {"KIND": BRIDGE, "S0": henry, "S1": 0.01, "A0": ohms, "A1": volts, "A2": 0.1,
         "N_REF": 1.0, "N_EXP": 1.0}  # fmt: skip
    states, modes = simulate(p, step, *constant(80, 0.0, 10.0), np.array([amps, 10.0, 0.0]))
    t = np.arange(81) * step
    exact = (amps + volts / ohms) * np.exp(-t * ohms / henry) - volts / ohms
    assert np.allclose(states[:, 0], np.maximum(exact, 0), atol=1e-7)
    assert np.array_equal(modes[:-1] == 2, exact[:-1] <= 0)


def test_tanks_conserve_volume_and_drain_as_torricelli_says() -> None:
    p = {"KIND": TANK, "S0": 0.5, "S1": 0.4, "A0": 1e-3, "A1": 0.0, "A2": 1e-3, "P_REF": 1e5,
         "N_REF": 1.0, "N_EXP": 1.0}  # fmt: skip
    states, _ = simulate(p, 0.5, *constant(200, 0.0, 2e5), np.array([0.8, 0.1, 0.0]))
    t = np.arange(201) * 0.5
    root = np.sqrt(0.8) - 1e-3 / 0.5 * np.sqrt(9.81 / 2) * t
    assert np.allclose(states[:, 0], root**2, rtol=1e-9)
    assert np.allclose(states[:, :2] @ [0.5, 0.4], 0.44, rtol=1e-9)


def test_second_storage_conserves_charge() -> None:
    p = {"KIND": BRIDGE, "S0": 1.0, "S1": 0.01, "S2": 0.005, "K2": 2.0, "PLACE": 1.0, "A0": 1.0,
         "A1": 0.8, "A2": 1e12, "N_REF": 1.0, "N_EXP": 1.0}  # fmt: skip
    states, _ = simulate(p, 1e-4, *constant(300, 0.0, 0.0), np.array([0.0, 12.0, 0.0]))
    assert np.allclose(states[:, 1:] @ [0.01, 0.005], 0.12, rtol=1e-6)
    assert states[-1, 2] == pytest.approx(8.0, rel=1e-3)


@pytest.mark.parametrize("machine", MACHINES)
def test_every_effect_changes_the_recordings(machine: str) -> None:
    rng = np.random.default_rng(6)
    case = draw(machine, rng)
    twin, runs = Drawn(case, [], [], (6, 0)), range(len(case.programs))
    clean = [true_signals(twin, k, 1.0)[0] for k in runs]
    for id_, place in choices(case):
        effect = build(case, id_, place, rng)
        drawn = Drawn(case, [effect], [effect.high], (6, 0))
        moved = [not np.array_equal(true_signals(drawn, k, 1.0)[0], c) for k, c in enumerate(clean)]
        assert any(moved) or id_ == "sensor_quantisation", (id_, place)


@pytest.mark.parametrize("id_", known_effects())
def test_every_effect_is_visible_after_refit(id_: str) -> None:
    drawn = draw_case((id_,), (3, 1))
    assert 3 <= max(v["refit"] for v in visibility(drawn).values()) <= 60


def test_labels_fit_the_format(tmp_path: Path) -> None:
    cases = write(tmp_path, "--effects", "sensor_offset+unknown_input:1,none:1")
    assert sorted(cases) == ["case_000", "case_001"]
    for name, label in cases.items():
        assert set(label) == {"effects", "machine", "strength", "rate_hz", "base", "visibility"}
        spec = (tmp_path / "out" / name / "spec.yaml").read_text()
        for effect in label["effects"]:
            assert set(effect) == {"id", "place", "parameters"}
            kind, where = effect["place"].split(".")
            assert kind in ("flow", "inputs", "outputs") and where in spec
        for path in (tmp_path / "out" / name).glob("*/*.csv"):
            assert len(path.read_text().splitlines()) <= 4002
    assert sorted(len(label["effects"]) for label in cases.values()) == [0, 2]
