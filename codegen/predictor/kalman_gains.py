"""Kalman gains of a linear model, sample by sample, in C that is compiled for its size."""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any

import numpy as np

from codegen.predictor.predictor_arrays import Reals
from codegen.toolchain.build_cache import get_or_build, key_of
from codegen.toolchain.compiler import (
    compile_program,
    compiler_version,
    find_compiler,
    flags_at_level,
    load_shared_library,
)
from codegen.toolchain.templates import render
from language.text.temporary_files import temporary_folder

MAX_SAMPLES = 5000
"""Maximum number of samples; a gain that still changes then is taken as the steady-state gain."""
STEADY_TOLERANCE = 1e-6
"""Relative change of a gain from sample to sample, in terms of its largest entry, below which it is
steady."""
FLAGS = (*flags_at_level("Og"), "-shared", "-fPIC", "-w")
"""Compiler flags of the recursion."""


def compute_kalman_gains(
    phi: Reals,
    c: Reals,
    q: Reals,
    r: Reals,
    initial_covariance: Reals,
    transient_samples: int,
    max_samples: int = MAX_SAMPLES,
) -> tuple[Reals, Reals, Reals] | None:
    """Return transient gains, the steady-state gain, and the covariance after the last sample.

    The model is x(k+1) = phi x(k) + w, y = c x + v. `q` (states, states) is the covariance of w,
    `r` (outputs,) holds the variances of v, `initial_covariance` (states, states) is the covariance
    before the first sample. The transient gains (transient_samples, states, outputs) are those of
    the first samples. The recursion goes on until the gain changes by less than STEADY_TOLERANCE,
    or up to `max_samples`; the last gain (states, outputs) is the steady one, also if it still
    changes. Returns None if a gain exceeds all bounds. Raises MissingToolError, BuildError.
    """
    outputs, states = c.shape
    transient, steady = np.empty((transient_samples, states, outputs)), np.empty((states, outputs))
    covariance = np.ascontiguousarray(initial_covariance, dtype=np.float64).copy()
    arrays = [np.ascontiguousarray(a, dtype=np.float64) for a in (phi, c, q, r)]
    results = (transient, steady)
    done = _compile_recursion(states, outputs)(
        *(a.ctypes.data for a in (*arrays, covariance)),
        *(transient_samples, max_samples, STEADY_TOLERANCE),
        *(a.ctypes.data for a in results),
    )
    return (transient, steady, covariance) if done >= 0 else None


@cache
def _compile_recursion(states: int, outputs: int) -> Any:
    """Return the C function of the recursion for a size, compiled if it is not in the cache."""
    with temporary_folder() as folder:
        source = folder / "kalman_gains.c"
        source.write_text(
            render("predictor/kalman_gains.c.jinja", {"states": states, "seen": outputs})
        )
        key = key_of([source], [*find_compiler(), *FLAGS], compiler_version())
        path = get_or_build(key, lambda made: compile_program([source], made, FLAGS), source.parent)
        function = load_shared_library(path).modewright_gains
    pointer, whole = ctypes.c_void_p, ctypes.c_long
    function.argtypes = [*[pointer] * 5, whole, whole, ctypes.c_double, pointer, pointer]
    function.restype = whole
    return function
