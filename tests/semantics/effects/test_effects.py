"""Effects: each that is shipped does what its `about` says - closed forms and balances."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

import modewright as mw
from tests.language.spec_builders import ROOT
from tests.semantics.effects.step_response import run_with_effects

EXACT = 1e-9
"""RK4 with a step of 1 ms on polynomials and slow exponentials; absolute, SI."""
J = 2.0  # kg*m^2, of the rotor
FILES = sorted((ROOT / "spec" / "effects").glob("*.yaml"))
Array = np.ndarray


def speed(found: mw.Trajectory) -> Array:
    return np.asarray(found.signals["plant.w"])


def torque(found: mw.Trajectory) -> Array:
    return np.asarray(found.signals["plant.T_s"])


def effect_named(value: object) -> str:
    return value.split("@")[0].strip("{") if isinstance(value, str) and "@" in value else ""


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_an_effect_says_what_it_is_and_what_it_is_confused_with(path: Path) -> None:
    spec = yaml.safe_load(path.read_text("utf-8"))
    assert spec["effect"] == path.stem
    assert spec["about"] and mw.check(str(path)) == []
    for key in ("signature", "confused_with", "separated_by"):
        assert key in spec, key


def test_dry_friction_decelerates_linearly_and_dissipates_its_torque_times_the_speed(
    tmp_path: Path,
) -> None:
    found = run_with_effects(
        tmp_path,
        "rotor",
        "{coulomb_friction@w: {values: {T_c: 4 N*m}}}",
        {"T": "0 N*m"},
        horizon="2 s",
        initial="{plant.w: 10 rad/s}",
    )
    w, t = speed(found), found.times
    assert np.max(np.abs(w - (10 - 4 / J * t))) < EXACT
    turned = np.asarray(found.signals["plant.x"])[-1]
    lost = J / 2 * (w[0] ** 2 - w[-1] ** 2)
    assert lost == pytest.approx(4 * turned, rel=1e-9)


RISE: list[tuple[str, str, Callable[[Array], Array]]] = [
    # effect, a steady torque of 6 N*m applied from the start, speed by hand
    ("{torque_gain@T: {values: {gain: 1.25}}}", "6 N*m", lambda t: 7.5 / J * t),
    ("{torque_offset@T: {values: {offset: -2}}}", "6 N*m", lambda t: 4 / J * t),
    (
        "{torque_drift@T: {values: {drop: 0.2, tau_d: 2 s}}}",
        "6 N*m",
        lambda t: 6 / J * (t - 0.2 * (t - 2 * (1 - np.exp(-t / 2)))),
    ),
    (
        "{torque_drift@T: {values: {drop: 0.2, tau_d: 2 s, load: 1, u_n: 3, warm_0: 1}}}",
        "6 N*m",  # heats four times as much as time alone would, from where time alone ends
        lambda t: 6 / J * (t - 0.2 * (4 * t - 3 * 2 * (1 - np.exp(-t / 2)))),
    ),
    (
        "{torque_derating@T: {values: {P_max: 1 kW}}}",  # at 10 rad/s: 100 N*m
        "150 N*m",
        lambda t: 100 / J * t,
    ),
    (
        "{road_grade@w: {values: {grade: 0.1 rad}}}",  # weight 30 N*m
        "6 N*m",
        lambda t: (6 - 30 * np.sin(0.1)) / J * t,
    ),
    (
        "{viscous_friction@w: {values: {b: 3}}}",
        "6 N*m",
        lambda t: 2 * (1 - np.exp(-3 / J * t)),
    ),
    (
        "{quadratic_drag@w: {values: {c_2: 1.5}}}",
        "6 N*m",
        lambda t: 2 * np.tanh(1.5 * t),  # w_end 2 rad/s, J / (c_2 * w_end) = 2/3 s
    ),
    (
        "{torque_ripple@T: {values: {a: 5 N*m, ord: 3, ph: 0.5 rad}}}",  # angle rate 10 rad/s
        "6 N*m",
        lambda t: 6 / J * t + 5 / J / 30 * (np.cos(0.5) - np.cos(30 * t + 0.5)),
    ),
]


@pytest.mark.parametrize(("effects", "given", "wanted"), RISE, ids=effect_named)
def test_speed_under_a_steady_torque(
    tmp_path: Path, effects: str, given: str, wanted: Callable[[Array], Array]
) -> None:
    found = run_with_effects(tmp_path, "rotor", effects, {"T": given})
    assert np.max(np.abs(speed(found) - wanted(found.times))) < 2e-8


def erlang(x: Array) -> Array:
    """The integral of the step response of three equal lags: 1 - exp(-x) (1 + x + x^2 / 2)."""
    return np.asarray(x - 3 + np.exp(-x) * (3 + 2 * x + x**2 / 2))


@pytest.mark.parametrize(
    ("part", "integral"),
    [(0, lambda x: x - (1 - np.exp(-x))), (1, erlang)],
    ids=["one", "three in a row"],
)
def test_a_lag_follows_a_step(
    tmp_path: Path, part: float, integral: Callable[[Array], Array]
) -> None:
    effect = f"{{actuator_lag@T: {{values: {{tau: 50 ms, part: {part}}}}}}}"
    found = run_with_effects(
        tmp_path, "rotor", effect, {"T": "{start: 0 N*m, steps: {0.1 s: 6 N*m}}"}
    )
    x = np.maximum(found.times - 0.1, 0) / 0.05
    assert np.max(np.abs(speed(found) - 6 / J * 0.05 * integral(x))) < 1e-7


def test_a_dead_time_shifts_what_is_delivered(tmp_path: Path) -> None:
    given = {"T": "{start: 0 N*m, steps: {0.1 s: 6 N*m}}"}
    found = run_with_effects(tmp_path, "rotor", "{actuator_delay@T: {values: {T_d: 50 ms}}}", given)
    wanted = 6 / J * np.maximum(found.times - 0.15, 0)
    # Between major steps (1 ms) the past is interpolated: a step comes out as a ramp of one.
    assert np.max(np.abs(speed(found) - wanted)) < 6 / J * 0.001
    assert np.max(np.abs(np.diff(speed(found)[17:]) - 6 / J * 0.01)) < EXACT


def test_a_rate_limit_makes_a_ramp_of_a_step(tmp_path: Path) -> None:
    limit = "{torque_rate_limit@T: {values: {r_max: 100, tau_f: 2 ms}}}"
    found = run_with_effects(
        tmp_path, "rotor", limit, {"T": "{start: 0 N*m, steps: {0.1 s: 30 N*m}}"}
    )
    t = np.clip(found.times - 0.1, 0, 0.3)
    after = np.maximum(found.times - 0.4, 0)
    wanted = 100 / J * t**2 / 2 + 30 / J * after
    # Within tau_f (2 ms) of its end the ramp bends into the request: 30 N*m * 2 ms / J at most.
    assert np.max(np.abs(speed(found) - wanted)) < 30 * 0.002 / J


def test_the_loss_of_gears_follows_the_size_of_the_load(tmp_path: Path) -> None:
    effects = "{load_dependent_loss@w: {values: {loss: 0.1}}}"
    for sign in (1, -1):
        found = run_with_effects(
            tmp_path, "rotor", effects, {"T": f"{6 * sign} N*m"}, initial="{plant.w: 20 rad/s}"
        )
        assert np.max(np.abs(speed(found) - (20 + (6 * sign - 0.6) / J * found.times))) < EXACT


def test_stribeck_friction_is_larger_at_low_speed(tmp_path: Path) -> None:
    effects = "{stribeck_friction@w: {values: {T_c: 4 N*m, rise: 0.5, w_k: 2}}}"
    rates = {}
    for w in (1, 40):
        found = run_with_effects(
            tmp_path, "rotor", effects, {"T": "0 N*m"}, initial=f"{{plant.w: {w} rad/s}}"
        )
        rates[w] = (speed(found)[1] - speed(found)[0]) / found.times[1]
    assert rates[40] == pytest.approx(-4 / J, rel=1e-9)
    assert rates[1] == pytest.approx(-4 / J * (1 + 0.5 * np.exp(-((1 / 2) ** 2))), rel=0.01)


BRAKE = (
    "{brake_drag@w: {values: {T_r: 3 N*m, share: 0.25, tau_b: 0.4 s, tau_p: 0.2 s, T_p: 10 N*m,"
    " w_s: 0.1 rad/s}}}"
)


def test_a_brake_that_lets_go_slowly_is_a_load_that_fades(tmp_path: Path) -> None:
    """Nothing beside the brake while it is applied; then what its pads had come to, fading."""
    found = run_with_effects(
        tmp_path,
        "rotor",
        BRAKE,
        {"T": "0 N*m", "T_b": "{start: 16 N*m, steps: {0.5 s: 0 N*m}}"},
        initial="{plant.w: 50 rad/s}",
        horizon="2 s",
    )
    top = (3 + 0.25 * 16) * (1 - np.exp(-0.5 / 0.2))
    t = found.times[51:] - 0.5
    w = speed(found)
    assert w[50] == w[0]
    assert np.max(np.abs(w[51:] - (w[50] - top / J * 0.4 * (1 - np.exp(-t / 0.4))))) < 1e-6


# Sensors: the dynamics stay, one output is another.


SENSED: list[tuple[str, Callable[[Array], Array]]] = [
    ("{sensor_scale@w: {values: {gain: 1.1}}}", lambda t: 1.1 * 3 * t),
    ("{sensor_offset@w: {values: {offset: 0.5}}}", lambda t: 3 * t + 0.5),
    (
        "{sensor_lag@w: {values: {tau: 100 ms}}}",
        lambda t: 3 * (t - 0.1 * (1 - np.exp(-t / 0.1))),
    ),
    ("{sensor_delay@w: {values: {T_d: 50 ms}}}", lambda t: 3 * np.maximum(t - 0.05, 0)),
    (
        "{sensor_eccentricity@w: {values: {ecc: 0.05, ph: 0.3 rad}}}",
        lambda t: 3 * t * (1 + 0.05 * np.sin(1.5 * t**2 + 0.3)),
    ),
    (
        "{sensor_quantisation@w: {values: {lsb: 0.25}}}",
        lambda t: 0.25 * np.floor(3 * t / 0.25 + 0.5 + 1e-9),
    ),
]


@pytest.mark.parametrize(("effects", "wanted"), SENSED, ids=effect_named)
def test_a_sensor_changes_its_output_alone(
    tmp_path: Path, effects: str, wanted: Callable[[Array], Array]
) -> None:
    found = run_with_effects(tmp_path, "rotor", effects, {"T": "6 N*m"})
    t = found.times
    off_steps = np.abs(np.mod(3 * t / 0.25 + 0.5, 1)) > 1e-6 if "quant" in effects else t >= 0
    assert np.max(np.abs(speed(found) - wanted(t))[off_steps]) < 1e-7
    assert np.max(np.abs(np.asarray(found.signals["plant.x"]) - 1.5 * t**2)) < EXACT


# Neutral values.

NEUTRAL = [
    ("coulomb_friction@w_em", "T_c: 0 N*m"),
    ("stribeck_friction@w_em", "T_c: 0 N*m"),
    ("road_grade@w_w", "grade: 0 rad"),
    ("torque_ripple@T_em", "a: 0 N*m"),
    ("torque_gain@T_em", "gain: 1"),
    ("torque_offset@T_em", "offset: 0 N*m"),
    ("torque_drift@T_em", "drop: 0"),
    ("viscous_friction@w_w", "b: 0 N*m*s/rad"),
    ("quadratic_drag@w_w", "c_2: 0"),
    ("load_dependent_loss@w_em", "loss: 0"),
    ("brake_drag@w_w", "share: 0, T_r: 0 N*m"),
    ("stiffness_nonlinear@half_shaft", "q: 0"),
    ("stiffness_hysteresis@half_shaft", "k_r: 0 N*m/rad"),
    ("position_dependent_stiffness@half_shaft", "a: 0"),
    ("sensor_scale@w_w", "gain: 1"),
    ("sensor_offset@w_w", "offset: 0 rad/s"),
    ("sensor_eccentricity@w_w", "ecc: 0"),
    ("unknown_input@w_w", ""),
    ("added_inertia@w_em", "ratio: 0"),
]


def test_at_their_neutral_values_all_effects_leave_every_bit(tmp_path: Path) -> None:
    """Laid all together, so that a later one sees those before it as its base."""
    effects = ", ".join(
        f"{name}: {{as: e{k}, values: {{{v}}}}}" for k, (name, v) in enumerate(NEUTRAL)
    )
    request = {"T_em": "{start: 30 N*m, steps: {0.1 s: -20 N*m}}"}
    initial = "{plant.theta_d: 0.0740754719736 rad}"
    plain = run_with_effects(tmp_path, "driveline", "{}", request, initial=initial, horizon="0.6 s")
    laid = run_with_effects(
        tmp_path, "driveline", f"{{{effects}}}", request, initial=initial, horizon="0.6 s"
    )
    assert len(plain.events) >= 3
    assert [e.time for e in laid.events] == [e.time for e in plain.events]
    for name, values in plain.signals.items():
        assert np.array_equal(np.asarray(values), np.asarray(laid.signals[name])), name


def test_every_neutral_value_that_is_declared_is_tried(tmp_path: Path) -> None:
    declared = set()
    for path in FILES:
        parameters = yaml.safe_load(path.read_text("utf-8")).get("parameters", {})
        if any(p.get("neutral", "absent") != "absent" for p in parameters.values()):
            declared.add(path.stem)
    assert declared - {"backlash"} == {name.split("@")[0] for name, _ in NEUTRAL} - {
        "unknown_input"
    }


def test_a_gap_of_no_width_is_none(tmp_path: Path) -> None:
    given = {"v": "{start: 0.1 rad/s, steps: {0.6 s: -0.1 rad/s}}"}
    found = run_with_effects(
        tmp_path, "shaft", "{backlash@spring: {values: {alpha: 0 rad}}}", given, horizon="1.4 s"
    )
    plain = run_with_effects(tmp_path, "shaft", "{}", given, horizon="1.4 s")
    assert np.max(np.abs(torque(found) - torque(plain))) < EXACT


def test_the_lag_of_a_signal_that_is_an_equation_starts_at_zero(tmp_path: Path) -> None:
    """The torque is 400 * 0.1 t + 20 * 0.1; it has no value before the states have one."""
    effects = "{sensor_lag@T_s: {values: {tau: 100 ms}}}"
    found = run_with_effects(tmp_path, "shaft", effects, {"v": "0.1 rad/s"})
    t, tau = found.times, 0.1
    wanted = 40 * (t - tau) + 2 + (40 * tau - 2) * np.exp(-t / tau)
    assert np.max(np.abs(torque(found) - wanted)) < 1e-7
