"""Proof: one check of generated C by a tool of others, and what it found."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from codegen.toolchain.external_tools import run_tool


@dataclass(frozen=True)
class ToolVerdict:
    """What a `tool` says of the C of a Program: `findings`, none where the proof holds.

    `about` tells what was looked at, and how much of it. One that is not asked says nothing.
    """

    check: str
    tool: str
    about: str
    findings: tuple[str, ...] = ()
    is_asked: bool = True

    @property
    def holds(self) -> bool:
        """Tell whether nothing was found."""
        return not self.findings


def tool_version(tool: str, folder: Path) -> str:
    """Return the first number that a tool calls its version."""
    words = run_tool(
        [tool, "--version" if tool != "frama-c" else "-version"], folder
    ).stdout.split()
    return next((word.strip("()") for word in words if word[0].isdigit()), "")
