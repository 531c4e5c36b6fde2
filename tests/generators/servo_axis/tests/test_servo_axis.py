"""The simulator against exact solutions, and the cases against their format."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from ..cases import make_case, parse_effects, write_cases
from ..effects import EFFECTS
from ..machines import Machine, draw_machine
from ..simulation import Array, simulate, vector


def belt(seed: int = 0) -> Machine:
    return draw_machine(np.random.default_rng(seed), "belt")


def steps(m: Machine, n: int = 2000) -> Array:
    return np.repeat(np.random.default_rng(1).normal(0, 0.3 * m.f_max, n // 20), 20)


@pytest.mark.parametrize("seed", range(4))
def test_belt_axis_is_the_matrix_exponential(seed: int) -> None:
    m = belt(seed)
    b, mass, dt = m.base, m.nominal["M_c"], 1 / m.rate
    rows = [
        [-(b["b_m"] + b["c"]) / b["M_m"], b["c"] / b["M_m"], -b["k"] / b["M_m"], 1 / b["M_m"]],
        [b["c"] / mass, -(b["b_c"] + b["c"]) / mass, b["k"] / mass, 0],
        [1, -1, 0, 0],
        [0, 0, 0, 0],
    ]
    step = expm(np.array(rows) * dt)
    u, x, exact = steps(m), np.zeros(4), []
    for value in u:
        exact.append(x[:2])
        x = np.append(step[:3, :3] @ x[:3] + step[:3, 3] * value, 0)
    run = simulate(vector(m.mechanics()), dt, m.substeps, command=u)
    assert np.abs(run.clean - np.array(exact)).max() < 1e-6 * m.v_max


@pytest.mark.parametrize("effect", [{}, {"GAP": 1e-3}, {"HYST": 0.5, "HYST_YIELD": 1e-4}])
def test_belt_force_keeps_the_momentum(effect: dict[str, float]) -> None:
    m, n = belt(), 2000
    p = vector(m.mechanics() | {"B1": 0.0, "B2": 0.0} | effect)
    u = np.append(steps(m, n), 0.0)
    run = simulate(p, 1 / m.rate, m.substeps, command=u)
    momentum = run.clean @ [m.base["M_m"], m.nominal["M_c"]]
    impulse = np.append(0, np.cumsum(u[:-1])) / m.rate
    assert np.abs(momentum - impulse).max() < 1e-9 * np.abs(impulse).max()


def test_dry_friction_holds_below_its_level_and_slides_above() -> None:
    m = draw_machine(np.random.default_rng(2), "rotary")
    level = 0.2 * m.f_max
    friction = {"FRIC_C": level, "FRIC_S": level, "FRIC_VS": 1.0, "FRIC_Z": 1e-4 * m.v_max}
    p = vector(m.mechanics() | {"B1": 0.0} | friction)
    n = int(m.rate)
    held = simulate(p, 1 / m.rate, m.substeps, command=np.full(n, 0.5 * level)).clean[:, 0]
    assert abs(held[-1]) < 1e-6 * m.v_max
    slides = simulate(p, 1 / m.rate, m.substeps, command=np.full(n, 1.5 * level)).clean[:, 0]
    slope = (slides[-1] - slides[n // 2]) / (n - 1 - n // 2) * m.rate
    assert slope == pytest.approx(0.5 * level / m.base["J"], rel=1e-3)


def test_lag_and_delay_of_the_command() -> None:
    m = draw_machine(np.random.default_rng(2), "rotary")
    n, tau = 400, 20 / m.rate
    t = np.arange(n) / m.rate
    quiet = m.mechanics() | {"B1": 0.0}
    u = np.full(n, 1.0) * m.f_max
    gain = m.f_max / m.base["J"]
    late = simulate(vector(quiet | {"U_DELAY": tau}), 1 / m.rate, m.substeps, command=u)
    assert late.clean[:, 0] == pytest.approx(gain * np.maximum(t - tau, 0), abs=1e-6 * gain)
    slow = simulate(vector(quiet | {"U_LAG": tau}), 1 / m.rate, m.substeps, command=u)
    exact = gain * (t - tau * (1 - np.exp(-t / tau)))
    assert slow.clean[:, 0] == pytest.approx(exact, rel=1e-3, abs=1e-6 * gain)


def test_the_same_arguments_give_the_same_bytes(tmp_path: Path) -> None:
    for name, jobs in (("a", 1), ("b", 2)):
        out = tmp_path / name
        write_cases(out / "cases", out / "labels.json", 3, "sensor_offset:1,none:2", 1.0, jobs)
    files = [sorted(f for f in (tmp_path / n).rglob("*") if f.is_file()) for n in "ab"]
    assert [f.relative_to(tmp_path / "a") for f in files[0]] == [
        f.relative_to(tmp_path / "b") for f in files[1]
    ]
    assert [f.read_bytes() for f in files[0]] == [f.read_bytes() for f in files[1]]


@pytest.mark.parametrize("name", ["coulomb_friction", "unknown_input", "sensor_delay"])
def test_the_clean_twin_lacks_the_effect(name: str) -> None:
    case, twin = (make_case((name,), strength, 4, 0) for strength in (1.0, 0.0))
    assert twin.machine == case.machine
    assert twin.label["effects"] == []
    assert all(v == {"raw": 0, "refit": 0} for v in twin.label["visibility"].values())
    for run, clean in zip(twin.train, case.twins, strict=True):
        assert np.array_equal(run.measured, clean.measured)
        assert np.array_equal(run.command, clean.command)
    assert not np.array_equal(case.train[0].measured, twin.train[0].measured)


def test_strength_scales_the_size() -> None:
    whole, part = (make_case(("torque_offset",), s, 4, 0) for s in (1.0, 0.3))
    sizes = [c.label["effects"][0]["parameters"]["offset"] for c in (whole, part)]
    assert sizes[1] == pytest.approx(0.3 * sizes[0])


def test_the_files_fit_the_format(tmp_path: Path) -> None:
    labels = tmp_path / "labels.json"
    write_cases(tmp_path / "cases", labels, 8, "torque_ripple+coulomb_friction:1,none:1", 1.0, 1)
    document = json.loads(labels.read_text())
    assert set(document) == {"seed", "cases"}
    assert sorted(len(case["effects"]) for case in document["cases"].values()) == [0, 2]
    for name, case in document["cases"].items():
        folder = tmp_path / "cases" / name
        assert {f.name for f in folder.iterdir()} == {"spec.yaml", "map.yaml", "train", "held_out"}
        assert 5 <= len(list((folder / "train").iterdir())) <= 8
        assert len(list((folder / "held_out").iterdir())) == 3
        header, first, second = (folder / "train/run_00.csv").read_text().splitlines()[:3]
        assert header.startswith("t_s,iq_cmd_A,")
        step = float(second.split(",")[0]) - float(first.split(",")[0])
        assert step == pytest.approx(1 / case["rate_hz"])
        assert all({"id", "place", "parameters"} == set(e) for e in case["effects"])
        assert {"effects", "machine", "strength", "rate_hz", "base", "visibility"} == set(case)


def test_true_parameters_differ_from_the_nominal_ones() -> None:
    for seed in range(20):
        for kind in ("belt", "rotary"):
            m = draw_machine(np.random.default_rng(seed), kind)
            wrong = [abs(value / m.nominal[name] - 1) for name, value in m.base.items()]
            assert min(wrong) >= 0.05
            assert max(wrong) <= 0.2


def test_an_unknown_effect_is_named() -> None:
    with pytest.raises(ValueError, match="no effect 'fog'"):
        parse_effects("fog:1")


@pytest.mark.long
@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_is_visible_after_a_refit(name: str) -> None:
    visibility = make_case((name,), 1.0, 1, 0).label["visibility"]
    assert 3 <= max(v["refit"] for v in visibility.values()) <= 60
