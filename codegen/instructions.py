"""Instructions: how many a step of generated C takes on an emulated Cortex-M4F."""

from __future__ import annotations

import shutil
import struct
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from codegen.build import FLAGS, WARNINGS, linked
from codegen.harness import harness_context, write_harness
from codegen.machine import CORTEX_M4F, emulated, harness_file
from codegen.rendering import render
from language.program import Program

FILES = ("instructions.h", "instructions.c")
COUNTING = ("-icount", "shift=0")
"""Of the emulator: one instruction takes 1 ns."""


@dataclass(frozen=True)
class Instructions:
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


def instructions(program: Program, records: bytes, flags: Sequence[str] = FLAGS) -> Instructions:
    """Count the instructions of each step on input records of a harness.

    QEMU tells what a step executes, not what it waits for. Raises ToolMissing, BuildError.
    """
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        folder = Path(name)
        sources = write_harness(program, folder, CORTEX_M4F)
        for file in FILES:
            shutil.copyfile(harness_file(file), folder / "harness" / file)
        text = render("instructions_main.c.jinja", harness_context(program))
        (folder / "main.c").write_text(text)
        sources.append(folder / "harness" / "instructions.c")
        words = [*CORTEX_M4F.command(None), *flags, *WARNINGS, *map(str, sources)]
        linked([*words, *CORTEX_M4F.link(folder / "harness")], folder / "steps")
        found = emulated(folder / "steps", records, COUNTING)
    return Instructions(struct.unpack(f"<{len(found) // 8}q", found))
