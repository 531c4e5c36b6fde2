"""The concealed generator's own laws along a path, called in its own C."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

from tests.generators.blind_cases import solver
from tests.generators.blind_cases.physical_parameters import Physics

Array = npt.NDArray[np.float64]

HERE = Path(__file__).parent
CLOSED = 9
"""Contacts that stay closed whatever they transmit."""
LAWS = ("motor", "friction", "mesh", "shaft", "gear", "tyre", "encoder", "drag")
INPUTS = ("demand", "brake", "road")


@cache
def names() -> tuple[str, ...]:
    """The generator's states in its order."""
    text = (Path(solver.__file__).parent / "state.h").read_text("utf-8")
    listed = text.split("enum {", 1)[1].split("STATES", 1)[0]
    return tuple(re.findall(r"\w+", re.sub(r"/\*.*?\*/", "", listed, flags=re.S)))


@cache
def library() -> ctypes.CDLL:
    """The generator's sources with `forms.c` around them, compiled as it compiles them."""
    with tempfile.TemporaryDirectory() as scratch:
        for name in solver.SOURCES:
            shutil.copyfile(Path(solver.__file__).parent / name, Path(scratch) / name)
        shutil.copyfile(HERE / "forms.c", Path(scratch) / "forms.c")
        (Path(scratch) / "physics.h").write_text(solver.header())
        made = Path(scratch) / "forms.so"
        source = str(Path(scratch) / "forms.c")
        subprocess.run([*solver.COMPILE, source, "-o", str(made), "-lm"], check=True)
        return ctypes.CDLL(str(made))


def _pointer(values: npt.NDArray[np.generic]) -> ctypes.c_void_p:
    return ctypes.c_void_p(values.ctypes.data)


def _numbers(physics: Physics) -> solver.CPhysics:
    return solver.CPhysics(*(getattr(physics, field.name) for field in fields(physics)))


def evaluate_path(
    physics: Physics,
    step: float,
    given: Mapping[str, Array],
    *,
    free: Mapping[str, float] | None = None,
    contact: int = CLOSED,
) -> dict[str, Array]:
    """States and laws by name along the path of the states and inputs that are `given`.

    `free` states begin at their values and move as the generator moves them; others are zero.
    """
    rows = len(next(iter(given.values())))
    order = names()
    states, inputs = np.zeros((rows, len(order))), np.zeros((rows, len(INPUTS)))
    for name, values in given.items():
        table, columns = (inputs, INPUTS) if name in INPUTS else (states, order)
        table[:, columns.index(name)] = values
    for name, value in (free or {}).items():
        states[0, order.index(name)] = value
    is_free = np.array([name in (free or {}) for name in order], dtype=np.intc)
    out = np.empty((rows, len(LAWS)))
    library().walk(
        ctypes.byref(_numbers(physics)), ctypes.c_long(rows), ctypes.c_double(step),
        _pointer(is_free), ctypes.c_int(contact), _pointer(inputs), _pointer(states),
        _pointer(out),
    )  # fmt: skip
    named = dict(zip((*order, *LAWS), np.hstack([states, out]).T, strict=True))
    return {name: values.copy() for name, values in named.items()}


def limit_rate(physics: Physics, step: float, demand: Array) -> Array:
    """The demand as the generator's rate limiter lets it through."""
    given, out = np.ascontiguousarray(demand), np.empty(len(demand))
    library().limit(
        ctypes.byref(_numbers(physics)), ctypes.c_long(len(given)), ctypes.c_double(step),
        _pointer(given), _pointer(out),
    )  # fmt: skip
    return out
