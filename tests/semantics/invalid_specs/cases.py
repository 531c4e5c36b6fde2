"""Book of problems: the cases of this folder, what the user is told, and the repairs of the help.

A case is `<case>.yaml` (checked), `<case>.csv` (replayed by `estimator` with map
`reference_trace`) or `<case>.command` (a command line); `<case>.txt` is what the user is told.
`<case>.repaired.<same ending>` is its nearest valid neighbour.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import modewright as mw
from language.text.diagnostic import Problem, SpecError
from modewright.api import studies

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
ENDINGS = (".yaml", ".csv", ".command")
REPAIRS = (re.compile(r"^did you mean `(.+?)`\?"), re.compile(r"^write `(\S+?)`:"))
"""Helps that give the very text to write at the place of the problem."""


@dataclass(frozen=True)
class Case:
    """A refused file and the neighbour that passes."""

    path: Path

    @property
    def name(self) -> str:
        """The name of the case."""
        return self.path.stem

    @property
    def expected(self) -> Path:
        """What the user is told."""
        return self.path.with_suffix(".txt")

    @property
    def repaired(self) -> Path:
        """The nearest valid neighbour."""
        return self.path.with_suffix(f".repaired{self.path.suffix}")


def cases() -> list[Case]:
    """Return all cases in the order of their names."""
    found = (path for path in sorted(HERE.iterdir()) if path.suffix in ENDINGS)
    return [Case(path) for path in found if ".repaired" not in path.suffixes]


def unrelated_warnings(case: Case) -> set[str]:
    """Return the warnings that a case is not about: its neighbour may have them too."""
    return {"unused", "unwritten"} - {problem.kind for problem in problems_of(case.path)}


@cache
def problems_of(path: Path) -> tuple[Problem, ...]:
    """Return what the user is told of a file, errors and warnings; paths relative to the root."""
    named = path.relative_to(ROOT) if path.is_relative_to(ROOT) else path
    if path.suffix == ".yaml":
        return tuple(mw.check(str(named), root=ROOT))
    try:
        if path.suffix == ".csv":
            mw.replay("estimator", named, "reference_trace", root=ROOT, compiled=False)
        else:
            run_command(shlex.split(path.read_text("utf-8"), comments=True))
    except SpecError as error:
        return tuple(error.problems)
    return ()


def run_command(words: Sequence[str]) -> None:
    """Run a command by its function of the API. Raises SpecError."""
    command, *rest = words
    values = dict(word.split("=", 1) for word in rest if "=" in word)
    names = [word for word in rest if "=" not in word]
    match command:
        case "simulate":
            mw.load(names[0], names[1], values, root=ROOT)
        case "generate":
            mw.generate(names[0], values, root=ROOT)
        case "summary":
            studies.study_summary(names[0])
        case "replay":
            trace = ROOT / "tests" / "data" / "paper" / "est_paper_step_100Hz.csv.gz"
            name, map, variant = names[0], names[1], (names[2] if len(names) > 2 else None)
            mw.replay(name, trace, map, variant, values, ROOT, compiled=False)
        case _:
            raise ValueError(f"a case does not run `{command}`")


def error_labels(problems: Sequence[Problem]) -> list[str]:
    """Return kind, place and label of the errors, for messages of tests."""
    return [f"{p.kind} {p.span}: {p.label}" for p in problems if p.severity == "error"]


def find_repairs(problems: Sequence[Problem]) -> Iterator[tuple[Problem, str]]:
    """Yield the problems whose help gives the text to write, and that text."""
    for problem in problems:
        for pattern in REPAIRS:
            match = pattern.search(problem.help)
            if match:
                yield problem, match.group(1)


def apply_repairs(text: str, found: Sequence[tuple[Problem, str]]) -> str:
    """Return a text with the repairs made, those at the end of a line first."""
    lines = text.split("\n")
    for problem, wanted in sorted(found, key=lambda item: -item[0].span.column):
        line, start = lines[problem.span.line - 1], problem.span.column - 1
        lines[problem.span.line - 1] = line[:start] + wanted + line[start + problem.span.width :]
    return "\n".join(lines)
