"""Coverage exploration: inputs and calibration pages for generated C that libFuzzer finds.

A corpus entry is a byte string. It begins with three bytes for each changed number of the
calibration page. Groups of ticks follow: one byte for the number of ticks, and one byte for each
input, which is an index into a table of values (`word_table`). `mcdc.py` measures the coverage that
a corpus reaches.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from codegen.coverage.libfuzzer import (
    ABSOLUTE_WORDS,
    FUZZER_COMPILER,
    FUZZER_TIMEOUT,
    SPREAD_WORDS,
    Range,
    decode_inputs,
    format_word_table,
    word_table,
)
from codegen.emit.c_names import SOLVED_PREFIX_ON_PAGE, CNames, c_type
from codegen.harness.harness import HarnessMain, tick_inputs, write_harness
from codegen.harness.sanitizers import APP, run_sanitised
from codegen.passes.step_restriction import restrict_to_step
from codegen.toolchain.compiler import FLAGS, BuildError
from codegen.toolchain.external_tools import output_of
from language.ir.program import Constant, Program
from language.ir.traversal import walk_ops
from language.text.temporary_files import temporary_folder

MAIN = HarnessMain("coverage/explore_main.c.jinja")
MAX_PAGE_CHANGES, MAX_TICK_GROUPS = 4, 96
"""Maximum number of changed numbers of the page, and of groups of ticks."""
FACTORS = (0.0, -1.0, 0.5, 2.0, 1.1, 0.9, 10.0, -10.0, 100.0, 1e-3, 1e6, 1e30)
"""Factors by which a number of the page is changed."""
HOLD_TICKS = (*(1,) * 16, *(2,) * 6, 3, 3, 5, 5, 8, 12, 20, 50, 120, 600)
"""Numbers of ticks of a group: mostly one, up to the length of a typical wait."""
LARGE_PROGRAM, MAX_LARGE_TICKS = 1000, 1000
"""Number of operations from which on a Program is large, and the maximum number of ticks of an
entry then. Longer entries of a large Program take most of the time and raise the coverage no
further."""
UNBOUNDED_RANGE = (-1e30, 1e30)
"""The range of a number of the page that declares none."""
SEED_FILE, WORDS_HEADER = "known", "words.h"


def generate_corpus(
    program: Program, ranges: Mapping[str, Range], runs: int, seeds: Sequence[int]
) -> tuple[bytes, ...]:
    """Return corpus entries that together reach the coverage that libFuzzer found.

    libFuzzer makes `runs` executions with each seed, in turn. A later seed starts from the entries
    of the earlier ones. The result is sorted by file name, so it is reproducible. `ranges` gives
    ranges of inputs by name; others have DEFAULT_INPUT_RANGE. Raises MissingToolError; BuildError
    if compilation fails or a sanitizer reports a finding.
    """
    with temporary_folder() as folder:
        sources = write_explorer(program, ranges, folder)
        flags = [flag for flag in FLAGS if flag != "-O2"]
        command = [FUZZER_COMPILER, *flags, "-O1", "-fsanitize=fuzzer", *map(str, sources)]
        output_of([*command, "-o", APP, "-lm"], folder)
        limits = [
            f"-runs={runs}",
            f"-max_len={max_entry_bytes(program)}",
            "-len_control=0",
            "-reload=0",
        ]
        rest = [f"-timeout={FUZZER_TIMEOUT}", "-use_value_profile=1"]
        corpus: list[Path] = []
        for seed in seeds:
            corpus_folder = folder / f"corpus_{seed}"
            corpus_folder.mkdir()
            (folder / SEED_FILE).write_text(",".join(map(str, corpus)))
            known = [f"-seed_inputs=@{SEED_FILE}"] if corpus else []
            done = run_sanitised(
                folder / APP, [*limits, f"-seed={seed}", *rest, *known, corpus_folder.name]
            )
            if done.findings:
                raise BuildError(done.findings[0])
            corpus = sorted([*corpus, *corpus_folder.iterdir()], key=lambda path: path.name)
        return tuple(path.read_bytes() for path in corpus)


def corpus_records(
    program: Program, ranges: Mapping[str, Range], corpus: Sequence[bytes]
) -> Iterator[list[bytes]]:
    """Yield for each corpus entry the list of its input records, one per tick, as in a `TickLog`.

    The records use the calibration page of the spec: the changes of the page at the begin of an
    entry are skipped. The records of an entry end after `max_entry_ticks`; bytes of an incomplete
    group of ticks are ignored.
    """
    most = max_entry_ticks(program)
    table, size = word_table(program, ranges), 1 + len(tick_inputs(program))
    record, first = struct.Struct(f"<{size}d"), 3 * MAX_PAGE_CHANGES if page_scalars(program) else 0
    for entry in corpus:
        groups = [entry[at : at + size] for at in range(first, len(entry) - size + 1, size)]
        inputs = decode_inputs(program, table, b"".join(group[1:] for group in groups))
        hold_ticks = [HOLD_TICKS[group[0] % len(HOLD_TICKS)] for group in groups]
        pairs = zip(hold_ticks, inputs, strict=True)
        entry_records = (
            one for ticks, values in pairs for one in [record.pack(*values, 0.0)] * ticks
        )
        yield list(islice(entry_records, most))


def max_entry_bytes(program: Program) -> int:
    """Return the maximum length of a corpus entry [bytes].

    It is 3 * MAX_PAGE_CHANGES, plus 1 + the number of inputs for each of MAX_TICK_GROUPS groups.
    """
    return 3 * MAX_PAGE_CHANGES + MAX_TICK_GROUPS * (1 + len(tick_inputs(program)))


def max_entry_ticks(program: Program) -> int:
    """Return the maximum number of ticks of a corpus entry.

    It is MAX_LARGE_TICKS for a Program with more than LARGE_PROGRAM operations, nested ones
    included; else MAX_TICK_GROUPS times the longest of HOLD_TICKS.
    """
    count = sum(1 for block in program.blocks.values() for _ in walk_ops(block))
    return MAX_LARGE_TICKS if count > LARGE_PROGRAM else MAX_TICK_GROUPS * max(HOLD_TICKS)


def write_explorer(program: Program, ranges: Mapping[str, Range], folder: Path) -> list[Path]:
    """Write the C of a Program, the main that executes corpus entries, and its header WORDS_HEADER.

    Returns the C files to compile. Raises ValueError for a Program without a block `step`.
    """
    sources = write_harness(
        program, folder, main=MAIN, extra_context={"page": page_scalars(program)}
    )
    numbers = {
        "ABSOLUTE": ABSOLUTE_WORDS,
        "FIRST": SPREAD_WORDS // 2,
        "CHANGES": f"{MAX_PAGE_CHANGES}U",
        "FACTORS": f"{len(FACTORS)}U",
        "HOLDS": f"{len(HOLD_TICKS)}U",
        "LONGEST": max_entry_bytes(program),
        "MOST": f"{max_entry_ticks(program)}U",
    }
    lines = [f"#define {name} {number}" for name, number in numbers.items()]
    lines.append(_format_array("double", "factor", FACTORS))
    lines.append(_format_array("uint16_t", "hold", HOLD_TICKS))
    (folder / WORDS_HEADER).write_text(
        "\n".join([*lines, format_word_table(word_table(program, ranges))])
    )
    return sources


def page_scalars(program: Program) -> list[dict[str, Any]]:
    """Return template contexts of the page's scalar numbers: `member`, C `type`, `low`, `high`.

    They are the tunable and solved constants in Program order; tables and truth values are left
    out. `low` and `high` are the declared range; without one, an enumeration has 0 to its last
    index and any other number UNBOUNDED_RANGE.
    """
    program = restrict_to_step(program)
    c_names = CNames(program, solved_prefix=SOLVED_PREFIX_ON_PAGE)
    scalars = []
    for one in program.constants:
        if one.kind in ("tunable", "solved") and not one.items and one.type != "truth":
            low, high = _constant_range(one)
            member, kind = c_names(one.name).removeprefix("cal->"), c_type(one, program.number_type)
            scalars.append({"member": member, "type": kind, "low": low, "high": high})
    return scalars


def _constant_range(constant: Constant) -> Range:
    """Return the range of a number of the page.

    A number without a range has UNBOUNDED_RANGE; an enumeration has the indices of its values.
    """
    if constant.range:
        return float(constant.range[0]), float(constant.range[1])
    return (0.0, float(len(constant.values) - 1)) if constant.values else UNBOUNDED_RANGE


def _format_array(kind: str, name: str, numbers: Sequence[float]) -> str:
    """Return the C definition of a constant array."""
    return f"static const {kind} {name}[] = {{{', '.join(map(repr, numbers))}}};"
