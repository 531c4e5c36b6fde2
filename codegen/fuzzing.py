"""Fuzzing: sequences of inputs by which libFuzzer looks for every way through generated C.

A sequence is bytes, one for each input of each tick: the place of its value in a table (`words`).
The C runs under sanitizers and writes down each sequence with a sum of all that it carried.
"""

from __future__ import annotations

import math
import re
import struct
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from codegen.harness import Main, fed, write_harness
from codegen.names import c_type
from codegen.sanitizers import built, ran
from language.number import LARGEST
from language.program import Program, Variable, short

FUZZER = "clang-19"
WORDS, ABSOLUTE, SPREAD = 256, 96, 64
"""Words of an input; those that are values, and how many of these are spread over its range. The
others are changes: half of them small and smaller steps, as many none."""
WITHOUT_RANGE = (-1000.0, 1000.0)
MAIN = Main("fuzz_main.c.jinja")
LONGEST = 64
"""Most ticks of a sequence that the C reads."""
STUCK = 60
"""Seconds of one sequence after which libFuzzer takes it for one without end."""
SEQUENCES = "sequences.bin"
COVERED = re.compile(r"cov: (\d+)")
HEAD = struct.Struct("<II")
Range = tuple[float, float]
Words = tuple[float, ...]


@dataclass(frozen=True)
class Sequences:
    """What libFuzzer tried: each sequence with the CRC-32 of its records, `edges` of the C that it
    came along, and what sanitizers said.
    """

    tried: tuple[tuple[bytes, int], ...]
    edges: int
    findings: tuple[str, ...]


def fuzzed(
    program: Program, ranges: Mapping[str, Range], runs: int, ticks: int, seed: int
) -> Sequences:
    """Run libFuzzer on the C of a Program; `ranges` are those of inputs by name.

    Raises ToolMissing, BuildError.
    """
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        folder = Path(name)
        table = words(program, ranges)
        sources = write_harness(program, folder, main=MAIN)
        (folder / "words.h").write_text(_words_header(table))
        app = built(FUZZER, sources, folder, "fuzzer,")
        (folder / "corpus").mkdir()
        return _run(app, runs, ticks * len(table), seed)


def words(program: Program, ranges: Mapping[str, Range]) -> list[Words]:
    """Return what the bytes 0 to 255 mean for each input that a tick is fed."""
    return [_words(v, program, ranges.get(short(v.name))) for v in fed(program)]


def values_of(program: Program, table: list[Words], sequence: bytes) -> Iterator[Words]:
    """Yield the inputs of each tick of a sequence, as the C reads them."""
    yield from fed_by(program, table, sequence[: LONGEST * len(table)])


def fed_by(program: Program, table: list[Words], chosen: bytes) -> Iterator[Words]:
    """Yield the inputs that bytes choose, one for each, in turn: values, or changes of the last."""
    real = [variable.type == "real" for variable in fed(program)]
    last = [own[SPREAD // 2] for own in table]
    for at in range(0, len(chosen) - len(table) + 1, len(table)):
        for k, byte in enumerate(chosen[at : at + len(table)]):
            is_change = real[k] and byte >= ABSOLUTE
            last[k] = last[k] + table[k][byte] if is_change else table[k][byte]
        yield tuple(last)


def _words(variable: Variable, program: Program, given: Range | None) -> Words:
    """Return the words of an input: values first, then changes of a real."""
    if variable.type == "truth":
        return (0.0, 1.0) * (WORDS // 2)
    if variable.type == "whole":
        is_byte = c_type(variable, program.number) == "uint8_t"
        count = len(variable.values) or 8
        odd = (count, count + 1, 255) if is_byte else (-1, count, -(2**31), 2**31 - 1)
        usual = [k % count for k in range(WORDS - len(odd))]
        return tuple(float(k) for k in (*usual, *odd))
    low, high = given or WITHOUT_RANGE
    span, most = high - low, LARGEST[program.number]
    spread = [low + span * k / (SPREAD - 1) for k in range(SPREAD)]
    edges = [math.nextafter(end, to) for end in (low, high) for to in (-math.inf, math.inf)]
    special = [*edges, low - span, high + span, 0.0, -0.0, 1.0, -1.0, 5e-324, -1e-40, 1e30]
    special += [most, -most, math.nan, math.inf, -math.inf]
    special += [0.0] * (ABSOLUTE - SPREAD - len(special))
    steps = [sign * span * 2.0 ** (-k / 2) for k in range(40) for sign in (1.0, -1.0)]
    return (*spread, *special, *steps, *[0.0] * (WORDS - ABSOLUTE - len(steps)))


def _run(app: Path, runs: int, most: int, seed: int) -> Sequences:
    options = [f"-runs={runs}", f"-max_len={most}", f"-seed={seed}", f"-timeout={STUCK}"]
    done = ran(app, [*options, "-len_control=0", "corpus"])
    edges = max((int(found) for line in done.lines for found in COVERED.findall(line)), default=0)
    kept = app.parent / SEQUENCES
    data = kept.read_bytes() if kept.exists() else b""  # none where the first one did not end
    return Sequences(tuple(_tried(data)), edges, done.found)


def _tried(data: bytes) -> Iterator[tuple[bytes, int]]:
    at = 0
    while at < len(data):
        size, checksum = HEAD.unpack_from(data, at)
        at += HEAD.size
        yield data[at : at + size], checksum
        at += size


def _words_header(table: list[Words]) -> str:
    sizes = f"#define ABSOLUTE {ABSOLUTE}\n#define FIRST {SPREAD // 2}\n#define LONGEST {LONGEST}\n"
    return sizes + table_text(table)


def table_text(table: list[Words]) -> str:
    """Return the table as C: hexadecimal digits of each double."""
    rows = ",\n".join(f"    {{{', '.join(_literal(word) for word in own)}}}" for own in table)
    return f"static const double word[{len(table)}][{WORDS}] = {{\n{rows}\n}};\n"


def _literal(value: float) -> str:
    if math.isnan(value):
        return "NAN"
    return value.hex() if math.isfinite(value) else "-INFINITY" if value < 0.0 else "INFINITY"
