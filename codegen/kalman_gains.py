"""Kalman gains of a linear model, sample by sample, in C that is compiled for its size."""

from __future__ import annotations

import ctypes
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from codegen.build import compile_program, compiler, compiler_version, optimised
from codegen.cache import key_of, stored
from codegen.rendering import render

Reals = NDArray[np.float64]
MOST_SAMPLES = 5000
"""Samples after which a gain that still changes is taken for the steady one."""
CLOSE = 1e-6
"""A gain that changes by less from sample to sample, of its largest entry, is steady."""
FLAGS = (*optimised("Og"), "-shared", "-fPIC", "-w")


def kalman_gains(
    phi: Reals,
    c: Reals,
    q: Reals,
    r: Reals,
    start: Reals,
    first: int,
    most: int = MOST_SAMPLES,
) -> tuple[Reals, Reals, Reals] | None:
    """Return the gains of the `first` samples (first, states, seen), the one that stays, and the
    covariance then.

    Of x(k+1) = phi x(k) + w, y = c x + v with covariance `q` of w, variances `r` (seen,) of v,
    from a covariance `start`. One that still changes after `most` samples is taken as it is then.
    None where they grow beyond all bounds. Raises ToolMissing, BuildError.
    """
    seen, states = c.shape
    firsts, steady = np.empty((first, states, seen)), np.empty((states, seen))
    covariance = np.ascontiguousarray(start, dtype=np.float64).copy()
    given = [np.ascontiguousarray(a, dtype=np.float64) for a in (phi, c, q, r)]
    told = (firsts, steady)
    done = _recursion(states, seen)(
        *(a.ctypes.data for a in (*given, covariance)),
        *(first, most, CLOSE),
        *(a.ctypes.data for a in told),
    )
    return (firsts, steady, covariance) if done >= 0 else None


@cache
def _recursion(states: int, seen: int) -> Any:
    """Return the compiled recursion for a size, kept from an earlier run if there was one."""
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        source = Path(name) / "kalman_gains.c"
        source.write_text(render("kalman_gains.c.jinja", {"states": states, "seen": seen}))
        key = key_of([source], [*compiler(), *FLAGS], compiler_version())
        path = stored(key, lambda made: compile_program([source], made, FLAGS), source.parent)
        function = ctypes.CDLL(str(path)).modewright_gains
    pointer, whole = ctypes.c_void_p, ctypes.c_long
    function.argtypes = [*[pointer] * 5, whole, whole, ctypes.c_double, pointer, pointer]
    function.restype = whole
    return function
