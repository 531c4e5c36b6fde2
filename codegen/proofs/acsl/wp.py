"""WP: contracts of functions proven by Frama-C's WP and z3, and what it leaves open."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.toolchain.external_tools import require_tool, run_tool

PROVER = "z3"
SECONDS = 20
"""Of a prover for one goal."""
KERNEL = (
    "-machdep",
    "gcc_x86_32",
    "-cpp-extra-args=-I. -Dvolatile=",
    "-warn-special-float",
    "none",
)
"""Whether reals stay finite is asked by the value analysis (values.py)."""
OPTIONS = ("-wp", "-wp-prover", PROVER, "-wp-timeout", str(SECONDS))
SEARCH = "auto_config=false smt.mbqi=false"
"""How z3 looks for a proof: by instances of axioms that the goal names, never by models."""
CONFIG = ".why3.conf"
PROVED = re.compile(r"Proved goals: +(\d+) / (\d+)")
OPEN = re.compile(r"^\[wp\] \[[^]]*\] Goal (\S+)(?! : Valid)(?: : |$)", re.M)
REFUSED = re.compile(r"^\[kernel[^]]*\] (\S+:\d+: .*(?:\n  .*)*)", re.M)
"""What Frama-C says of a line that it cannot read."""
PURE = re.compile(r"^(?=(?:static inline )?(?:double|float|bool|int32_t) ha_\w+\()", re.M)
NOTHING = "/*@ assigns \\nothing; exits \\false; */\n"
"""Functions of ha_math write nothing, and return."""


@dataclass(frozen=True)
class Asked:
    """How many goals WP made and how many of them are proven; the `open` ones, or what it said."""

    proven: int
    asked: int
    open: tuple[str, ...]

    def __add__(self, other: Asked) -> Asked:
        """Return the goals of both."""
        open_ones = (*self.open, *other.open)
        return Asked(self.proven + other.proven, self.asked + other.asked, open_ones)


def detected(folder: Path) -> None:
    """Tell why3 which provers there are. Raises ToolMissing.

    It gets z3 by a script: beside what a function does a goal has axioms of memory, and to look
    for models of these (z3's MBQI) takes all the time that there is.
    """
    found = shutil.which(require_tool(PROVER)) or PROVER
    run_tool(["why3", "config", "detect"], folder, {"HOME": str(folder)})
    script, config = folder / f"{PROVER}.sh", folder / CONFIG
    script.write_text(f'#!/bin/sh\nexec {shlex.quote(found)} {SEARCH} "$@"\n')
    script.chmod(0o700)
    text = config.read_text()
    config.write_text(text.replace(f'path = "{found}"', f'path = "{script.resolve()}"'))


def pure(text: str) -> str:
    """Return C in which functions of ha_math write nothing."""
    return PURE.sub(lambda found: NOTHING, text)


def asked(folder: Path, file: str, functions: Sequence[str], more: Sequence[str] = ()) -> Asked:
    """Prove the contracts of some functions of a file. Raises ToolMissing, BuildError."""
    words = [*KERNEL, *OPTIONS, *more, "-wp-fct", ",".join(functions), file]
    done = run_tool(["frama-c", *words], folder, {"HOME": str(folder)})
    counts = PROVED.search(done.stdout)
    if done.returncode or counts is None:
        said = done.stdout + done.stderr
        why = REFUSED.findall(said)[:1] or said.strip().splitlines()[-1:]
        return Asked(0, 0, tuple(" ".join(one.split()) for one in why) or ("no result",))
    proven, goals = int(counts[1]), int(counts[2])
    found = OPEN.findall(done.stdout)
    if proven < goals and not found:
        found = [f"{goals - proven} goals were not proven"]
    return Asked(proven, goals, tuple(found))
