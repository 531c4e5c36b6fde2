"""Elastic effects: springs, gaps, tyres and mounts do what their `about` says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from language.loading.load import load_automaton
from language.overlays.expand_document import Project
from language.text.diagnostic import SpecError
from tests.semantics.effects.step_response import run_with_effects

EXACT = 1e-9
"""RK4 with a step of 1 ms on polynomials and slow exponentials; absolute, SI."""
J = 2.0  # kg*m^2, of the rotor
Array = np.ndarray
SHOWN = ("T_hs", "theta_d", "theta_b", "x_2_half_shaft", "T_2_half_shaft")


def speed(found: mw.Trajectory) -> Array:
    return np.asarray(found.signals["plant.w"])


def torque(found: mw.Trajectory) -> Array:
    return np.asarray(found.signals["plant.T_s"])


def test_a_body_on_a_spring_oscillates_at_the_frequency_of_both_parts(tmp_path: Path) -> None:
    effects = "{compliance@body: {values: {part: 0.75, k_c: 600 N*m/rad, c_c: 0.1 N*m*s/rad}}}"
    found = run_with_effects(
        tmp_path,
        "rotor",
        effects,
        {"T": "0 N*m"},
        initial="{plant.tw_body: 0.01 rad}",
        more="outputs: [w, x, T_l, tw_body, w_f_body]",
    )
    decay = 0.1 / 2 * (1 / 1.5 + 1 / 0.5)
    omega = np.sqrt(600 * (1 / 1.5 + 1 / 0.5) - decay**2)
    twist = np.asarray(found.signals["plant.tw_body"])
    phase = omega * found.times
    wave = np.cos(phase) + decay / omega * np.sin(phase)
    assert np.max(np.abs(twist - 0.01 * np.exp(-decay * found.times) * wave)) < 1e-8
    momentum = 1.5 * speed(found) + 0.5 * np.asarray(found.signals["plant.w_f_body"])
    assert np.max(np.abs(momentum)) < EXACT


def test_springs_in_series_share_a_torque(tmp_path: Path) -> None:
    """A load at the far end of the spring twists it by T / k_c; the near end sees all of it."""
    effects = "{compliance@body: {values: {part: 0.5, k_c: 600 N*m/rad, c_c: 60 N*m*s/rad}}}"
    found = run_with_effects(
        tmp_path,
        "rotor",
        effects,
        {"T": "6 N*m"},
        more="outputs: [w, x, T_l, tw_body]\nequations: {T_l: G * 0.2}",
        horizon="2 s",
    )
    assert np.max(np.abs(speed(found)[-1] - 0.0)) < 1e-6
    # Both parts stand still: 6 N*m go in, 6 N*m (0.2 * 30) are taken out behind the spring.
    assert found.signals["plant.tw_body"][-1] == pytest.approx(6 / 600, rel=1e-6)


def test_a_tyre_settles_at_the_static_slip(tmp_path: Path) -> None:
    effects = "{tyre_slip@body: {values: {J_w: 0.5 kg*m^2, C_t: 1000 N*m, l_r: 0.5 rad}}}"
    found = run_with_effects(
        tmp_path,
        "rotor",
        effects,
        {"T": "6 N*m"},
        initial="{plant.w: 20 rad/s}",
        more="outputs: [w, x, T_l, w_v_body, T_t_body]\nequations: {T_l: G * 0.2}",
        horizon="1 s",
    )
    w, v = speed(found)[-1], found.signals["plant.w_v_body"][-1]
    # No resultant torque: the tyre carries 6 N*m and slips by 6 / C_t of its speed.
    assert found.signals["plant.T_t_body"][-1] == pytest.approx(6, rel=1e-6)
    assert (w - v) / v == pytest.approx(6 / 1000, rel=1e-6)
    before = J * 20.0
    assert 0.5 * w + 1.5 * v == pytest.approx(before, rel=1e-9)


def test_an_unknown_input_keeps_what_it_is(tmp_path: Path) -> None:
    found = run_with_effects(
        tmp_path, "rotor", "{unknown_input@w: {}}", {"T": "6 N*m"}, initial="{plant.T_u_w: 2 N*m}"
    )
    assert np.max(np.abs(speed(found) - 4 / J * found.times)) < EXACT


# Springs: twisted at a steady rate.


def test_rubber_beside_a_spring_is_stiffer_at_first(tmp_path: Path) -> None:
    effects = "{stiffness_hysteresis@spring: {values: {k_r: 1000 N*m/rad, F_r: 25 N*m}}}"
    found = run_with_effects(tmp_path, "shaft", effects, {"v": "0.1 rad/s"})
    x = 0.1 * found.times
    wanted = 400 * x + 20 * 0.1 + 25 * (1 - np.exp(-1000 * x / 25))
    assert np.max(np.abs(torque(found) - wanted)) < 1e-8


def test_rubber_beside_a_spring_transmits_nothing_while_the_gap_is_open(tmp_path: Path) -> None:
    effects = "{stiffness_hysteresis@half_shaft: {values: {k_r: 1000 N*m/rad, F_r: 25 N*m}}}"
    found = run_with_effects(
        tmp_path,
        "driveline",
        effects,
        {"T_em": "{start: 20 N*m, steps: {0.2 s: -20 N*m}}"},
        horizon="0.6 s",
        more="outputs: [T_hs, mode, T_r_half_shaft]",
    )
    is_open = np.asarray(found.signals["plant.mode"]) == 0
    assert 2 <= np.sum(is_open) < len(is_open)
    assert np.max(np.abs(np.asarray(found.signals["plant.T_hs"])[is_open])) < 1e-6
    assert np.max(np.abs(np.asarray(found.signals["plant.T_r_half_shaft"])[is_open])) > 1.0


@pytest.mark.parametrize("q", [3, -0.8])
def test_a_spring_that_hardens_or_softens(tmp_path: Path, q: float) -> None:
    effects = f"{{stiffness_nonlinear@spring: {{values: {{q: {q}, x_r: 0.05 rad}}}}}}"
    found = run_with_effects(tmp_path, "shaft", effects, {"v": "0.1 rad/s"})
    x = 0.1 * found.times
    part = x**2 / (0.05**2 + x**2)  # half at x_r
    assert np.max(np.abs(torque(found) - (400 * x * (1 + q * part) + 2))) < EXACT
    assert np.all(np.diff(torque(found)) > 0)


def test_a_stiffness_that_varies_over_a_turn(tmp_path: Path) -> None:
    effects = "{position_dependent_stiffness@spring: {values: {a: 0.2, ph: 1 rad}}}"
    found = run_with_effects(tmp_path, "shaft", effects, {"v": "0.1 rad/s"})
    t = found.times
    wanted = 40 * t * (1 + 0.2 * np.sin(30 * t + 1)) + 2
    assert np.max(np.abs(torque(found) - wanted)) < 1e-8


def test_a_stiffness_that_varies_over_a_turn_in_harmonics(tmp_path: Path) -> None:
    values = "{a: 0.2, ord: 2, ph: 1 rad, s_2: 0.1, c_2: -0.05, s_3: 0.03, c_3: 0.07}"
    effects = f"{{position_dependent_stiffness@spring: {{values: {values}}}}}"
    found = run_with_effects(tmp_path, "shaft", effects, {"v": "0.1 rad/s"})
    t = found.times
    angle = 20 * t + 1
    wave = 0.2 * np.sin(angle) + 0.1 * np.sin(2 * angle) - 0.05 * np.cos(2 * angle)
    wave += 0.03 * np.sin(3 * angle) + 0.07 * np.cos(3 * angle)
    assert np.max(np.abs(torque(found) - (40 * t * (1 + wave) + 2))) < 1e-8


def test_a_mount_gives_way_as_a_spring_in_series(tmp_path: Path) -> None:
    effects = (
        "{mount_compliance@spring: {values: {J_h: 1 kg*m^2, k_m: 12 kN*m/rad, c_m: 60 N*m*s/rad}}}"
    )
    found = run_with_effects(
        tmp_path,
        "shaft",
        effects,
        {"v": "{start: 0.1 rad/s, steps: {0.5 s: 0 rad/s}}"},
        horizon="2 s",
        more="parameters: {k: {value: 48 kN*m/rad}}\noutputs: [x, T_s, rate, phi_spring]",
    )
    assert torque(found)[-1] == pytest.approx(0.05 / (1 / 48000 + 1 / 12000), rel=1e-6)
    assert found.signals["plant.phi_spring"][-1] == pytest.approx(-torque(found)[-1] / 12000)


def test_a_gap_carries_no_torque_until_it_is_crossed(tmp_path: Path) -> None:
    """Nordin's gap: at a steady rate from its middle it is crossed in alpha / rate."""
    found = run_with_effects(
        tmp_path,
        "shaft",
        "{backlash@spring: {values: {alpha: 0.02 rad}}}",
        {"v": "{start: 0.1 rad/s, steps: {0.6 s: -0.1 rad/s}}"},
        horizon="1.4 s",
    )
    first, second, third = found.events[:3]
    assert (first.source, first.target) == ("inside", "upper")
    assert first.time == pytest.approx(0.2, abs=1e-9)
    # Turned round at x = 0.06, the torque is 0 where 400 (x - 0.02) = 20 * 0.1.
    assert (second.source, second.target) == ("upper", "inside")
    assert second.time == pytest.approx(0.6 + (0.06 - 0.025) / 0.1, abs=1e-9)
    assert third.target == "lower"
    t, T = found.times, torque(found)
    inside = (t < 0.2) | ((t > second.time) & (t < third.time))
    assert np.max(np.abs(T[inside])) < EXACT
    up = (t > 0.2) & (t < 0.6)
    assert np.max(np.abs(T[up] - (400 * (0.1 * t[up] - 0.02) + 2))) < 1e-8


def test_a_second_gap_in_series_is_as_one_that_is_wider(tmp_path: Path) -> None:
    request = {"T_em": "{start: 30 N*m, steps: {0.1 s: -20 N*m, 0.5 s: 40 N*m}}"}
    start = "plant.theta_d: 0.09 rad, plant.theta_b: 0.0256 rad"
    both = run_with_effects(
        tmp_path,
        "driveline",
        "{backlash@half_shaft: {values: {alpha: 0.01 rad}}}",
        request,
        initial=f"{{{start}, plant.theta_g_half_shaft: 0.01 rad}}",
    )
    wide = run_with_effects(
        tmp_path,
        "driveline",
        "{}",
        request,
        initial=f"{{{start.replace('0.0256', '0.0356')}}}",
        more="parameters: {alpha: {value: 0.0356 rad}}",
    )
    assert both.stopped is None and len(wide.events) >= 4
    for name in ("plant.T_hs", "plant.w_em", "plant.w_w"):
        a, b = np.asarray(both.signals[name]), np.asarray(wide.signals[name])
        assert np.max(np.abs(a - b)) < 1e-4 * np.max(np.abs(b)), name


def test_a_second_gap_with_a_body_in_between_gives_way_by_all_of_its_parts(tmp_path: Path) -> None:
    """At rest the twist is that of both springs and both gaps, and both ends see one torque."""
    values = "{J_m: 0.5 kg*m^2, k_2: 20 kN*m/rad, c_2: 200 N*m*s/rad, a_2: 0.03 rad}"
    found = run_with_effects(
        tmp_path,
        "driveline",
        f"{{second_gap@half_shaft: {{values: {values}}}}}",
        {"T_em": "30 N*m"},
        horizon="4 s",
        more="outputs: [w_em, w_w, T_hs, theta_d, theta_b, x_2_half_shaft, T_2_half_shaft]",
    )
    last = {name: float(np.asarray(found.signals[f"plant.{name}"])[-1]) for name in SHOWN}
    assert last["T_2_half_shaft"] == pytest.approx(last["T_hs"], rel=5e-3)
    assert last["x_2_half_shaft"] == pytest.approx(0.03 + last["T_2_half_shaft"] / 20e3, rel=1e-3)
    assert last["theta_d"] > last["theta_b"] + last["x_2_half_shaft"] > 0.03


MEASURED_TWIST = """\
language: 1
automaton: strut
about: a spring, damper and gap between two recorded ends
parameters: {k: {value: 400 N*m/rad}, c: {value: 20 N*m*s/rad}}
inputs: {v: {unit: rad/s}}
states: {x: {unit: rad, initial: 0 rad}, g: {unit: rad, initial: 0 rad}}
equations: {T_s: k * (x - g) + c * v}
flow: {x: der(x) = v, g: der(g) = 0 * v}
elements:
  spring: {kind: elastic, twist: x, rate: v, torque: T_s, stiffness: k, damping: c, gap: g}
outputs: {x: x, T_s: T_s}
effects: {EFFECT@spring: {}}
"""


@pytest.mark.parametrize(
    "effect", ["backlash", "mount_compliance", "second_gap", "stiffness_hysteresis"]
)
def test_a_measured_twist_is_that_of_the_whole_element(tmp_path: Path, effect: str) -> None:
    path = tmp_path / "strut.yaml"
    path.write_text(MEASURED_TWIST.replace("EFFECT", effect), "utf-8")
    automaton = load_automaton(str(path), Project(tmp_path))
    assert automaton.output_source("x") == "x"


def test_the_twist_of_an_element_is_no_position_of_a_turn(tmp_path: Path) -> None:
    path = tmp_path / "strut.yaml"
    text = MEASURED_TWIST.replace("EFFECT", "position_dependent_stiffness")
    path.write_text(text.replace("gap: g}", "gap: g, angle_rate: v}"), "utf-8")
    with pytest.raises(SpecError) as caught:
        load_automaton(str(path), Project(tmp_path))
    (problem,) = caught.value.problems
    assert "the `angle_rate` of element `spring` is the rate of its own twist" in problem.label
