"""In C: the hand-written rival (tests/benchmark/peers), compiled with the flags of our own C."""

from __future__ import annotations

import ctypes
import subprocess
import threading
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from codegen.toolchain.compiler import FLAGS, find_compiler
from tests.benchmark.manoeuvre import Manoeuvre
from tests.benchmark.reference_solution import Solution

HERE = Path(__file__).resolve().parent
PEERS = HERE / "peers"
BUILD = HERE.parents[1] / "build" / "bench"
PARAMETERS = 23
SUMMARY = 4
MOST_EVENTS = 200
Reals = NDArray[np.float64]


@cache
def library() -> ctypes.CDLL:
    """Return the rival, compiled and loaded."""
    BUILD.mkdir(parents=True, exist_ok=True)
    target = BUILD / "driveline_rk4.so"
    source = PEERS / "driveline_rk4.c"
    command = [*find_compiler(), *FLAGS, "-fPIC", "-shared", "-o", str(target), str(source), "-lm"]
    subprocess.run(command, check=True)
    loaded = ctypes.CDLL(str(target))
    pointer, whole, real = ctypes.c_void_p, ctypes.c_int, ctypes.c_double
    loaded.sim.argtypes = [pointer, real, whole, *[pointer] * 3, whole, pointer]
    loaded.sim.restype = whole
    loaded.sweep.argtypes = [pointer, whole, ctypes.c_long, real, whole, pointer]
    loaded.sweep.restype = None
    return loaded


def rival_parameters(case: Manoeuvre) -> Reals:
    """Return the parameters of a manoeuvre in the rival's order (23,)."""
    p = case.values()
    r_w, m = p["r_w"], p["m"]
    inertia = m * r_w**2 + 4 * p["J_wh"]
    rolling = [p[name] * r_w for name in ("C_0", "C_1", "C_2")]
    plant = [p["J_em"], p["R"], p["b_em"], p["b_w"], m, p["g"], r_w, inertia, *rolling]
    drag = p["a_aer"] * r_w**3
    ends = [case.step_ms / 1000, case.horizon_ms / 1000, 40 / 3.6 / r_w, *case.torques, 1]
    return np.array([*plant, drag, 0, 0, p["k_hs"], p["c_hs"], p["alpha"], *ends], dtype=float)


class CompiledRival:
    """One manoeuvre at one step [s], with located events."""

    def __init__(self, case: Manoeuvre, step: float) -> None:
        """Take the arrays that the rival reads and fills."""
        self.step = step
        self.parameters = rival_parameters(case)
        self.w_em = np.zeros(case.horizon_ms + 1)
        self.times, self.modes = np.zeros(MOST_EVENTS), np.zeros(MOST_EVENTS)
        self._arrays = [_at(a) for a in (self.w_em, self.times, self.modes)]

    def run(self) -> int:
        """Run once; the motor's speed is kept at each millisecond, and every event."""
        count: int = library().sim(
            _at(self.parameters), self.step, 1, *self._arrays, MOST_EVENTS, None
        )
        return count

    def solution(self) -> Solution:
        """Run once and return what is found."""
        count = self.run()
        events = zip(self.times[:count].tolist(), self.modes[:count].tolist(), strict=True)
        return Solution(
            tuple((time, int(mode)) for time, mode in events),
            tuple(range(len(self.w_em))),
            self.w_em.copy(),
        )


def run_sweep(rows: Reals, step: float, threads: int = 1) -> Reals:
    """Run variants (n, 23) in some threads; return w_em, first contact, events, peak (n, 4)."""
    found = np.zeros((len(rows), SUMMARY))
    parts: Sequence[NDArray[np.int64]] = np.array_split(np.arange(len(rows)), threads)
    workers = []
    for part in parts:
        given, kept = rows[part[0] : part[-1] + 1], found[part[0] : part[-1] + 1]
        arguments = (_at(given), PARAMETERS, len(part), step, 1, _at(kept))
        workers.append(threading.Thread(target=library().sweep, args=arguments))
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    return found


def _at(array: Reals) -> int:
    return array.ctypes.data
