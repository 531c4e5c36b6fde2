"""Strict: the C of a Program under all warnings that we ask a compiler for, from two compilers."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from codegen.toolchain.compiler import FLAGS, WARNINGS
from codegen.toolchain.external_tools import run_tool
from codegen.toolchain.tool_verdict import ToolVerdict, tool_version

COMPILERS = ("gcc", "clang-19")


def check_compiler_warnings(folder: Path, sources: Sequence[str]) -> list[ToolVerdict]:
    """Compile the sources of a folder. Raises ToolMissing."""
    found = []
    for compiler in COMPILERS:
        command = [compiler, *FLAGS, *WARNINGS, "-c", *sources]
        done = run_tool(command, folder)
        lines = done.stderr.splitlines()
        heard = tuple(line for line in lines if "warning:" in line or "error:" in line)
        if done.returncode and not heard:
            heard = (f"{compiler} ended with {done.returncode}",)
        about = f"{len(WARNINGS)} kinds of warnings"
        found.append(
            ToolVerdict("warnings", f"{compiler} {tool_version(compiler, folder)}", about, heard)
        )
    return found
