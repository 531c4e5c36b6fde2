"""MC/DC: which conditions of generated C were shown to matter, as clang counts them.

A condition of a decision is shown where two runs of it are known that differ in that condition, as
far as it was evaluated, and in the outcome (masking MC/DC, FAA CAST-6 2001; clang's
-fcoverage-mcdc). A decision of one condition is shown where it was true once and false once.
"""

from __future__ import annotations

import dataclasses
import json
import re
import struct
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from codegen.build import FLAGS, run_executable
from codegen.harness import fed, tunable, write_harness
from codegen.machine import HOST
from codegen.proofs.infeasible import never, places_of
from codegen.proofs.terms import Range
from codegen.source import STATIC, c_program
from codegen.tool import output_of
from language.program import Program

COMPILER, MERGER, EXPORTER = "clang-19", "llvm-profdata-19", "llvm-cov-19"
COVERED = ("-fprofile-instr-generate", "-fcoverage-mapping", "-fcoverage-mcdc")
APP, POOL, MERGED = "app", "counts_%1m.profraw", "counts.profdata"
FUNCTION = re.compile(rf"(?:{STATIC})?void (\w+)\(")
Key = tuple[str, str]
"""The block and the text of a decision."""
CASE = re.compile(r"case\b|default\b")


@dataclass(frozen=True)
class Decision:
    """A decision of the C: the block and line in which it is, its text, of each condition whether
    it was `shown`, and the one outcome that it can `never` have, where that is proven.
    """

    block: str
    line: int
    text: str
    shown: tuple[bool, ...]
    never: tuple[bool | None, ...]

    @property
    def open(self) -> int:
        """How many conditions are neither shown nor proven to be infeasible."""
        pairs = zip(self.shown, self.never, strict=True)
        return sum(not shown and outcome is None for shown, outcome in pairs)


@dataclass(frozen=True)
class Covered:
    """What `sequences` of inputs have shown of the C of a Program, over so many `steps`."""

    file: str
    sequences: int
    steps: int
    decisions: tuple[Decision, ...]

    @property
    def conditions(self) -> int:
        """How many conditions there are."""
        return sum(len(decision.shown) for decision in self.decisions)

    @property
    def shown(self) -> int:
        """How many of them were shown to matter."""
        return sum(sum(decision.shown) for decision in self.decisions)

    @property
    def open(self) -> int:
        """How many of them are neither shown nor proven to be infeasible."""
        return sum(decision.open for decision in self.decisions)

    @property
    def missed(self) -> tuple[Decision, ...]:
        """The decisions of which a condition was not shown."""
        return tuple(decision for decision in self.decisions if not all(decision.shown))


def with_proofs(found: Covered, program: Program, ranges: Mapping[str, Range]) -> Covered:
    """Return what was covered with a proof of what no input can show of a sampled Program.

    `ranges` are those of its variables between two steps, as far as they stay in them.
    """
    made = c_program(program)
    places: dict[Key, list[tuple[int, ...]]] = {}
    for place in places_of(made):
        places.setdefault((place.block, place.text), []).append(place.conditions)
    missed = {(decision.block, decision.text) for decision in found.missed}
    wanted = [n for key, all_of in places.items() if key in missed for of in all_of for n in of]
    proven = never(made, ranges, wanted)
    counts = Counter((decision.block, decision.text) for decision in found.decisions)
    decisions = []
    for decision in found.decisions:
        key = decision.block, decision.text
        all_of = places.get(key, [])
        claimed = _claimed(all_of, proven, decision) if len(all_of) >= counts[key] else ()
        decisions.append(dataclasses.replace(decision, never=claimed or decision.never))
    return dataclasses.replace(found, decisions=tuple(decisions))


def _claimed(
    places: Sequence[tuple[int, ...]], proven: Mapping[int, bool], decision: Decision
) -> tuple[bool | None, ...]:
    """Return what is proven of each condition at all places of a block where it may stand: several
    have the same text.
    """
    found: list[bool | None] = []
    for position, shown in enumerate(decision.shown):
        outcomes = {proven.get(of[position]) for of in places if len(of) == len(decision.shown)}
        found.append(outcomes.pop() if len(outcomes) == 1 and not shown else None)
    return tuple(found)


def turned(program: Program, sequence: Sequence[bytes]) -> list[bytes]:
    """Return a sequence with another page from its second record on: each tunable parameter at the
    end of its range that it is not at.
    """
    page = []
    for constant in tunable(program):
        low, high = constant.range or (constant.value, constant.value)
        page.append(float(high if constant.value == low else low))
    head = struct.Struct(f"<{len(fed(program)) + 1}d")
    values = head.unpack_from(sequence[1])
    return [sequence[0], head.pack(*values[:-1], 1.0) + struct.pack(f"<{len(page)}d", *page)]


def mcdc(program: Program, sequences: Sequence[Sequence[bytes]]) -> Covered:
    """Run the C of a Program on sequences of input records and tell what they show of it.

    Records are those of a `Tape`. Raises ToolMissing, BuildError.
    """
    file = f"{program.name}.c"
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        folder = Path(name)
        sources = [str(path) for path in write_harness(program, folder)]
        flags = [*(flag for flag in FLAGS if flag != "-O2"), "-O1", *COVERED]
        output_of([COMPILER, *flags, *sources, "-o", APP, *HOST.link(folder)], folder)
        counting = {"LLVM_PROFILE_FILE": str(folder / POOL)}  # a run adds to what is there
        for sequence in sequences:
            run_executable(folder / APP, b"".join(sequence), counting)
        pools = sorted(path.name for path in folder.glob("counts_*.profraw"))
        output_of([MERGER, "merge", "-sparse", *pools, "-o", MERGED], folder)
        command = [EXPORTER, "export", APP, f"-instr-profile={MERGED}", str(folder / file)]
        found = json.loads(output_of(command, folder))
        text = (folder / file).read_text().split("\n")
    (counted,) = found["data"][0]["files"]
    steps = sum(map(len, sequences))
    return Covered(file, len(sequences), steps, tuple(_decisions(program.name, counted, text)))


def _decisions(name: str, counted: dict[str, Any], text: Sequence[str]) -> Iterator[Decision]:
    """Yield decisions in the order of the file: several conditions, then one alone."""
    found = []
    spans = []
    for record in counted["mcdc_records"]:
        begin, end = tuple(record[:2]), tuple(record[2:4])
        spans.append((begin, end))
        found.append((begin, end, tuple(record[-1])))
    for branch in counted["branches"]:
        begin, end, (true, false) = tuple(branch[:2]), tuple(branch[2:4]), branch[4:6]
        is_inside = any(first <= begin and end <= last for first, last in spans)
        if not is_inside and not CASE.match(_text(text, begin, end)):
            found.append((begin, end, (bool(true and false),)))
    for begin, end, shown in sorted(found):
        block = _block(name, text[: begin[0]])
        yield Decision(block, begin[0], _text(text, begin, end), shown, (None,) * len(shown))


def _block(name: str, lines: Sequence[str]) -> str:
    """Return the block whose function begins last in some lines."""
    begun = next(found[1] for line in reversed(lines) if (found := FUNCTION.match(line)))
    return begun.removeprefix(f"{name}_").lower() if begun.startswith(f"{name}_") else begun


def _text(lines: Sequence[str], begin: Sequence[int], end: Sequence[int]) -> str:
    """Return the text from one place to another, lines and columns counted from 1."""
    inside = list(lines[begin[0] - 1 : end[0]])
    inside[-1] = inside[-1][: end[1] - 1]
    inside[0] = inside[0][begin[1] - 1 :]
    return " ".join(" ".join(inside).split())
