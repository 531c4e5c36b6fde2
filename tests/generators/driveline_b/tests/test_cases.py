"""The cases of driveline B: bytes, twins, visible effects, and an oracle of the integrator."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest

from tests.generators.driveline_b.__main__ import main, order_cases
from tests.generators.driveline_b.case import NOMINAL, Case
from tests.generators.driveline_b.effect_catalogue import CATALOGUE, parse_effects
from tests.generators.driveline_b.manoeuvre import draw_manoeuvre
from tests.generators.driveline_b.solver import RATE_HZ, Physics, simulate


def digest(folder: Path) -> str:
    parts = [f"{f.relative_to(folder)}".encode() + f.read_bytes() for f in folder.rglob("*.csv")]
    return hashlib.sha256(b"".join(sorted(parts))).hexdigest()


def test_the_same_arguments_give_the_same_bytes(tmp_path: Path) -> None:
    found = []
    for name in ("a", "b"):
        given = ["--out", str(tmp_path / name), "--labels", str(tmp_path / f"{name}.json")]
        assert main([*given, "--seed", "3", "--effects", "road_grade:1"]) == 0
        found.append((digest(tmp_path / name), (tmp_path / f"{name}.json").read_bytes()))
    assert found[0] == found[1]
    label = json.loads(found[0][1])["cases"]["case_000"]
    assert label["effects"][0]["id"] == "road_grade"
    assert label["effects"][0]["place"] == "flow.w_w"
    assert set(label["base"]) == {*NOMINAL, "tau_f"}
    files = sorted(f.name for f in (tmp_path / "a" / "case_000" / "train").iterdir())
    assert files == [f"rec_{k:02d}.csv" for k in range(6)]
    given = ["--out", str(tmp_path / "a"), "--labels", str(tmp_path / "c.json")]
    assert main([*given, "--seed", "3"]) == 2


def test_a_twin_has_the_same_drives_and_no_effect() -> None:
    case, twin = (Case(5, 0, ("coulomb_friction",), strength) for strength in (1.0, 0.0))
    acting, clean = (one.record("launch", 1) for one in (case, twin))
    assert case.base == twin.base and not twin.sizes and twin.label["effects"] == []
    assert np.array_equal(acting[:, :3], clean[:, :3])
    assert np.array_equal(clean, Case(5, 0, (), 1.0).record("launch", 1))


@pytest.mark.parametrize("name", CATALOGUE)
def test_each_effect_is_larger_than_the_noise(name: str) -> None:
    """The noise of a case and of its twin is the same, so that it cancels."""
    kinds = ("tip", "sweep", "power")
    acting, clean = (
        [Case(5, 1, (name,), strength).record(kind, k) for k, kind in enumerate(kinds)]
        for strength in (1.0, 0.0)
    )
    sensors = Case(5, 1, (name,), 1.0).sensors
    ratios = [
        np.sqrt(np.mean((one[:, column] - other[:, column]) ** 2)) / std
        for one, other in zip(acting, clean, strict=True)
        for column, (std, _) in ((3, sensors.w_em), (4, sensors.w_w))
    ]
    assert max(ratios) > 1.0


def test_coasting_follows_the_closed_form() -> None:
    """Without a gap, road load and torque both inertias decay as one: w = w_0 exp(-b t / J)."""
    physics = Physics(0.05, 6000.0, 60.0, 0.0, 0.01, 135.0, 0.4, 0.0, 0.0, 0.01)
    speeds = simulate(physics, np.zeros((8 * RATE_HZ + 1, 4)), RATE_HZ, 40.0, 0.0)
    inertia, loss = 135.0 + 81.0 * 0.05, 0.4 + 81.0 * 0.01
    known = 360.0 * np.exp(-loss / inertia * np.arange(8.0))
    assert speeds[1:, 0] == pytest.approx(known[1:], rel=2e-5)


def test_demands_change_no_faster_than_their_rate() -> None:
    for kind in ("tip", "launch", "random_steps", "coast", "power"):
        manoeuvre = draw_manoeuvre(kind, np.random.default_rng(4))
        assert np.max(np.abs(np.diff(manoeuvre.torque))) <= 1500.0 / RATE_HZ * (1.0 + 1e-9)
        assert np.max(np.abs(np.diff(manoeuvre.brake))) <= 3000.0 / RATE_HZ * (1.0 + 1e-9)


def test_orders_are_read_and_refused() -> None:
    assert parse_effects("tyre_slip+road_grade:2,none:1") == [("road_grade", "tyre_slip")] * 2 + [
        ()
    ]
    assert len(order_cases("all:2,none:5", 1, 0.3)) == 2 * len(CATALOGUE) + 5
    for words in ("all", "tyre:1", "actuator_lag+torque_rate_limit:1", "none:0"):
        with pytest.raises(ValueError):
            parse_effects(words)
    with pytest.raises(ValueError, match="strength"):
        order_cases("all:1", 1, 0.01)
