"""MISRA: checks generated C against MISRA C:2012 with cppcheck, except for stated deviations."""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from codegen.toolchain.external_tools import run_tool
from codegen.toolchain.tool_verdict import ToolVerdict, tool_version
from language.text.diagnostic import MissingToolError

DEVIATIONS = {
    "8.9": "fixed numbers stand together at the head of the file, also where one function alone "
    "reads them",
    "21.15": "the bits of a power of two are set by memcpy, which every compiler turns into a move",
}
"""Rules from which generated C deviates, with reasons (rule C24; docs/c_code.md)."""
COMPILER_MACROS = ("-DFLT_EVAL_METHOD=0", "-DINT32_MIN=(-2147483647-1)")
"""Macros of compiler headers, which cppcheck does not read."""
CPPCHECK_OPTIONS = ("--quiet", "--std=c99", "--error-exitcode=1")
"""Options of cppcheck."""
ADDON_FOLDERS = ("usr/lib/*", "usr/share", "usr/local/share")
"""Folders in which the rules of cppcheck may be installed."""
VIOLATION = re.compile(r"\[(?P<file>[^:\]]+):(?P<line>\d+)\].*\[misra-c2012-(?P<rule>[\d.]+)\]")
"""A violation in the output: file, line and rule."""


def check_misra(folder: Path, sources: Sequence[str]) -> ToolVerdict:
    """Check C files of a folder against MISRA C:2012 and return the verdict.

    Deviations are counted in `about`. Raises MissingToolError, BuildError.
    """
    tool = f"cppcheck {tool_version('cppcheck', folder)}"
    read = run_tool(["cppcheck", "--dump", *CPPCHECK_OPTIONS, *COMPILER_MACROS, *sources], folder)
    rules = run_tool([sys.executable, _addon(), *(f"{source}.dump" for source in sources)], folder)
    unread = [one for one in sources if f"Checking {one}.dump, config" not in rules.stdout]
    if read.returncode or unread:
        last = (read.stderr + rules.stderr).strip().splitlines()[-1:]
        return ToolVerdict("misra", tool, "no result", (f"not read: {' '.join([*unread, *last])}",))
    lines = {match.group(0): match for match in VIOLATION.finditer(rules.stderr)}
    deviating = Counter(m["rule"] for m in lines.values() if m["rule"] in DEVIATIONS)
    findings = sorted(
        f"{Path(m['file']).name}:{m['line']}: rule {m['rule']}"
        for m in lines.values()
        if m["rule"] not in DEVIATIONS
    )
    listed = ", ".join(f"{rule} ({n} times)" for rule, n in sorted(deviating.items()))
    about = f"{len(sources)} files; deviations: {listed or 'none'}"
    return ToolVerdict("misra", tool, about, tuple(findings))


def _addon() -> str:
    """Return the path of the MISRA rules of cppcheck. Raises MissingToolError."""
    for pattern in ADDON_FOLDERS:
        for path in Path("/").glob(f"{pattern}/cppcheck/addons/misra.py"):
            return str(path)
    raise MissingToolError("the rules of cppcheck (misra.py) are missing: apt-get install cppcheck")
