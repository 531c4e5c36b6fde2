"""Tool: programs of others that generated C is compiled, run and checked with; how to get them."""

from __future__ import annotations

import shutil
from collections.abc import Mapping

from language.missing import ToolMissing

ARM_COMPILER = "arm-none-eabi-gcc"
EMULATOR = "qemu-system-arm"
PACKAGES: Mapping[str, str] = {
    "gcc": "gcc libc6-dev",
    "clang-19": "clang-19",
    ARM_COMPILER: "gcc-arm-none-eabi libnewlib-arm-none-eabi",
    EMULATOR: "qemu-system-arm",
    "cppcheck": "cppcheck",
    "frama-c": "frama-c-base",
}
"""Their Debian packages."""


def needed(tool: str) -> str:
    """Return the name of a tool that is installed. Raises ToolMissing."""
    if shutil.which(tool) is None:
        package = PACKAGES.get(tool, tool)
        raise ToolMissing(f"`{tool}` is missing: apt-get install {package}")
    return tool
