"""Duel: generated C against a twin of the same spec that was written by hand (NOTES.md)."""

from __future__ import annotations

import shutil
import struct
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from codegen.harness.harness import LOCKSTEP_MAIN, tick_inputs, write_harness
from codegen.harness.instruction_count import COUNTING_MAIN, ICOUNT_OPTIONS
from codegen.toolchain.compiler import FLAGS, WARNINGS, run_compiler
from codegen.toolchain.target_machine import CORTEX_M4F, HOST, Machine, run_in_qemu
from lockstep.tick_log import TickLog

HERE = Path(__file__).parent
RUN: dict[str, Callable[[Path, bytes], bytes]] = {
    HOST.name: HOST.run,
    CORTEX_M4F.name: partial(run_in_qemu, options=ICOUNT_OPTIONS),
}
CLOCK = {HOST.name: "clock_host.c", CORTEX_M4F.name: "clock_target.c"}
MAINS = {HOST.name: LOCKSTEP_MAIN, CORTEX_M4F.name: COUNTING_MAIN}
"""Around both is a main of our own: of these the files are used."""


@dataclass(frozen=True)
class Duel:
    """How many values `differing`, and what a step takes, of each round (generated, twin):
    nanoseconds, or on a target instructions.
    """

    steps: int
    differing: int
    rounds: tuple[tuple[float, float], ...]

    @property
    def best(self) -> tuple[float, float]:
        """What the generated code and the twin take at best."""
        generated, twin = zip(*self.rounds, strict=True)
        return min(generated), min(twin)

    @property
    def ratio(self) -> float:
        """What the generated code takes over what the twin does."""
        generated, twin = self.best
        return generated / twin


def duel(
    tape: TickLog, twin: str, rounds: int, machine: Machine = HOST, flags: Sequence[str] = FLAGS
) -> Duel:
    """Run the generated C of a tape's Program and a twin on its inputs, turn by turn."""
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        folder = Path(name)
        own = [HERE / f"{twin}_twin.c", HERE / f"{twin}_sides.c", HERE / "duel.c"]
        own.append(HERE / CLOCK[machine.name])
        written = write_harness(tape.program, folder, machine, MAINS[machine.name])
        sources = [path for path in written if path.name != "main.c"]
        for path in (*own, HERE / "duel.h", HERE / f"{twin}_twin.h"):
            shutil.copyfile(path, folder / path.name)
        sources += [folder / path.name for path in own]
        words = [*machine.command(None), *flags, *WARNINGS, *map(str, sources)]
        run_compiler([*words, *machine.link(folder / "harness")], folder / "duel")
        records = struct.pack("<2d", len(tape.inputs), rounds)
        size = 8 * len(tick_inputs(tape.program))
        records += b"".join(record[:size] for record in tape.inputs)
        found = RUN[machine.name](folder / "duel", records)
    steps, differing, *took = struct.unpack(f"<{len(found) // 8}q", found)
    pairs = zip(took[::2], took[1::2], strict=True)
    return Duel(steps, differing, tuple((a / steps, b / steps) for a, b in pairs))
