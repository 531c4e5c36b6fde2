"""Laws of shaft, mounts and tyre: the generator's and the library's on a typical excitation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tests.generators.blind_cases.physical_parameters import Physics
from tests.validation.functional_forms import library_forms as library
from tests.validation.functional_forms.form_fit import MS, LawComparison, steps
from tests.validation.functional_forms.generator_forms import evaluate_path
from tests.validation.functional_forms.library_forms import Array


def _twist(top: float) -> tuple[Array, Array]:
    """A twist to and fro with ever larger swings [rad], and its rate."""
    time = np.arange(0, 1.4, MS)
    x = top * (0.15 + 0.6 * time) * np.sin(9 * time) + 0.05 * top * np.sin(50 * time)
    return x - x[0], np.gradient(x, MS)


def unequal_half_shafts(p: Physics) -> LawComparison:
    """The whole shaft's stiffness and gap are free too."""
    x, rate = _twist(0.12)
    free = {"GAP_0": 0.0, "GAP_1": 0.0}
    found = evaluate_path(p, MS, {"TWIST_0": x, "W_EM": p.ratio * rate}, free=free, contact=0)[
        "shaft"
    ]
    clean = library.with_gap(x, rate, MS, p.k, p.c, p.alpha)

    def law(f: Array) -> Array:
        one = library.with_gap(x, rate, MS, f[3], p.c, abs(f[2]))
        two = library.with_gap(x, rate, MS, f[3], p.c, abs(f[1]))
        return np.asarray(f[0] * one + (1 - f[0]) * two)

    gaps = (p.alpha * (1 - p.gap_skew), p.alpha * (1 + p.gap_skew))
    starts = [(1.1, 0.8, 1.1, 1), (0.9, 1.2, 0.9, 1)]
    return LawComparison(found, clean, law, (p.share_left, *gaps, p.k), starts)


def second_gap(p: Physics) -> LawComparison:
    """The contact of the second gap alone while the driveline is shaken by steps and a sweep.

    The generator moves all of it; clean is the same contact without a gap.
    """
    free = dict.fromkeys(("TWIST_0", "TWIST_1", "GAP_0", "GAP_1"), 0.0)
    speeds = {"W_EM": 30 * p.ratio, "W_MID": 30.0, "W_W": 30.0, "W_V": 30.0}
    moved = evaluate_path(
        p, 0.1 * MS, {"demand": steps(2, 0.1 * MS)}, free=free | speeds, contact=0
    )
    x, found = moved["TWIST_1"], moved["gear"]
    rate = moved["W_EM"] / p.ratio - moved["W_MID"]

    starts = [(0.9, 0.5, 1), (1.1, 0.2, 1.1), (1, 1, 0.9)]
    typical = (p.mid_k, p.mid_c, p.mid_alpha)
    clean = p.mid_k * x + p.mid_c * rate
    return LawComparison(found, clean, lambda f: library.second_gap(x, rate, *f), typical, starts)


def stiffness_nonlinear(p: Physics) -> LawComparison:
    x = np.linspace(-0.2, 0.2, 401)
    found = evaluate_path(replace(p, c=0.0), MS, {"TWIST_0": x})["shaft"]
    return LawComparison(
        found, p.k * x, lambda f: library.nonlinear(x, *f), (p.k, p.knee_gain, 0.1),
        [(0.7, 2, 1), (1, 1, 2), (1.2, 0.7, 0.6)],
    )  # fmt: skip


def stiffness_hysteresis(p: Physics) -> LawComparison:
    x, _ = _twist(0.15)
    found = evaluate_path(replace(p, c=0.0), MS, {"TWIST_0": x})["shaft"]
    return LawComparison(
        found, p.k * x, lambda f: library.hysteresis(x, f[0], abs(f[1]), abs(f[2])),
        (p.k, p.k, 100.0), [(1, 0.5, 2), (1.1, 2, 1), (1, 1, 0.5)],
    )  # fmt: skip


def position_dependent_stiffness(p: Physics) -> LawComparison:
    """A lasting load and a small swing over five turns of the wheel."""
    angle = np.linspace(0, 30, 600)
    x = 0.1 + 0.03 * np.sin(1.7 * angle)
    found = evaluate_path(replace(p, c=0.0), MS, {"TWIST_0": x, "A_W": angle})["shaft"]
    starts = [(1, 1, 1, turn, 0, 0, 0.5, 0.5) for turn in (0.1, 3.0, -2.0)]
    return LawComparison(
        found, p.k * x, lambda f: library.position(x, angle, f[0], f[1], f[2], f[3], f[4:]),
        (p.k, 0.15, 1.0, 1.0, 0.02, 0.02, 0.08, 0.08), starts,
    )  # fmt: skip


def mount_compliance(p: Physics) -> LawComparison:
    """The housing's angle under a torque in steps and a sweep, motor and shaft held."""
    torque = steps(2)
    held = replace(p, ratio=1e9)
    found = evaluate_path(
        held, 2 * MS, {"demand": torque}, free={"MOUNT": 0, "W_MOUNT": 0, "MOUNT_2": 0}
    )["MOUNT"]
    return LawComparison(
        found, 0 * found, lambda f: library.mount(torque, 2 * MS, *np.abs(f)),
        (p.mount_J, p.mount_k, p.mount_c), [(1, 1.2, 2)],
    )  # fmt: skip


def _under_brake(p: Physics, free: Sequence[str]) -> tuple[Array, Array]:
    """Torque on the rim, and the change of its speed; no other losses."""
    torque = 8 * steps(2)
    bare = replace(p, f0=0.0, cd2=0.0, b_w=0.0, k=0.0, c=0.0)
    begin = {"W_W": 60.0, "W_V": 60.0, **dict.fromkeys(free, 0.0)}
    found = evaluate_path(bare, 2 * MS, {"brake": -torque}, free=begin)["W_W"] - 60.0
    return torque, found


def added_inertia(p: Physics) -> LawComparison:
    """The library has none of that name: its nearest, `compliance`."""
    torque, found = _under_brake(p, ("TYRE", "TYRE_2"))
    clean = np.concatenate([[0], np.cumsum(0.5 * (torque[1:] + torque[:-1]))]) * 2 * MS / p.J_v
    near = p.rim_J / p.J_v

    def law(f: Array) -> Array:
        return library.compliance(torque, 2 * MS, p.J_v, *np.abs(f))

    return LawComparison(found, clean, law, (near, p.tyre_k, p.tyre_c), [(1, 1.2, 1.5)])


def tyre_slip(p: Physics) -> LawComparison:
    """Slip that it settles at over the torque, up to 2200 N*m at 40 rad/s."""
    slip = np.linspace(-0.3, 0.3, 601)
    given = {"TYRE": p.relaxation * slip, "W_W": 40 * (1 + slip), "W_V": np.full(601, 40.0)}
    torque = evaluate_path(p, MS, given)["tyre"]
    rising = np.abs(torque) < 2200
    slip, torque = slip[rising], torque[rising]
    return LawComparison(slip, 0 * slip, lambda f: library.tyre_slip(torque, 1 / f[0]), (5e-5,))
