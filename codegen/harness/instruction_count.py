"""Instruction count: the number of instructions of each step on an emulated Cortex-M4F."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from codegen.harness.harness import HarnessMain, build_executable
from codegen.toolchain.compiler import FLAGS
from codegen.toolchain.target_machine import CORTEX_M4F, run_in_qemu
from language.ir.program import Program

COUNTING_MAIN = HarnessMain(
    "harness/instructions_main.c.jinja", ("instructions.h", "instructions.c")
)
"""The main that counts instructions."""
ICOUNT_OPTIONS = ("-icount", "shift=0")
"""Options of QEMU under which one instruction takes 1 ns."""


@dataclass(frozen=True)
class InstructionCounts:
    """The number of instructions of each step, including its call."""

    steps: tuple[int, ...]

    @cached_property
    def mean(self) -> float:
        """The mean over all steps; 0 if there are none."""
        return sum(self.steps) / max(len(self.steps), 1)

    def __str__(self) -> str:
        """Return the mean and the range as text."""
        if not self.steps:
            return "no steps"
        return f"{self.mean:.0f} ({min(self.steps)} to {max(self.steps)})"


def count_instructions(
    program: Program, records: bytes, flags: Sequence[str] = FLAGS
) -> InstructionCounts:
    """Count the instructions of each step on input records of a harness.

    QEMU counts executed instructions of a Cortex-M4F, without wait states; the call of the step
    counts too. Raises MissingToolError, BuildError.
    """
    with build_executable(program, flags, machine=CORTEX_M4F, main=COUNTING_MAIN) as steps:
        output = run_in_qemu(steps, records, ICOUNT_OPTIONS)
    return InstructionCounts(struct.unpack(f"<{len(output) // 8}q", output))
