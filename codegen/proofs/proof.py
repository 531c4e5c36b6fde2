"""Proof: one check of generated C by a tool of others, and what it found."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.build import BuildError
from codegen.tool import needed

SECONDS = 900
"""Longest run of a tool before it is given up."""


@dataclass(frozen=True)
class Proof:
    """What a `tool` says of the C of a Program: `findings`, none where the proof holds.

    `about` tells what was looked at, and how much of it.
    """

    check: str
    tool: str
    about: str
    findings: tuple[str, ...] = ()

    @property
    def holds(self) -> bool:
        """Tell whether nothing was found."""
        return not self.findings


def told(command: Sequence[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a tool in a folder. Raises ToolMissing, BuildError."""
    tool, *words = command
    try:
        return subprocess.run(
            [needed(tool), *words],
            cwd=folder,
            env=os.environ | {"PWD": str(folder)},
            capture_output=True,
            text=True,
            timeout=SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise BuildError(f"{tool} was not done after {SECONDS} s") from None


def version_of(tool: str, folder: Path) -> str:
    """Return the first number that a tool calls its version."""
    words = told([tool, "--version" if tool != "frama-c" else "-version"], folder).stdout.split()
    return next((word.strip("()") for word in words if word[0].isdigit()), "")
