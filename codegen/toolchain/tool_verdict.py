"""Tool verdict: the result of one check of generated C by an external tool."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from codegen.toolchain.external_tools import run_tool


@dataclass(frozen=True)
class ToolVerdict:
    """The result of a check of generated C by a `tool`.

    `findings` are the problems; the check holds if there are none. `about` tells what was checked,
    and how much of it. `is_asked` is false for a check that does not apply.
    """

    check: str
    tool: str
    about: str
    findings: tuple[str, ...] = ()
    is_asked: bool = True

    @property
    def holds(self) -> bool:
        """Tell whether there are no findings."""
        return not self.findings


def tool_version(tool: str, folder: Path) -> str:
    """Return the first word of a tool's version text that begins with a digit, else an empty text.

    Parentheses around it are removed. The option is --version, -version for frama-c. Raises
    MissingToolError, BuildError.
    """
    words = run_tool(
        [tool, "--version" if tool != "frama-c" else "-version"], folder
    ).stdout.split()
    return next((word.strip("()") for word in words if word[0].isdigit()), "")
