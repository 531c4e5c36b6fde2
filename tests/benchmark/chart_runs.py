"""Chart: the three modes of peers/mode_switch.c as a spec, and our ways to run it."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from codegen.emit.c_module import emit_c_files
from codegen.toolchain.compiler import FLAGS, find_compiler
from engine.interpreter.interpreter import Interpreter
from language.ir.number_type import NumberType
from language.ir.program import Program
from modewright.api.simulation import program as program_of_spec

HERE = Path(__file__).resolve().parent
TICKS, TICKS_IN_C = 20_000, 200_000
RANGES = {"theta": ", range: [-1, 1]", "torque": ", range: [-400, 400]"}
SPEC = """\
language: 1
automaton: mode_switch
period: 1 ms
numbers: {numbers}
inputs: {{theta: {{unit: rad{theta}}}, torque: {{unit: N*m{torque}}}}}
initial: gap
modes:
  gap:
    transitions:
      drive: {{when: theta >= 0.02 rad, wait: 5 ms, priority: 1}}
      coast: {{when: theta <= -0.02 rad, wait: 5 ms, priority: 2}}
  drive: {{transitions: {{gap: {{when: torque < -1 N*m}}}}}}
  coast: {{transitions: {{gap: {{when: torque > 1 N*m}}}}}}
outputs: [mode]
"""
Singles = NDArray[np.float32]
Run = Callable[[], int]
"""Makes the chart anew and ticks it; the number of transitions."""


@dataclass(frozen=True)
class Inputs:
    """What the peer's own main feeds: an angle [rad] and a torque [N*m] per tick (n_ticks,)."""

    theta: Singles
    torque: Singles

    def pairs(self) -> list[tuple[float, float]]:
        """Return them as numbers of Python, tick by tick."""
        return list(zip(self.theta.tolist(), self.torque.tolist(), strict=True))


def chart_inputs(ticks: int) -> Inputs:
    """Return the inputs of the first ticks, which repeat after 20 s."""
    t = np.arange(ticks) % 20_000 * 1e-3
    slow = 2 * np.pi * 2 * t
    theta = 1.5 * 0.02 * np.sin(slow) + 0.15 * 0.02 * np.sin(2 * np.pi * 130 * t)
    return Inputs(theta.astype(np.float32), (3 * np.sin(slow + 1.2)).astype(np.float32))


@cache
def program(numbers: NumberType, ranges: bool = False) -> Program:
    """Return the checked and lowered spec; the peer holds its inputs in no range."""
    held = RANGES if ranges else dict.fromkeys(RANGES, "")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mode_switch.yaml"
        path.write_text(SPEC.format(numbers=numbers, **held))
        return program_of_spec(str(path))


def make_interpreter_run(ticks: int) -> Run:
    """Return what runs the interpreter."""
    made, fed = program("float64"), chart_inputs(ticks).pairs()

    def run() -> int:
        stepper = Interpreter(made)
        put, tick = stepper.set, stepper.run
        read = stepper.make_reader(("memory.fired", "memory.mode"))
        fired = 0
        for theta, torque in fed:
            put("input.theta", theta)
            put("input.torque", torque)
            tick("step")
            fired += read()[0] != 0
        return fired

    return run


def make_compiled_runs(ticks: int, ranges: bool = False, held: bool = False) -> tuple[Run, Run]:
    """Return what runs our C, and what runs the peer's, both in one library.

    With `held` the side by hand is mode_switch_held.c, which holds its inputs in ranges as well.
    """
    fed, loops = chart_inputs(ticks), _library(ranges)
    hand = loops.loop_by_hand_held if held else loops.loop_by_hand
    ours = np.ascontiguousarray(np.stack([fed.theta, fed.torque], axis=1))

    def generated() -> int:
        return int(loops.loop_generated(ours.ctypes.data, ticks))

    def by_hand() -> int:
        return int(hand(fed.theta.ctypes.data, fed.torque.ctypes.data, ticks))

    return generated, by_hand


@cache
def _library(ranges: bool) -> ctypes.CDLL:
    """Return both sides compiled with the same flags; calls inside it take no detour."""
    made = program("float32", ranges)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in emit_c_files(made).items():
            (folder / file).write_text(text)
        sources = [HERE / "chart_loops.c", *sorted(folder.glob("*.c"))]
        target = folder / "chart.so"
        shared = ("-fPIC", "-shared", "-Wl,-Bsymbolic", f"-I{folder}", "-o", str(target))
        command = [*find_compiler(), *FLAGS, *shared, *map(str, sources), "-lm"]
        subprocess.run(command, check=True)
        loaded = ctypes.CDLL(str(target))
    pointer, whole = ctypes.c_void_p, ctypes.c_int
    loaded.loop_by_hand.argtypes = [pointer, pointer, whole]
    loaded.loop_by_hand_held.argtypes = [pointer, pointer, whole]
    loaded.loop_generated.argtypes = [pointer, whole]
    for loop in (loaded.loop_by_hand, loaded.loop_by_hand_held, loaded.loop_generated):
        loop.restype = ctypes.c_long
    return loaded
