"""For each effect of the generator: its law and the library's family on a typical excitation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.signal import chirp

from tests.generators.blind_cases.can_frame import sample_frames
from tests.generators.blind_cases.driver_model import smooth_hann
from tests.generators.blind_cases.physical_parameters import Physics
from tests.validation.functional_forms import elastic_forms as elastic, library_forms as library
from tests.validation.functional_forms.form_fit import MS, LawComparison, steps
from tests.validation.functional_forms.generator_forms import evaluate_path, limit_rate
from tests.validation.functional_forms.library_forms import Array


def actuator_lag(p: Physics) -> LawComparison:
    u = steps(3)
    found = evaluate_path(p, 2 * MS, {"demand": u}, free={"LAG": u[0], "LAG_RATE": 0})
    starts = [(0.5, 1), (1, 2), (0.4, 2.5)]
    return LawComparison(
        found["LAG"], u, lambda f: library.lag(u, 2 * MS, abs(f[0]), f[1]), (0.02, 0.5), starts
    )


def actuator_delay(p: Physics) -> LawComparison:
    u = steps(3, MS)
    rng = np.random.default_rng(1)
    late = sample_frames(u, rng, p.input_frame_s, p.input_jitter_s, p.input_transport_s)
    return LawComparison(late, u, lambda f: library.delay(u, MS, f[0]), (0.03,), [(1.5,), (0.5,)])


def torque_rate_limit(p: Physics) -> LawComparison:
    u = steps(2, MS)

    def law(f: Array) -> Array:
        return library.rate_limit(u, MS, abs(f[0]), np.clip(f[1], 0.002, 0.015))

    return LawComparison(limit_rate(p, MS, u), u, law, (500.0, 0.005), [(1.3, 2), (0.7, 1)])


def torque_derating(p: Physics) -> LawComparison:
    speed, torque = (one.ravel() for one in np.mgrid[20:700:40j, 20:240:20j])
    found = evaluate_path(p, MS, {"W_EM": speed, "demand": torque})
    return LawComparison(
        found["motor"], torque, lambda f: library.derating(torque, speed, *f), (40e3, 1.0),
        [(0.8, 1), (0.8, 0.7)],
    )  # fmt: skip


def torque_drift(p: Physics) -> LawComparison:
    time = np.arange(0, 9, 0.01)
    u = np.where(time % 4.5 < 2.7, 210.0, -100.0) + 20 * np.sin(5 * time)
    speed = 250 + 60 * np.sin(1.4 * time)
    found = evaluate_path(
        p, 0.01, {"demand": u, "W_EM": speed}, free={"HEAT_W": 0.15, "HEAT_R": 0.15}
    )
    starts = [(1, 0.5, 1, 1), (0.5, 2, 0.5, -1), (2, 2, 1, 0)]
    return LawComparison(
        found["motor"], u, lambda f: library.drift(u, 0.01, f[0], abs(f[1]), f[2], f[3]),
        (0.1, 5.0, 0.9, 0.1), starts,
    )  # fmt: skip


def torque_ripple(p: Physics) -> LawComparison:
    """Two of the library's, one at each order of the generator's."""
    u = steps(3)
    speed = np.linspace(20, 60, len(u))
    angle = np.cumsum(speed) * 2 * MS
    found = evaluate_path(p, 2 * MS, {"demand": u, "A_EM": angle, "W_EM": speed})
    order = p.ripple_order

    def law(f: Array) -> Array:
        return library.ripple(library.ripple(u, angle, *f[:3]), angle, *f[3:])

    starts = [(1, 1, phase, 1, 1, other) for phase in (-2, 0) for other in (-2, 0)]
    return LawComparison(found["motor"], u, law, (8.0, order, 1.0, 4.0, 2 * order, 1.0), starts)


def dry_friction(p: Physics) -> LawComparison:
    """The motor is turned to and fro, slowly and fast; viscous friction is free beside it."""
    time = np.arange(0, 3, MS)
    angle = 2 * np.sin(2.5 * time) + 0.02 * np.sin(20 * time) + 15 * np.maximum(0, time - 1.5) ** 3
    w = np.gradient(angle, MS)
    angle -= angle[0]
    found = evaluate_path(p, MS, {"A_EM": angle, "W_EM": w})["friction"]
    return LawComparison(
        found, 0 * found,
        lambda f: library.dry(w, *f[:4]) + f[4] * w,
        (3.0, 0.5, 30.0, 2.0, 0.01),
        [(0.7, 5, 2, 1, 0), (1, 0.5, 0.2, 3, -1), (1, 0, 1, 0.005, 0)],
    )  # fmt: skip


def load_dependent_loss(p: Physics) -> LawComparison:
    speed, load = (one.ravel() for one in np.mgrid[-60:700:41j, -900:1800:28j])
    found = evaluate_path(p, MS, {"W_EM": speed, "road": load})["mesh"]
    return LawComparison(
        found, 0 * found, lambda f: library.load_loss(load / p.ratio, speed, *f), (0.06, 1.0)
    )


def brake_drag(p: Physics) -> LawComparison:
    time = np.arange(0, 8, 0.01)
    brake = np.where((time > 0.5) & (time < 1.1), 800.0, 0.0)
    brake = smooth_hann(np.where((time > 4) & (time < 4.8), 350.0, brake), 0.015)
    speed = 50 - 6 * np.clip(time - 0.5, 0, 0.6) + 4 * np.maximum(0, np.sin(time))
    found = evaluate_path(p, 0.01, {"W_W": speed, "brake": brake}, free={"DRAG": 0})["drag"]
    starts = [(2, 0.2, 1), (0.2, 2, 0.5), (1, 1, 3)]
    return LawComparison(
        found, 0 * found,
        lambda f: library.brake_drag(brake, 0.01, f[0], f[1], abs(f[2])), (50.0, 0.1, 3.0), starts,
    )  # fmt: skip


def sensor_eccentricity(p: Physics) -> LawComparison:
    speed = np.linspace(5, 60, 1500)
    angle = np.cumsum(speed) * 2 * MS
    found = evaluate_path(p, 2 * MS, {"W_W": speed, "A_W": angle})["encoder"]
    return LawComparison(
        found, speed, lambda f: library.eccentric(speed, angle, *f), (0.01, 1.0, 0.005),
        [(1, -2, 0), (1, 3, 0), (1, 5, 1)],
    )  # fmt: skip


def _shuffle() -> Array:
    """A wheel's speed that rises and shuffles, ever faster [rad/s]."""
    time = np.arange(0, 3, MS)
    return np.asarray(20 + 5 * time + 0.6 * chirp(time, 1.0, 3.0, 10.0))


def sensor_lag(p: Physics) -> LawComparison:
    """Behind the filter that both know, which the generator's second order stands for."""
    w = _shuffle()
    found = evaluate_path(p, MS, {"W_W": w}, free={"SENSE": w[0], "SENSE_RATE": 0})["SENSE"]
    clean = library.first_order(w, MS, p.tau_f)
    return LawComparison(
        found, clean, lambda f: library.lag(clean, MS, abs(f[0]), f[1]), (0.03, 0.5),
        [(0.5, 2), (1, 2.5)],
    )  # fmt: skip


def sensor_delay(p: Physics) -> LawComparison:
    w = library.first_order(_shuffle(), MS, p.tau_f)
    rng = np.random.default_rng(1)
    late = sample_frames(w, rng, p.sense_frame_s, p.sense_jitter_s, p.sense_transport_s)
    return LawComparison(late, w, lambda f: library.delay(w, MS, f[0]), (0.03,), [(1.5,), (2.0,)])


LAWS: tuple[Callable[[Physics], LawComparison], ...] = (
    actuator_lag, actuator_delay, torque_rate_limit, torque_derating, torque_drift, torque_ripple,
    load_dependent_loss, brake_drag,
    elastic.unequal_half_shafts, elastic.second_gap, elastic.stiffness_nonlinear,
    elastic.stiffness_hysteresis, elastic.position_dependent_stiffness, elastic.mount_compliance,
    elastic.added_inertia, elastic.tyre_slip,
    sensor_eccentricity, sensor_lag, sensor_delay,
)  # fmt: skip
COMPARISONS = {
    "coulomb_friction": dry_friction,
    "stribeck_friction": dry_friction,
    **{law.__name__: law for law in LAWS},
}
"""By the generator's name of the effect."""
