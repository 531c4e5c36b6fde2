"""Instructions: how many a step of generated C takes on an emulated Cortex-M4F."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from codegen.harness.harness import HarnessMain, build_executable
from codegen.toolchain.compiler import FLAGS
from codegen.toolchain.machine import CORTEX_M4F, run_in_qemu
from language.ir.program import Program

MAIN = HarnessMain("harness/instructions_main.c.jinja", ("instructions.h", "instructions.c"))
ICOUNT_OPTIONS = ("-icount", "shift=0")
"""Of the emulator: one instruction takes 1 ns."""


@dataclass(frozen=True)
class InstructionCounts:
    """What each step took, the call included."""

    steps: tuple[int, ...]

    @cached_property
    def mean(self) -> float:
        """The mean of all steps, 0 if there are none."""
        return sum(self.steps) / max(len(self.steps), 1)

    def __str__(self) -> str:
        """Return the mean and the range."""
        if not self.steps:
            return "no steps"
        return f"{self.mean:.0f} ({min(self.steps)} to {max(self.steps)})"


def count_instructions(
    program: Program, records: bytes, flags: Sequence[str] = FLAGS
) -> InstructionCounts:
    """Count the instructions of each step on input records of a harness.

    QEMU tells what a step executes, not what it waits for. Raises ToolMissing, BuildError.
    """
    with build_executable(program, flags, machine=CORTEX_M4F, main=MAIN) as steps:
        output = run_in_qemu(steps, records, ICOUNT_OPTIONS)
    return InstructionCounts(struct.unpack(f"<{len(output) // 8}q", output))
