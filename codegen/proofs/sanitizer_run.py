"""Sanitizer run: executes generated C on random and extreme inputs under the sanitizers of gcc."""

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
"""Number of steps, and the seed of the inputs."""
SPECIAL = (0.0, -0.0, math.nan, math.inf, -math.inf, 5e-324, -1e-40, MAX_FINITE["float32"])
"""Special real inputs: signed zeros, NaN, infinities, subnormals and the largest float32."""
SCALES = (1.0, 100.0, 1e4, 1e30)
"""Magnitudes of random real inputs."""


def check_sanitizers(program: Program, folder: Path) -> ToolVerdict:
    """Run the C of a Program for STEPS steps and return the verdict; files are written to `folder`.

    Raises MissingToolError, BuildError.
    """
    app = build_sanitised("gcc", write_harness(program, folder), folder)
    tool, about = f"gcc {tool_version('gcc', folder)}", f"{STEPS} steps on random inputs"
    return ToolVerdict(
        "sanitizers",
        tool,
        about,
        run_sanitised(app, stdin=_records(program), timeout=TOOL_TIMEOUT).findings,
    )


def _records(program: Program) -> bytes:
    """Return the input records of all steps.

    Each input changes with probability 0.05 in a step, to a value of any magnitude or a special
    value.
    """
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
    """Return the input record of a step without a change of the calibration."""
    return struct.pack(f"<{len(values) + 1}d", *values, 0.0)


def _any(variable: Variable, program: Program, generator: random.Random) -> float:
    """Return a random value of an input, inside or outside of its range."""
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
