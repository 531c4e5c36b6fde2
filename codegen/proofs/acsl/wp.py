"""WP: runs Frama-C's WP with z3 on the contracts of functions and counts the proven goals."""

from __future__ import annotations

import re
import shlex
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.toolchain.compiler import BuildError
from codegen.toolchain.external_tools import require_tool, run_tool

PROVER = "z3"
SECONDS = 20
"""Time limit of the prover for one goal [s]."""
KERNEL = (
    "-machdep",
    "gcc_x86_32",
    "-cpp-extra-args=-I. -Dvolatile=",
    "-warn-special-float",
    "none",
)
"""Options of Frama-C; that reals stay finite is proven by the value analysis (eva.py)."""
OPTIONS = ("-wp", "-wp-prover", PROVER, "-wp-timeout", str(SECONDS))
SEARCH = "auto_config=false smt.mbqi=false"
"""Options of z3: instantiate quantifiers by patterns (E-matching), never by models."""
CONFIG = ".why3.conf"
PROVED = re.compile(r"Proved goals: +(\d+) / (\d+)")
OPEN = re.compile(r"^\[wp\] \[[^]]*\] Goal (\S+)(?! : Valid)(?: : |$)", re.M)
REFUSED = re.compile(r"^\[kernel[^]]*\] (\S+:\d+: .*(?:\n  .*)*)", re.M)
"""A message of Frama-C on a line that it cannot parse."""
PURE = re.compile(r"^(?=(?:static inline )?(?:double|float|bool|int32_t) ha_\w+\()", re.M)
NOTHING = "/*@ assigns \\nothing; exits \\false; */\n"
"""The contract of functions of ha_math: they write nothing, and return."""


@dataclass(frozen=True)
class Asked:
    """The number of proven goals and of all goals; the names of open goals, or an error message."""

    proven: int
    asked: int
    open: tuple[str, ...]

    def __add__(self, other: Asked) -> Asked:
        """Return the sum of both."""
        open_ones = (*self.open, *other.open)
        return Asked(self.proven + other.proven, self.asked + other.asked, open_ones)


def detected(folder: Path) -> None:
    """Configure why3 in a folder with the installed provers.

    Raises MissingToolError; BuildError if why3 writes no configuration.

    z3 is called by a script with the options SEARCH. Goals contain axioms of the memory model, and
    a search for models of these (MBQI) would take all of the time limit.
    """
    found = shutil.which(require_tool(PROVER)) or PROVER
    done = run_tool(["why3", "config", "detect"], folder, {"HOME": str(folder)})
    script, config = folder / f"{PROVER}.sh", folder / CONFIG
    if not config.is_file():
        reason = (done.stderr.strip().splitlines() or [f"it ended with {done.returncode}"])[-1]
        raise BuildError(f"why3 writes no configuration: {reason}")
    script.write_text(f'#!/bin/sh\nexec {shlex.quote(found)} {SEARCH} "$@"\n')
    script.chmod(0o700)
    text = config.read_text()
    config.write_text(text.replace(f'path = "{found}"', f'path = "{script.resolve()}"'))


def pure(text: str) -> str:
    """Return C in which functions of ha_math have the contract NOTHING."""
    return PURE.sub(lambda found: NOTHING, text)


def asked(folder: Path, file: str, functions: Sequence[str], more: Sequence[str] = ()) -> Asked:
    """Prove the contracts of some functions of a file and return the goals.

    `more` are further options of WP. Raises MissingToolError, BuildError.
    """
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
