"""Target machine: the targets for which generated C is compiled, and how programs are run on
them."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from codegen.toolchain.compiler import (
    TIMEOUT,
    BuildError,
    convert_process_errors,
    find_compiler,
    run_executable,
)
from codegen.toolchain.external_tools import ARM_COMPILER, EMULATOR, require_tool
from language.text.temporary_files import temporary_folder

CORTEX_FLAGS = ("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard")
"""Compiler flags of a Cortex-M4F."""
CORTEX_LINK_FLAGS = (
    "-nostartfiles",
    "-Wl,--gc-sections",
    "--specs=nano.specs",
    "--specs=nosys.specs",
)
"""Linker flags of a Cortex-M4F."""
BOARD, LINKER_SCRIPT = "mps2-an386", "mps2_an386.ld"
"""The emulated board and its linker script."""
HARNESS_EXIT_CODES = {
    3: "a file of records cannot be opened",
    4: "records cannot be written",
    6: "FPSCR is not 0",
}
"""Meaning of the exit codes of the harness on a target."""


@dataclass(frozen=True)
class Machine:
    """A target machine.

    `files` are the files of the harness that it needs. `command` returns the compiler command for a
    compiler name or None. `link` returns linker flags, given the folder of the harness files. `run`
    runs an executable on input records and returns its output.
    """

    name: str
    files: tuple[str, ...]
    command: Callable[[str | None], list[str]]
    link: Callable[[Path], tuple[str, ...]]
    run: Callable[[Path, bytes], bytes]


def harness_file(name: str) -> Path:
    """Return the path of a file of the harness, in codegen/targets; it need not exist."""
    return Path(str(resources.files("codegen"))) / "targets" / name


def run_in_qemu(target: Path, records: bytes, options: Sequence[str] = ()) -> bytes:
    """Run a program for a Cortex-M4F in QEMU on input records and return its output.

    Both are files in a temporary folder, `records.in` and `records.out`, that the program opens.
    `options` are passed to QEMU. Raises MissingToolError; BuildError for a nonzero exit code (with
    its meaning in HARNESS_EXIT_CODES) and after TIMEOUT seconds.
    """
    emulator = require_tool(EMULATOR)
    semihosting = ("-semihosting-config", "enable=on,target=native")
    headless = ("-nographic", "-monitor", "none", "-serial", "none")
    with temporary_folder() as folder:
        (folder / "records.in").write_bytes(records)
        command = [emulator, "-M", BOARD, *headless, *semihosting, *options, "-kernel", str(target)]
        with convert_process_errors("the emulated program", BuildError):
            done = subprocess.run(
                command, cwd=folder, capture_output=True, timeout=TIMEOUT, stdin=subprocess.DEVNULL
            )
        if done.returncode != 0:
            reason = (
                HARNESS_EXIT_CODES.get(done.returncode)
                or done.stderr.decode(errors="replace").strip()
            )
            raise BuildError(f"the emulated program ended with {done.returncode}: {reason}")
        return (folder / "records.out").read_bytes()


HOST = Machine("host", ("stdio.c",), find_compiler, lambda folder: ("-lm",), run_executable)
"""This machine."""
CORTEX_M4F = Machine(
    "cortex-m4f",
    ("semihosting.c", "cortex_m4f.c", LINKER_SCRIPT),
    lambda name: [name or require_tool(ARM_COMPILER), *CORTEX_FLAGS],
    lambda folder: (*CORTEX_LINK_FLAGS, "-T", str(folder / LINKER_SCRIPT), "-lm", "-lc", "-lgcc"),
    run_in_qemu,
)
"""An emulated Cortex-M4F."""
MACHINES = {machine.name: machine for machine in (HOST, CORTEX_M4F)}
"""All machines by name."""
