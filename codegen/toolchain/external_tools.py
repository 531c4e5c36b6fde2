"""External tools: programs that compile, run and check generated C, and how to install them."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from codegen.toolchain.compiler import (
    AS_TEXT,
    BuildError,
    convert_process_errors,
    scratch_environment,
)
from language.text.diagnostic import MissingToolError

ARM_COMPILER = "arm-none-eabi-gcc"
ARM_SIZE = "arm-none-eabi-size"
ARM_OBJECTS = "arm-none-eabi-objdump"
ARM_LINES = "arm-none-eabi-addr2line"
EMULATOR = "qemu-system-arm"
TOOL_TIMEOUT = 900
"""Time limit of a tool [s]."""
DEBIAN_PACKAGES: Mapping[str, str] = {
    "gcc": "gcc libc6-dev",
    "clang-19": "clang-19 libclang-rt-19-dev",
    ARM_COMPILER: "gcc-arm-none-eabi libnewlib-arm-none-eabi",
    **dict.fromkeys((ARM_SIZE, ARM_OBJECTS, ARM_LINES), "binutils-arm-none-eabi"),
    EMULATOR: "qemu-system-arm",
    "llvm-profdata-19": "llvm-19",
    "llvm-cov-19": "llvm-19",
    "cppcheck": "cppcheck",
    "frama-c": "frama-c-base",
    "why3": "why3",
    "z3": "z3",
}
"""The Debian packages of the tools."""


def require_tool(tool: str) -> str:
    """Return the name of a tool if it is on the path.

    Raises MissingToolError otherwise, with its package from DEBIAN_PACKAGES or its own name.
    """
    if shutil.which(tool) is None:
        package = DEBIAN_PACKAGES.get(tool, tool)
        raise MissingToolError(f"`{tool}` is missing: apt-get install {package}")
    return tool


def run_tool(
    command: Sequence[str], folder: Path, extra_environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a tool in a folder and return the completed process, whatever its exit code.

    Its output is captured as text. `extra_environment` is added to the environment. Raises
    MissingToolError; BrokenToolError if it does not start, and after TOOL_TIMEOUT seconds.
    """
    tool, *words = command
    with scratch_environment() as environment, convert_process_errors(tool):
        return subprocess.run(
            [require_tool(tool), *words],
            cwd=folder,
            env={**environment, "PWD": str(folder), **(extra_environment or {})},
            capture_output=True,
            timeout=TOOL_TIMEOUT,
            check=False,
            **AS_TEXT,
        )


def output_of(
    command: Sequence[str], folder: Path, extra_environment: Mapping[str, str] | None = None
) -> str:
    """Return the standard output of a tool that is run in a folder.

    `extra_environment` is added to the environment. Raises the errors of `run_tool`; BuildError
    with its error output for a nonzero exit code.
    """
    done = run_tool(command, folder, extra_environment)
    if done.returncode:
        raise BuildError(done.stderr.strip() or f"{command[0]} ended with {done.returncode}")
    return done.stdout
