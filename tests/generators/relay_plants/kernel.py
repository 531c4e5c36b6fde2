"""The compiled integrator: builds `kernel.c` once and calls it."""

import ctypes
import hashlib
import os
import subprocess
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]  # of float64

# Kinds of machine, as in the enum of kernel.c.
OVEN, BRIDGE, TANK = 0, 1, 2
# Names of the parameters. S0 S1: storages of the states; S2 K2 PLACE: a second storage, its
# coupling and its state; A0 A1 A2: constants of the machine; HYST: half of the hysteresis of the
# switch inside the machine; LIN, NON: missing linear and nonlinear losses per state; N_REF N_EXP:
# reference and exponent of the nonlinear loss; DERATE above DERATE_AT: PTC of the heater.
PARAMETERS = (
    "KIND", "S0", "S1", "S2", "K2", "PLACE", "A0", "A1", "A2", "HYST", "P_REF",
    "LIN0", "LIN1", "NON0", "NON1", "N_REF", "N_EXP", "DERATE", "DERATE_AT",
)  # fmt: skip
STATES, CHANNELS = 3, 5


@cache
def _library() -> Any:
    header = "enum { " + ", ".join(PARAMETERS) + " };\n#line 1\n"
    source = header + (Path(__file__).parent / "kernel.c").read_text()
    digest = hashlib.sha256(source.encode()).hexdigest()[:16]
    folder = Path(tempfile.gettempdir()) / f"relay_plants_{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    library = folder / f"{digest}.so"
    if not library.exists():
        with tempfile.TemporaryDirectory(dir=folder) as work:
            text = Path(work) / "kernel.c"
            text.write_text(source)
            built = Path(work) / "kernel.so"
            flags = ["-O2", "-ffp-contract=off", "-shared", "-fPIC", "-Wall"]
            subprocess.run(["cc", *flags, str(text), "-o", str(built), "-lm"], check=True)
            built.replace(library)
    return ctypes.CDLL(str(library))


def simulate(
    parameters: Mapping[str, float], step: float, left: Array, right: Array, start: Array
) -> tuple[Array, NDArray[np.int32]]:
    """Integrate from `start` over the grid intervals of `step` seconds.

    `left` and `right` (intervals x CHANNELS) are the inputs at both ends of each interval.
    Returns the states (nodes x STATES) and the modes at the nodes.
    """
    values = np.array([parameters.get(name, 0.0) for name in PARAMETERS])
    left, right = np.ascontiguousarray(left), np.ascontiguousarray(right)
    states = np.zeros((len(left) + 1, STATES))
    states[0] = start
    modes = np.zeros(len(left) + 1, dtype=np.int32)
    pointer = ctypes.c_void_p
    _library().run(
        pointer(values.ctypes.data),
        ctypes.c_long(len(left)),
        ctypes.c_double(step),
        pointer(left.ctypes.data),
        pointer(right.ctypes.data),
        pointer(states.ctypes.data),
        pointer(modes.ctypes.data),
    )
    return states, modes
