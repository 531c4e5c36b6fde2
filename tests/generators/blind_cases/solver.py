"""The C solver: compiled once into a cache folder, called through ctypes."""

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
import numpy.typing as npt

from tests.generators.blind_cases.physical_parameters import Physics

Array = npt.NDArray[np.float64]

STEP_S = 0.001
"""Distance of inputs and outputs [s]."""
SUBSTEPS = 10
"""Integration steps in one of those: 100 us, contact events located within."""
RUN_UP_S = 1.2
"""Settling before the first sample, the vehicle's speed held [s]."""
OUTPUTS = 7
SOURCES = ("driveline.c", "state.h", "shaft.h", "flow.h", "motion.h")
COMPILE = ("cc", "-O2", "-std=c11", "-shared", "-fPIC", "-ffp-contract=off", "-Wall", "-Wextra")


class CPhysics(ctypes.Structure):
    """The dataclass `Physics` as C sees it."""

    _fields_ = [(field.name, ctypes.c_double) for field in fields(Physics)]


@dataclass(frozen=True)
class Motion:
    """What the driveline did, every STEP_S; torques of the couplings in N*m, energy in J."""

    w_em: Array
    w_w: Array
    torque: Array
    contact: Array
    energy: Array


def header() -> str:
    """C declaration of the structure with the fields of `Physics`."""
    lines = [f"    double {field.name};" for field in fields(Physics)]
    return "\n".join(["typedef struct {", *lines, "} Physics;", ""])


def cache_folder() -> Path:
    """Where compiled solvers are kept: outside of the source tree."""
    root = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(root) / "concealed-driveline"


def compile_solver() -> Path:
    """The shared library for the present sources, compiled if it is not there yet."""
    here = Path(__file__).parent
    text = header() + " ".join(COMPILE) + "".join((here / name).read_text() for name in SOURCES)
    folder = cache_folder()
    library = folder / f"driveline_{hashlib.sha256(text.encode()).hexdigest()[:16]}.so"
    if library.exists():
        return library
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        for name in SOURCES:
            shutil.copyfile(here / name, Path(scratch) / name)
        (Path(scratch) / "physics.h").write_text(header())
        fresh = Path(scratch) / "driveline.so"
        source = str(Path(scratch) / SOURCES[0])
        subprocess.run([*COMPILE, source, "-o", str(fresh), "-lm"], check=True)
        os.replace(fresh, library)
    return library


@cache
def solver() -> ctypes.CDLL:
    """The loaded library."""
    library = ctypes.CDLL(str(compile_solver()))
    pointer = ctypes.POINTER(ctypes.c_double)
    whole = ctypes.c_long
    library.driveline_run.argtypes = [
        ctypes.POINTER(CPhysics), whole, whole, whole, ctypes.c_double, pointer, pointer,
    ]  # fmt: skip
    library.driveline_run.restype = None
    return library


def solve(physics: Physics, speed: float, inputs: Array, substeps: int = SUBSTEPS) -> Motion:
    """Run from wheel speed `speed` [rad/s] under inputs (rows of demand, brake, road torque,
    motor torque noise, all N*m, STEP_S apart, straight lines between)."""
    given = np.ascontiguousarray(inputs, dtype=np.float64)
    out = np.empty((len(given), OUTPUTS))
    values = CPhysics(*(getattr(physics, field.name) for field in fields(physics)))
    pointer = ctypes.POINTER(ctypes.c_double)
    solver().driveline_run(
        ctypes.byref(values), len(given), round(RUN_UP_S / STEP_S), substeps, speed,
        given.ctypes.data_as(pointer), out.ctypes.data_as(pointer),
    )  # fmt: skip
    if not np.isfinite(out).all():
        raise FloatingPointError("the driveline's motion is not finite")
    return Motion(out[:, 0], out[:, 1], out[:, [2, 4]], out[:, [3, 5]], out[:, 6])
