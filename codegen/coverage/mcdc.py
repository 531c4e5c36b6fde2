"""MC/DC coverage of generated C, measured by clang, with proofs for infeasible conditions.

A condition of a decision is covered if two evaluations are known that differ in that condition, as
far as conditions were evaluated, and in the outcome (masking MC/DC, FAA CAST-6, 2001; clang's
-fcoverage-mcdc). A decision with one condition is covered if it was both true and false.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from codegen.coverage.coverage_exploration import write_explorer
from codegen.emit.c_module import STATIC_PATTERN
from codegen.harness.harness import write_harness
from codegen.passes.pass_list import run_c_passes
from codegen.proofs.infeasible.float_terms import Range
from codegen.proofs.infeasible.infeasible_conditions import (
    DecisionSite,
    decision_sites,
    prove_infeasible,
    unshare_expressions,
)
from codegen.toolchain.compiler import FLAGS, run_executable
from codegen.toolchain.external_tools import output_of
from codegen.toolchain.target_machine import HOST
from language.ir.program import Program
from language.text.temporary_files import temporary_folder

COMPILER, PROFILE_MERGER, COVERAGE_EXPORTER = "clang-19", "llvm-profdata-19", "llvm-cov-19"
COVERAGE_FLAGS = ("-fprofile-instr-generate", "-fcoverage-mapping", "-fcoverage-mcdc")
APP, EXPLORER, RAW_PROFILE, MERGED_PROFILE = (
    "app",
    "explorer",
    "counts_%1m.profraw",
    "counts.profdata",
)
FUNCTION = re.compile(rf"(?:{STATIC_PATTERN})?void (\w+)\(")
"""The first line of a function in generated C."""
CASE = re.compile(r"case\b|default\b")
"""The source text of a `case` label, which clang counts as a branch."""


@dataclass(frozen=True)
class Decision:
    """A decision of the C: its block, line and text, with one entry for each of its conditions.

    `shown` tells whether the condition is covered. `never` is the outcome that the condition is
    proven never to have; None without a proof.
    """

    block: str
    line: int
    text: str
    shown: tuple[bool, ...]
    never: tuple[bool | None, ...]

    @property
    def open(self) -> int:
        """The number of conditions that are neither covered nor proven infeasible."""
        pairs = zip(self.shown, self.never, strict=True)
        return sum(not shown and outcome is None for shown, outcome in pairs)


T = TypeVar("T", Decision, DecisionSite)


@dataclass(frozen=True)
class McdcCoverage:
    """The MC/DC coverage of a C file after `sequences` input sequences of `steps` steps in
    total.
    """

    file: str
    sequences: int
    steps: int
    decisions: tuple[Decision, ...]

    @property
    def conditions(self) -> int:
        """The number of conditions of all decisions."""
        return sum(len(decision.shown) for decision in self.decisions)

    @property
    def shown(self) -> int:
        """The number of covered conditions."""
        return sum(sum(decision.shown) for decision in self.decisions)

    @property
    def open(self) -> int:
        """The number of conditions that are neither covered nor proven infeasible."""
        return sum(decision.open for decision in self.decisions)

    @property
    def uncovered(self) -> tuple[Decision, ...]:
        """The decisions with a condition that is not covered, also if it is proven infeasible."""
        return tuple(decision for decision in self.decisions if not all(decision.shown))


def add_infeasibility_proofs(
    coverage: McdcCoverage, program: Program, ranges: Mapping[str, Range]
) -> McdcCoverage:
    """Return the coverage with proofs that conditions of a sampled Program are infeasible.

    Only conditions that are not covered are tried. The outcome that a condition never has is stored
    in `Decision.never`. A decision is matched to sites of the Program by block and text; the
    outcome counts only if it is proven at all of its sites. `ranges` gives by variable name the
    ranges in which variables stay between two steps.
    """
    c_program = unshare_expressions(run_c_passes(program))
    sites = _group_by_block(decision_sites(c_program))
    decisions = _group_by_block(coverage.decisions)
    missed = [block for block, of in decisions.items() if any(not all(d.shown) for d in of)]
    matched = [p for block in missed for p in _match_sites(decisions[block], sites.get(block, []))]
    proven = prove_infeasible(
        c_program, ranges, list(dict.fromkeys(_uncovered_conditions(matched)))
    )
    outcomes = {id(decision): _proven_outcomes(at, proven, decision) for decision, at in matched}
    replaced = (replace(d, never=outcomes.get(id(d)) or d.never) for d in coverage.decisions)
    return replace(coverage, decisions=tuple(replaced))


def _uncovered_conditions(matched: Iterable[tuple[Decision, list[DecisionSite]]]) -> Iterator[int]:
    """Yield the numbers of the uncovered conditions at all possible sites of the decisions."""
    for decision, places in matched:
        for place in places:
            if len(place.conditions) == len(decision.shown):
                pairs = zip(place.conditions, decision.shown, strict=True)
                yield from (number for number, shown in pairs if not shown)


def _group_by_block(items: Iterable[T]) -> dict[str, list[T]]:
    """Return the items by the block in which they are, in their order."""
    groups: dict[str, list[T]] = {}
    for thing in items:
        groups.setdefault(thing.block, []).append(thing)
    return groups


def _match_sites(
    decisions: Sequence[Decision], sites: Sequence[DecisionSite]
) -> Iterator[tuple[Decision, list[DecisionSite]]]:
    """Yield each decision of a block with the sites in the Program that may correspond to it.

    If both lists have the same texts in the same order, each decision has one site. Otherwise a
    decision has all sites with its text, or none if there are fewer of them than such decisions.
    """
    if [d.text for d in decisions] == [place.text for place in sites]:
        yield from ((d, [place]) for d, place in zip(decisions, sites, strict=True))
        return
    counts = Counter(d.text for d in decisions)
    for decision in decisions:
        found = [place for place in sites if place.text == decision.text]
        yield decision, found if len(found) >= counts[decision.text] else []


def _proven_outcomes(
    sites: Sequence[DecisionSite], proven: Mapping[int, bool], decision: Decision
) -> tuple[bool | None, ...]:
    """Return for each condition the outcome that it never has.

    Returns None without a proof or if it is covered. An outcome counts only if it is proven at all
    sites of the decision.
    """
    found: list[bool | None] = []
    for position, shown in enumerate(decision.shown):
        of = [place.conditions for place in sites if len(place.conditions) == len(decision.shown)]
        outcomes = {proven.get(conditions[position]) for conditions in of}
        found.append(outcomes.pop() if len(outcomes) == 1 and not shown else None)
    return tuple(found)


def measure_mcdc(
    program: Program,
    sequences: Sequence[Sequence[bytes]],
    corpus: Sequence[bytes] = (),
    ranges: Mapping[str, Range] | None = None,
) -> McdcCoverage:
    """Run the instrumented C of a Program and return its MC/DC coverage.

    `sequences` holds input records of a `TickLog`; each sequence is a run from the start. `corpus`
    holds entries of `generate_corpus` for the same `ranges` of inputs. The decisions are those of
    the module's C file in the order of the file, without labels of `switch`; `never` is None
    throughout. Raises MissingToolError, BuildError.
    """
    file = f"{program.name}.c"
    with temporary_folder() as folder:
        # Each run adds its counters to the profile.
        environment = {"LLVM_PROFILE_FILE": str(folder / RAW_PROFILE)}
        app = _build(write_harness(program, folder), folder, HOST.link(folder))
        for sequence in sequences:
            run_executable(app, b"".join(sequence), environment)
        steps = sum(map(len, sequences))
        if corpus:
            steps += _run_corpus(corpus, program, ranges or {}, folder, environment)
        profiles = sorted(path.name for path in folder.glob("counts_*.profraw"))
        output_of([PROFILE_MERGER, "merge", "-sparse", *profiles, "-o", MERGED_PROFILE], folder)
        command = [
            COVERAGE_EXPORTER,
            "export",
            APP,
            f"-instr-profile={MERGED_PROFILE}",
            str(folder / file),
        ]
        found = json.loads(output_of(command, folder))
        text = (folder / file).read_text().split("\n")
    (coverage,) = found["data"][0]["files"]
    decisions = tuple(_parse_decisions(program.name, coverage, text))
    return McdcCoverage(file, len(sequences) + len(corpus), steps, decisions)


def _build(sources: Sequence[Path], folder: Path, link: Sequence[str], app: str = APP) -> Path:
    """Compile C files with coverage counters; return the executable."""
    flags = [*(flag for flag in FLAGS if flag != "-O2"), "-O1", *COVERAGE_FLAGS]
    output_of([COMPILER, *flags, *map(str, sources), "-o", app, *link], folder)
    return folder / app


def _run_corpus(
    corpus: Sequence[bytes],
    program: Program,
    ranges: Mapping[str, Range],
    folder: Path,
    environment: Mapping[str, str],
) -> int:
    """Execute corpus entries with the coverage counters; return the number of steps."""
    sources = write_explorer(program, ranges, folder)
    app = _build(sources, folder, ("-DALONE", "-lm"), EXPLORER)
    names = []
    for number, entry in enumerate(corpus):
        names.append(str(folder / f"{number}.way"))
        Path(names[-1]).write_bytes(entry)
    (done,) = output_of([str(app), *names], folder, environment).split()
    return int(done)


def _parse_decisions(
    name: str, coverage: dict[str, Any], text: Sequence[str]
) -> Iterator[Decision]:
    """Yield the decisions of clang's coverage report in the order of the file.

    The records of MC/DC are decisions with several conditions; branches outside of these are
    decisions with one. Labels of a `switch` are left out.
    """
    found = []
    spans = []
    for record in coverage["mcdc_records"]:
        begin, end = tuple(record[:2]), tuple(record[2:4])
        spans.append((begin, end))
        found.append((begin, end, tuple(record[-1])))
    for branch in coverage["branches"]:
        begin, end, (true, false) = tuple(branch[:2]), tuple(branch[2:4]), branch[4:6]
        is_inside = any(first <= begin and end <= last for first, last in spans)
        if not is_inside and not CASE.match(_source_text(text, begin, end)):
            found.append((begin, end, (bool(true and false),)))
    for begin, end, shown in sorted(found):
        block = _enclosing_block(name, text[: begin[0]])
        yield Decision(block, begin[0], _source_text(text, begin, end), shown, (None,) * len(shown))


def _enclosing_block(name: str, lines: Sequence[str]) -> str:
    """Return the name of the block whose function begins last in the given lines."""
    begun = next(found[1] for line in reversed(lines) if (found := FUNCTION.match(line)))
    return begun.removeprefix(f"{name}_").lower() if begun.startswith(f"{name}_") else begun


def _source_text(lines: Sequence[str], begin: Sequence[int], end: Sequence[int]) -> str:
    """Return the source text between two positions on one line; lines and columns count from 1."""
    inside = list(lines[begin[0] - 1 : end[0]])
    inside[-1] = inside[-1][: end[1] - 1]
    inside[0] = inside[0][begin[1] - 1 :]
    return " ".join(" ".join(inside).split())
