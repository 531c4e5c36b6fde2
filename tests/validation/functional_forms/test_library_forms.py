"""The laws in forms_library.py, which are fitted, are those of `spec/effects` in the engine."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.integrate import cumulative_simpson, cumulative_trapezoid

from tests.language.spec_builders import ROOT
from tests.semantics.effects.step_response import run_with_effects
from tests.validation.functional_forms import library_forms as library
from tests.validation.functional_forms.library_forms import Array

MS = 0.001
POINTS = {0.0: 10.0, 0.3: 60.0, 0.55: -40.0, 0.8: -30.0, 1.0: 20.0}
TABLE = "{{table: {{{}}}, hold: linear}}"
TIME = MS * np.arange(1001)
COURSE = np.interp(TIME, list(POINTS), list(POINTS.values()))
"""What goes in: a torque [N*m], a hundredth of it as a rate of twist [rad/s]."""
J = 2.0  # kg*m^2, of the rotor

WRITTEN_OUT: dict[str, str] = {
    "actuator_delay": "T_d",
    "actuator_lag": "tau part",
    "brake_drag": "T_r share tau_b tau_p T_p w_s",
    "compliance": "part k_c c_c",
    "coulomb_friction": "T_c w_s",
    "load_dependent_loss": "loss w_s",
    "mount_compliance": "J_h k_m c_m",
    "position_dependent_stiffness": "a ord ph s_2 c_2 s_3 c_3",
    "second_gap": "J_m k_2 c_2 x_c a_2",
    "sensor_delay": "T_d",
    "sensor_eccentricity": "ecc ord ph tau_e",
    "sensor_lag": "tau part",
    "stiffness_hysteresis": "k_r F_r",
    "stiffness_nonlinear": "q x_r",
    "stribeck_friction": "T_c rise w_k bend",
    "torque_derating": "P_max share w_lo",
    "torque_drift": "drop tau_d load warm_0 u_n",
    "torque_rate_limit": "r_max fall tau_f",
    "torque_ripple": "a ord s_2 c_2 ph",
    "tyre_slip": "J_w C_t l_r w_lo",
    "unequal_half_shafts": "side alpha",
}
"""Parameters of the library's effects that are written out: one more would be one more form."""
OTHERS = {
    "added_inertia", "backlash", "quadratic_drag", "road_grade", "sensor_offset",
    "sensor_quantisation",
    "sensor_scale", "torque_gain", "torque_offset", "unknown_input", "viscous_friction",
}  # fmt: skip
"""Effects of the library that have one form or that the generator does not know."""


def test_all_of_the_library_is_written_out_or_has_one_form() -> None:
    files = {path.stem: path for path in (ROOT / "spec" / "effects").glob("*.yaml")}
    assert set(files) == OTHERS | set(WRITTEN_OUT)
    for name, parameters in WRITTEN_OUT.items():
        spec = yaml.safe_load(files[name].read_text("utf-8"))
        assert set(spec["parameters"]) == set(parameters.split()), name


def course(unit: str, factor: float = 1.0) -> str:
    """The course as a stimulus."""
    return TABLE.format(", ".join(f"{t} s: {factor * v} {unit}" for t, v in POINTS.items()))


def integral(values: Array) -> Array:
    return np.asarray(cumulative_trapezoid(values, dx=MS, initial=0))


def near(found: object, wanted: Array, share: float = 1e-3) -> None:
    """Alike within a share of the largest; `wanted` has 1 ms, `found` 10."""
    values = np.asarray(found)
    assert np.max(np.abs(values - wanted[::10])) < share * np.max(np.abs(wanted))


def effect_named(value: object) -> str:
    return value.split("@")[0] if isinstance(value, str) and "@" in value else ""


TORQUES: list[tuple[str, str, Callable[[], Array]]] = [
    (
        "actuator_lag@T: {values: {tau: 40 ms, part: 0.7}}", "u_a_T",
        lambda: library.lag(COURSE, MS, 0.04, 0.7),
    ),
    (
        "actuator_delay@T: {values: {T_d: 35 ms}}", "u_d_T",
        lambda: library.delay(COURSE, MS, 0.035),
    ),
    (
        "torque_rate_limit@T: {values: {r_max: 250, fall: 0.6, tau_f: 9 ms}}", "u_r_T",
        lambda: library.rate_limit(COURSE, MS, 250.0, 0.009, 0.6),
    ),
    (
        "torque_drift@T: {values: {drop: 0.3, tau_d: 1 s, load: 0.6, warm_0: 0.2, u_n: 100 N*m}}",
        "u_w_T",
        lambda: library.drift(COURSE, MS, 0.3, 1.0, 0.6, 0.2),
    ),
    (
        "torque_ripple@T: {values: {a: 5 N*m, ord: 3, ph: 0.4 rad, s_2: 0.3, c_2: -0.2}}",
        "T_rip_T",
        lambda: library.ripple(COURSE, 10 * TIME, 5.0, 3.0, 0.4, 0.3, -0.2),
    ),
    (
        "compliance@body: {values: {part: 0.25, k_c: 600, c_c: 5}}", "w",
        lambda: library.compliance(COURSE, MS, J, 0.25, 600.0, 5.0),
    ),
    (
        "sensor_lag@w: {values: {tau: 40 ms, part: 0.7}}", "w",
        lambda: library.lag(integral(COURSE) / J, MS, 0.04, 0.7),
    ),
    (
        "sensor_delay@w: {values: {T_d: 35 ms}}", "w",
        lambda: library.delay(integral(COURSE) / J, MS, 0.035),
    ),
    (
        "sensor_eccentricity@w: {values: {ecc: 0.05, ord: 2, ph: 0.4 rad, tau_e: 20 ms}}", "w",
        lambda: library.eccentric(
            integral(COURSE) / J, integral(integral(COURSE)) / J, 0.05, 0.4, 0.02, 2.0
        ),
    ),
]  # fmt: skip


@pytest.mark.parametrize(("effect", "shown", "wanted"), TORQUES, ids=effect_named)
def test_of_an_input_or_output(
    tmp_path: Path, effect: str, shown: str, wanted: Callable[[], Array]
) -> None:
    more = f"outputs: [{shown}]"
    found = run_with_effects(tmp_path, "rotor", f"{{{effect}}}", {"T": course("N*m")}, more=more)
    near(found.signals[f"plant.{shown}"], wanted())


def test_of_a_limit_of_power(tmp_path: Path) -> None:
    """At 10 rad/s."""
    effect = "{torque_derating@T: {values: {P_max: 1.75 kW, share: 0.7}}}"
    found = run_with_effects(
        tmp_path, "rotor", effect, {"T": course("N*m", 5.0)}, more="outputs: [u_p_T]"
    )
    wanted = library.derating(5 * COURSE, np.full(1001, 10.0), 1750.0, 0.7)
    near(found.signals["plant.u_p_T"], wanted)


LOSSES: list[tuple[str, Callable[[Array, Array], Array]]] = [
    (
        "coulomb_friction@w: {values: {T_c: 8 N*m, w_s: 2 rad/s}}",
        lambda w, u: library.dry(w, 8.0, 0.0, 1.0, 2.0),
    ),
    (
        "stribeck_friction@w: {values: {T_c: 8 N*m, rise: 0.8, w_k: 5, bend: 0.4}}",
        lambda w, u: library.dry(w, 8.0, 0.8, 5.0, 2.0),
    ),
    (
        "load_dependent_loss@w: {values: {loss: 0.3, w_s: 2 rad/s}}",
        lambda w, u: library.load_loss(u, w, 0.3, 2.0),
    ),
]


@pytest.mark.parametrize(("effect", "law"), LOSSES, ids=effect_named)
def test_of_a_loss(tmp_path: Path, effect: str, law: Callable[[Array, Array], Array]) -> None:
    """What the speed lacks is the integral of the loss."""
    start = "{plant.w: -3 rad/s}"
    found = run_with_effects(
        tmp_path, "rotor", f"{{{effect}}}", {"T": course("N*m")}, initial=start
    )
    w = np.asarray(found.signals["plant.w"])
    lost = integral(COURSE)[::10] - J * (w + 3)
    wanted = cumulative_simpson(law(w, COURSE[::10]), dx=0.01, initial=0)
    assert np.max(np.abs(lost - wanted)) < 5e-3 * np.max(np.abs(wanted))


BRAKE = (
    "{brake_drag@w: {values: {T_r: 3 N*m, share: 0.25, tau_b: 0.4 s, tau_p: 0.2 s, T_p: 10 N*m,"
    " w_s: 0.1 rad/s}}}"
)


def test_of_a_brake_that_lets_go_slowly(tmp_path: Path) -> None:
    found = run_with_effects(
        tmp_path, "rotor", BRAKE,
        {"T": "0 N*m", "T_b": "{start: 16 N*m, steps: {0.5 s: 0 N*m}}"},
        initial="{plant.w: 50 rad/s}", more="outputs: [T_d_w]",
    )  # fmt: skip
    brake = np.where(TIME < 0.4999, 16.0, 0.0)
    near(found.signals["plant.T_d_w"], library.brake_drag(brake, MS, 3.0, 0.25, 0.4))


RATE = 0.01 * COURSE
TWIST = integral(RATE)

SPRINGS: list[tuple[str, Callable[[], Array]]] = [
    (
        "stiffness_nonlinear@spring: {values: {q: 1.5, x_r: 0.06 rad}}",
        lambda: library.nonlinear(TWIST, 400.0, 1.5, 0.06) + 20 * RATE,
    ),
    (
        "stiffness_hysteresis@spring: {values: {k_r: 300 N*m/rad, F_r: 9 N*m}}",
        lambda: library.hysteresis(TWIST, 400.0, 300.0, 9.0) + 20 * RATE,
    ),
    (
        "position_dependent_stiffness@spring: {values: "
        "{a: 0.2, ord: 2, ph: 0.4 rad, s_2: 0.1, c_2: -0.05, s_3: 0.03, c_3: 0.07}}",
        lambda: library.position(
            TWIST, 10 * TIME, 400.0, 0.2, 2.0, 0.4, np.array([0.1, -0.05, 0.03, 0.07])
        ) + 20 * RATE,
    ),
    (
        "unequal_half_shafts@spring: {values: {side: 0.6, alpha: 0.05 rad}}",
        lambda: 0.6 * (400 * TWIST + 20 * RATE)
        + 0.4 * library.with_gap(TWIST, RATE, MS, 400.0, 20.0, 0.05),
    ),
]  # fmt: skip


@pytest.mark.parametrize(("effect", "wanted"), SPRINGS, ids=effect_named)
def test_of_a_spring(tmp_path: Path, effect: str, wanted: Callable[[], Array]) -> None:
    found = run_with_effects(tmp_path, "shaft", f"{{{effect}}}", {"v": course("rad/s", 0.01)})
    near(found.signals["plant.T_s"], wanted(), 3e-3)


def test_of_a_mount(tmp_path: Path) -> None:
    effect = "{mount_compliance@spring: {values: {J_h: 20, k_m: 5 kN*m/rad, c_m: 60}}}"
    more = "outputs: [T_s, phi_spring]"
    found = run_with_effects(tmp_path, "shaft", effect, {"v": course("rad/s", 0.01)}, more=more)
    torque = np.asarray(found.signals["plant.T_s"])
    wanted = library.mount(torque, 0.01, 20.0, 5000.0, 60.0)
    assert np.max(np.abs(np.asarray(found.signals["plant.phi_spring"]) - wanted)) < 1e-3 * np.max(
        np.abs(wanted)
    )


def test_of_a_second_gap(tmp_path: Path) -> None:
    values = "{J_m: 0.5 kg*m^2, k_2: 20 kN*m/rad, c_2: 200 N*m*s/rad, a_2: 0.03 rad, x_c: 3 mrad}"
    names = ("x_2_half_shaft", "rate_2_half_shaft", "T_2_half_shaft")
    found = run_with_effects(
        tmp_path, "driveline", f"{{second_gap@half_shaft: {{values: {values}}}}}",
        {"T_em": "{start: 20 N*m, steps: {0.2 s: -20 N*m}}"}, horizon="0.6 s",
        more=f"outputs: [{', '.join(names)}]",
    )  # fmt: skip
    x, rate, torque = (np.asarray(found.signals[f"plant.{name}"]) for name in names)
    assert np.max(np.abs(torque)) > 1.0 > np.min(np.abs(torque))
    assert np.allclose(torque, library.second_gap(x, rate, 20e3, 200.0, 0.03))


def test_of_a_tyre(tmp_path: Path) -> None:
    effects = "{tyre_slip@body: {values: {J_w: 0.5 kg*m^2, C_t: 1000 N*m, l_r: 0.5 rad}}}"
    more = "outputs: [w, w_v_body]\nequations: {T_l: G * 0.2}"
    start = "{plant.w: 20 rad/s}"
    found = run_with_effects(tmp_path, "rotor", effects, {"T": "6 N*m"}, initial=start, more=more)
    w, v = (float(np.asarray(found.signals[f"plant.{name}"])[-1]) for name in ("w", "w_v_body"))
    assert (w - v) / v == pytest.approx(float(library.tyre_slip(np.array(6.0), 1000.0)), rel=1e-5)
