"""Solver: `driveline.c`, compiled once into a cache folder and called by ctypes."""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import subprocess
import tempfile
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Reals = NDArray[np.float64]
RATE_HZ = 20_000
"""Integration steps per second."""
COMPILE = ("cc", "-O2", "-std=c11", "-shared", "-fPIC", "-ffp-contract=off", "-Wall", "-Wextra")


@dataclass(frozen=True)
class Physics:
    """Parameters of the driveline in SI units, those of the shaft and of the vehicle at the wheel.

    A size of 0 means that an effect is absent.
    """

    J_em: float
    """Inertia of the rotor [kg*m^2]."""
    k: float
    """Stiffness of the half-shafts [N*m/rad]."""
    c: float
    """Damping of the half-shafts [N*m*s/rad]."""
    alpha: float
    """Half of the gap [rad]."""
    b_em: float
    """Viscous loss of the rotor [N*m*s/rad]."""
    J_v: float
    """Inertia of the vehicle [kg*m^2]."""
    b_w: float
    """Viscous loss of the wheel [N*m*s/rad]."""
    f0: float
    """Rolling resistance [N*m]."""
    cd2: float
    """Drag of the air [N*m*s^2/rad^2]."""
    tau_f: float
    """Time constant of the filter of the wheel speed [s]."""
    lag: float = 0.0
    """Time constant of the delivered torque [s]."""
    delay: float = 0.0
    """Delay of the delivered torque [s]; applied to the inputs, not in C."""
    rate: float = 0.0
    """Largest rate of the delivered torque [N*m/s]."""
    power: float = 0.0
    """Largest power of the motor [W]."""
    drift: float = 0.0
    """Part of the torque that is lost when the motor is warm [-]."""
    ripple: float = 0.0
    """Amplitude of the ripple of the torque [N*m]."""
    order: float = 0.0
    """Periods of the ripple per turn of the motor [-]."""
    friction: float = 0.0
    """Dry friction of the rotor [N*m]."""
    loss: float = 0.0
    """Loss of the gear per torque that it transmits [-]."""
    grade: float = 0.0
    """Torque of the slope at the wheel [N*m]; its sign and size are drawn for each recording."""
    hardening: float = 0.0
    """Hardening (> 0) or softening (< 0) of the half-shafts [-]."""
    slip: float = 0.0
    """Torque at which all sliders slide [N*m]."""
    second: float = 0.0
    """Twist at which the parallel coupling reaches its end [rad]."""
    unround: float = 0.0
    """Relative change of the stiffness with the angle of the wheel [-]."""
    J_h: float = 0.0
    """Inertia of the housing [kg*m^2]."""
    k_h: float = 0.0
    """Stiffness of the mounts [N*m/rad]."""
    c_h: float = 0.0
    """Damping of the mounts [N*m*s/rad]."""
    C_t: float = 0.0
    """Torque of the tyre per slip [N*m]."""
    relaxation: float = 0.0
    """Relaxation length of the tyre [m]; the radius is 0.3 m."""
    J_w: float = 0.0
    """Inertia of the wheel without the vehicle [kg*m^2]."""
    late: float = 0.0
    """Delay of the wheel speed [s]; applied to the samples, not in C."""
    eccentric: float = 0.0
    """Relative error of the wheel speed, once per turn [-]."""


class CPhysics(ctypes.Structure):
    """The dataclass `Physics` as C sees it."""

    _fields_ = [(field.name, ctypes.c_double) for field in fields(Physics)]


def compile_solver() -> Path:
    """Return the shared library of `driveline.c`, compiled if it is not in the cache folder."""
    source = Path(__file__).with_name("driveline.c")
    lines = [f"    double {field.name};" for field in fields(Physics)]
    header = "\n".join(["typedef struct {", *lines, "} Physics;", ""])
    text = header + " ".join(COMPILE) + source.read_text("utf-8")
    root = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    folder = Path(root) / "driveline-b"
    library = folder / f"driveline_{hashlib.sha256(text.encode()).hexdigest()[:16]}.so"
    if library.exists():
        return library
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        shutil.copyfile(source, Path(scratch) / source.name)
        (Path(scratch) / "physics.h").write_text(header)
        fresh = Path(scratch) / "driveline.so"
        given = [str(Path(scratch) / source.name), "-o", str(fresh), "-lm"]
        subprocess.run([*COMPILE, *given], check=True)
        os.replace(fresh, library)
    return library


@cache
def _library() -> ctypes.CDLL:
    """Return the loaded library."""
    library = ctypes.CDLL(str(compile_solver()))
    reals, real, whole = ctypes.POINTER(ctypes.c_double), ctypes.c_double, ctypes.c_long
    library.driveline_run.argtypes = [
        ctypes.POINTER(CPhysics), whole, whole, real, real, real, reals, reals,
    ]  # fmt: skip
    library.driveline_run.restype = None
    return library


def simulate(physics: Physics, inputs: Reals, stride: int, speed: float, angle: float) -> Reals:
    """Return motor speed and sensed wheel speed [rad/s] (samples, 2) of every `stride`-th row.

    `inputs` (rows, 4) are demanded and brake torque, and disturbances at motor and wheel [N*m],
    1 / `RATE_HZ` apart. `speed` [rad/s] is that of the wheel at the start, `angle` [rad] that of
    the motor. Raises FloatingPointError if the motion is not finite.
    """
    given = np.ascontiguousarray(inputs, dtype=np.float64)
    out = np.empty(((len(given) - 2) // stride + 1, 2))
    values = CPhysics(*(getattr(physics, field.name) for field in fields(physics)))
    reals = ctypes.POINTER(ctypes.c_double)
    _library().driveline_run(
        ctypes.byref(values), len(given), stride, 1.0 / RATE_HZ, speed, angle,
        given.ctypes.data_as(reals), out.ctypes.data_as(reals),
    )  # fmt: skip
    if not np.isfinite(out).all():
        raise FloatingPointError("the motion of the driveline is not finite")
    return out
