"""The compiled truth simulator `truth.c`, as functions of numpy arrays."""

import ctypes
import re
import subprocess
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SOURCE = Path(__file__).with_name("truth.c")
_ENUM = re.sub(r"/\*.*?\*/", "", SOURCE.read_text().split("enum {")[1].split("}")[0])
SLOTS = {name: i for i, name in enumerate(re.findall(r"\w+", _ENUM))}


class Run(NamedTuple):
    """One recording of n samples with ny signals, in SI units."""

    command: Array  # n, what the controller asks for
    clean: Array  # n, ny, without noise
    measured: Array  # n, ny, with noise and quantisation
    diverged: bool


@cache
def library() -> ctypes.CDLL:
    """The simulator, compiled once per process. The flags keep the bytes equal between runs."""
    with tempfile.TemporaryDirectory() as folder:
        target = str(Path(folder) / "truth.so")
        command = ["cc", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "-o", target, str(SOURCE)]
        subprocess.run([*command, "-lm"], check=True)
        return ctypes.CDLL(target)


def vector(values: Mapping[str, float]) -> Array:
    """The parameter vector with these slots set and all others zero."""
    result = np.zeros(SLOTS["SLOTS"])
    for name, value in values.items():
        result[SLOTS[name]] = value
    return result


def simulate(
    parameters: Array,
    dt: float,
    substeps: int,
    *,
    reference: Array | None = None,
    command: Array | None = None,
    disturbance: Array | None = None,
    noise: Array | None = None,
) -> Run:
    """A run in closed loop with `reference` (4, n) and `noise` (n, ny), or open with `command`.

    `dt` is the sample time [s], `disturbance` (n) a force on the load [N or N*m].
    """
    is_open = reference is None
    ny = 1 if parameters[SLOTS["ROTARY"]] > 0 else 2
    if reference is None:
        assert command is not None
        u = np.array(command, dtype=np.float64)
    else:
        u = np.zeros(reference.shape[1])
    clean, measured = np.zeros((len(u), ny)), np.zeros((len(u), ny))

    def pointer(array: Array | None) -> ctypes.c_void_p:
        return ctypes.c_void_p(None if array is None else array.ctypes.data)

    inputs = [
        None if a is None else np.ascontiguousarray(a, dtype=np.float64)
        for a in (parameters, reference, disturbance, noise)
    ]
    bad = library().simulate(
        pointer(inputs[0]),
        ctypes.c_int(len(u)),
        ctypes.c_int(substeps),
        ctypes.c_double(dt),
        ctypes.c_int(is_open),
        *(pointer(a) for a in (*inputs[1:], u, clean, measured)),
    )
    return Run(u, clean, measured, bool(bad))
