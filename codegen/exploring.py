"""Exploring: ways through generated C that libFuzzer finds, with any page and inputs that are held.

A way is bytes: three for each number of the page that is another one, then groups of ticks - how
many, and the word of each input (`words`). MC/DC counts what they show (`mcdc.py`).
"""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from codegen.build import FLAGS, BuildError
from codegen.fuzzing import ABSOLUTE, FUZZER, SPREAD, STUCK, Range, fed_by, table_text, words
from codegen.harness import Main, fed, write_harness
from codegen.names import SOLVED_ON_PAGE, CNames, c_type
from codegen.sanitizers import APP, ran
from codegen.source import stepped
from codegen.tool import output_of
from language.program import Constant, Program
from language.traversal import walk

MAIN = Main("explore_main.c.jinja")
CHANGES, GROUPS = 4, 96
"""Most numbers of a page that are others, and most groups of ticks."""
FACTORS = (0.0, -1.0, 0.5, 2.0, 1.1, 0.9, 10.0, -10.0, 100.0, 1e-3, 1e6, 1e30)
HOLDS = (*(1,) * 16, *(2,) * 6, 3, 3, 5, 5, 8, 12, 20, 50, 120, 600)
"""Ticks of a group: mostly one, and as many as a wait takes."""
LARGE, MOST = 1000, 1000
"""Operations of a Program that is large, and most ticks of a way through it: else its ways, of
thousands of ticks each, take most of the time and show nothing more.
"""
ANY = (-1e30, 1e30)
KNOWN, WORDS = "known", "words.h"


def explored(
    program: Program, ranges: Mapping[str, Range], runs: int, seeds: Sequence[int]
) -> tuple[bytes, ...]:
    """Return ways that together show all that libFuzzer found in so many runs from each seed.

    Later seeds go on from what earlier ones found; what they are given has one order, so that they
    find the same each time. `ranges` are those of inputs by name. Raises ToolMissing, BuildError.
    """
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        folder = Path(name)
        sources = write_explorer(program, ranges, folder)
        flags = [flag for flag in FLAGS if flag != "-O2"]
        command = [FUZZER, *flags, "-O1", "-fsanitize=fuzzer", *map(str, sources)]
        output_of([*command, "-o", APP, "-lm"], folder)
        limits = [f"-runs={runs}", f"-max_len={longest(program)}", "-len_control=0", "-reload=0"]
        rest = [f"-timeout={STUCK}", "-use_value_profile=1"]
        found: list[Path] = []
        for seed in seeds:
            corpus = folder / f"corpus_{seed}"
            corpus.mkdir()
            (folder / KNOWN).write_text(",".join(map(str, found)))
            known = [f"-seed_inputs=@{KNOWN}"] if found else []
            done = ran(folder / APP, [*limits, f"-seed={seed}", *rest, *known, corpus.name])
            if done.found:
                raise BuildError(done.found[0])
            found = sorted([*found, *corpus.iterdir()], key=lambda path: path.name)
        return tuple(path.read_bytes() for path in found)


def records(
    program: Program, ranges: Mapping[str, Range], ways: Sequence[bytes]
) -> Iterator[list[bytes]]:
    """Yield the records of ways that are gone with the page of the spec, as a `Tape` has them."""
    most = most_ticks(program)
    table, size = words(program, ranges), 1 + len(fed(program))
    record, first = struct.Struct(f"<{size}d"), 3 * CHANGES if page_of(program) else 0
    for way in ways:
        groups = [way[at : at + size] for at in range(first, len(way) - size + 1, size)]
        inputs = fed_by(program, table, b"".join(group[1:] for group in groups))
        held = [HOLDS[group[0] % len(HOLDS)] for group in groups]
        pairs = zip(held, inputs, strict=True)
        gone = (one for ticks, values in pairs for one in [record.pack(*values, 0.0)] * ticks)
        yield list(islice(gone, most))


def longest(program: Program) -> int:
    """Return the size of the longest way [bytes]."""
    return 3 * CHANGES + GROUPS * (1 + len(fed(program)))


def most_ticks(program: Program) -> int:
    """Return the most ticks of a way."""
    count = sum(1 for block in program.blocks.values() for _ in walk(block))
    return MOST if count > LARGE else GROUPS * max(HOLDS)


def write_explorer(program: Program, ranges: Mapping[str, Range], folder: Path) -> list[Path]:
    """Write the C of a program and what goes its ways; return the sources to compile."""
    sources = write_harness(program, folder, main=MAIN, more={"page": page_of(program)})
    numbers = {
        "ABSOLUTE": ABSOLUTE,
        "FIRST": SPREAD // 2,
        "CHANGES": f"{CHANGES}U",
        "FACTORS": f"{len(FACTORS)}U",
        "HOLDS": f"{len(HOLDS)}U",
        "LONGEST": longest(program),
        "MOST": f"{most_ticks(program)}U",
    }
    lines = [f"#define {name} {number}" for name, number in numbers.items()]
    lines.append(_array("double", "factor", FACTORS))
    lines.append(_array("uint16_t", "hold", HOLDS))
    (folder / WORDS).write_text("\n".join([*lines, table_text(words(program, ranges))]))
    return sources


def page_of(program: Program) -> list[dict[str, Any]]:
    """Return the single numbers of a page: their members, types and ranges."""
    program = stepped(program)
    place = CNames(program, solved=SOLVED_ON_PAGE)
    found = []
    for one in program.constants:
        if one.kind in ("tunable", "solved") and not one.items and one.type != "truth":
            low, high = _range(one)
            member, kind = place(one.name).removeprefix("cal->"), c_type(one, program.number)
            found.append({"member": member, "type": kind, "low": low, "high": high})
    return found


def _range(one: Constant) -> Range:
    """Return the range of a number of a page: one without may be any, a word one of its list."""
    if one.range:
        return float(one.range[0]), float(one.range[1])
    return (0.0, float(len(one.values) - 1)) if one.values else ANY


def _array(kind: str, name: str, numbers: Sequence[float]) -> str:
    return f"static const {kind} {name}[] = {{{', '.join(map(repr, numbers))}}};"
