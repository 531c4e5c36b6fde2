"""Sanitised: generated C on hostile inputs, under the sanitizers of gcc for addresses and for C."""

from __future__ import annotations

import math
import random
import struct
from collections.abc import Sequence
from pathlib import Path

from codegen.emit.c_names import c_type
from codegen.harness.harness import tick_inputs, write_harness
from codegen.harness.sanitizers import build_sanitised, run_sanitised
from codegen.toolchain.external_tools import TOOL_TIMEOUT
from codegen.toolchain.tool_verdict import ToolVerdict, tool_version
from language.ir.number_type import MAX_FINITE
from language.ir.program import Program, Variable

STEPS, SEED = 20_000, 1
SPECIAL = (0.0, -0.0, math.nan, math.inf, -math.inf, 5e-324, -1e-40, MAX_FINITE["float32"])
SCALES = (1.0, 100.0, 1e4, 1e30)


def check_sanitizers(program: Program, folder: Path) -> ToolVerdict:
    """Run the C of a Program for many steps. Raises ToolMissing, BuildError."""
    app = build_sanitised("gcc", write_harness(program, folder), folder)
    tool, about = f"gcc {tool_version('gcc', folder)}", f"{STEPS} steps on random inputs"
    return ToolVerdict(
        "sanitizers",
        tool,
        about,
        run_sanitised(app, stdin=_records(program), timeout=TOOL_TIMEOUT).findings,
    )


def _records(program: Program) -> bytes:
    """Return inputs of steps: of any size, held for a while, with numbers that are none between."""
    generator, inputs = random.Random(SEED), tick_inputs(program)
    values = [0.0 for _ in inputs]
    records = []
    for _ in range(STEPS):
        for k, variable in enumerate(inputs):
            if generator.random() < 0.05:
                values[k] = _any(variable, program, generator)
        records.append(_record(values))
    return b"".join(records)


def _record(values: Sequence[float]) -> bytes:
    """Return the inputs of a step, the calibration unchanged."""
    return struct.pack(f"<{len(values) + 1}d", *values, 0.0)


def _any(variable: Variable, program: Program, generator: random.Random) -> float:
    """Return any value of an input: of its range or not."""
    if variable.type == "truth":
        return float(generator.random() < 0.5)
    if variable.type == "whole":
        is_byte = c_type(variable, program.number_type) == "uint8_t"
        low, high = (0, 255) if is_byte else (-(2**31), 2**31 - 1)
        near = generator.randint(-3, 12)
        return float(max(low, near) if generator.random() < 0.8 else generator.randint(low, high))
    if generator.random() < 0.1:
        return generator.choice(SPECIAL)
    return generator.choice(SCALES) * generator.uniform(-1.0, 1.0)
