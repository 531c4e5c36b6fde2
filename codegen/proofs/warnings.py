"""Compiler warnings: compiles generated C with all warnings of gcc and clang (rule C24)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from codegen.toolchain.compiler import FLAGS, WARNINGS
from codegen.toolchain.external_tools import run_tool
from codegen.toolchain.tool_verdict import ToolVerdict, tool_version

WARNING_COMPILERS = ("gcc", "clang-19")
"""The compilers."""


def check_compiler_warnings(folder: Path, sources: Sequence[str]) -> list[ToolVerdict]:
    """Compile C files of a folder with each compiler and return one verdict for each.

    Findings are the lines with warnings and errors. Raises MissingToolError, BuildError.
    """
    verdicts = []
    for compiler in WARNING_COMPILERS:
        command = [compiler, *FLAGS, *WARNINGS, "-c", *sources]
        done = run_tool(command, folder)
        lines = done.stderr.splitlines()
        findings = tuple(line for line in lines if "warning:" in line or "error:" in line)
        if done.returncode and not findings:
            findings = (f"{compiler} ended with {done.returncode}",)
        about = f"{len(WARNINGS)} kinds of warnings"
        tool = f"{compiler} {tool_version(compiler, folder)}"
        verdicts.append(ToolVerdict("warnings", tool, about, findings))
    return verdicts
