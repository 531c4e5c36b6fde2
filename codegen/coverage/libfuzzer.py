"""libFuzzer: input sequences that reach as many branches of generated C as possible.

A sequence is a byte string with one byte for each input of each tick. The byte is an index into a
table of values of that input (`word_table`). The C runs under sanitizers and writes each sequence
to a file, with a CRC-32 of all its retained values.
"""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from codegen.emit.c_names import c_type
from codegen.harness.harness import HarnessMain, tick_inputs, write_harness
from codegen.harness.sanitizers import build_sanitised, run_sanitised
from language.ir.number_type import MAX_FINITE
from language.ir.program import Program, Variable, unqualified_name
from language.text.temporary_files import temporary_folder

FUZZER_COMPILER = "clang-19"
WORDS_PER_INPUT, ABSOLUTE_WORDS, SPREAD_WORDS = 256, 96, 64
"""Number of words of an input, how many of them are values, and how many of the values are spread
over the range of the input. The other words are differences from the last value: 80 of decreasing
size, and the rest 0."""
DEFAULT_INPUT_RANGE = (-1000.0, 1000.0)
"""The range of a real input that declares none."""
MAIN = HarnessMain("coverage/fuzz_main.c.jinja")
MAX_SEQUENCE_TICKS = 64
"""Maximum number of ticks of a sequence that the C executes."""
FUZZER_TIMEOUT = 60
"""Time limit [s] of one sequence; libFuzzer reports a sequence that takes longer as a hang."""
SEQUENCES_FILE = "sequences.bin"
"""The file to which the C writes the sequences."""
COVERAGE_LINE = re.compile(r"cov: (\d+)")
"""The number of covered edges in the output of libFuzzer."""
SEQUENCE_HEADER = struct.Struct("<II")
"""The header of a sequence in its file: length [bytes] and CRC-32."""
Range = tuple[float, float]
WordValues = tuple[float, ...]


@dataclass(frozen=True)
class FuzzerRun:
    """The result of a run of libFuzzer.

    `sequences` pairs each executed sequence with the CRC-32 of its records. `edges` is the number
    of edges of the C that were covered. `findings` are the errors that the sanitizers reported.
    """

    sequences: tuple[tuple[bytes, int], ...]
    edges: int
    findings: tuple[str, ...]


def run_fuzzer(
    program: Program, ranges: Mapping[str, Range], runs: int, ticks: int, seed: int
) -> FuzzerRun:
    """Run libFuzzer on the C of a Program for `runs` executions of at most `ticks` ticks.

    `ranges` gives ranges of inputs by name; others have DEFAULT_INPUT_RANGE. All files are in a
    temporary folder. Errors that a sanitizer finds are in `findings` of the result. Raises
    MissingToolError, BuildError.
    """
    with temporary_folder() as folder:
        table = word_table(program, ranges)
        sources = write_harness(program, folder, main=MAIN)
        (folder / "words.h").write_text(_format_header(table))
        app = build_sanitised(FUZZER_COMPILER, sources, folder, "fuzzer,")
        (folder / "corpus").mkdir()
        return _run_libfuzzer(app, runs, ticks * len(table), seed)


def word_table(program: Program, ranges: Mapping[str, Range]) -> list[WordValues]:
    """Return WORDS_PER_INPUT floats for each input of a tick, in the order of `tick_inputs`.

    Entry k is what the byte k means. For a real input, the first SPREAD_WORDS are spread over its
    range (DEFAULT_INPUT_RANGE if `ranges` has none under its unqualified name), those up to
    ABSOLUTE_WORDS are range ends and special values such as NaN, the rest are differences. For a
    truth value and a whole number, all are values, a few of them invalid for the latter.
    """
    return [
        _input_words(v, program, ranges.get(unqualified_name(v.name))) for v in tick_inputs(program)
    ]


def decode_sequence(
    program: Program, table: list[WordValues], sequence: bytes
) -> Iterator[WordValues]:
    """Yield the input values of each tick of a sequence, for at most MAX_SEQUENCE_TICKS ticks.

    `sequence` has one byte for each input and tick; see `decode_inputs`.
    """
    yield from decode_inputs(program, table, sequence[: MAX_SEQUENCE_TICKS * len(table)])


def decode_inputs(program: Program, table: list[WordValues], data: bytes) -> Iterator[WordValues]:
    """Yield a tuple of input values for each tick, given one byte for each input and tick.

    A byte is an index into the table. For a real input, a byte from ABSOLUTE_WORDS on selects a
    difference, which is added to the last value of that input; before the first tick that is entry
    SPREAD_WORDS // 2 of its table. Bytes of an incomplete tick are ignored.
    """
    real = [variable.type == "real" for variable in tick_inputs(program)]
    last = [own[SPREAD_WORDS // 2] for own in table]
    for at in range(0, len(data) - len(table) + 1, len(table)):
        for k, byte in enumerate(data[at : at + len(table)]):
            is_change = real[k] and byte >= ABSOLUTE_WORDS
            last[k] = last[k] + table[k][byte] if is_change else table[k][byte]
        yield tuple(last)


def _input_words(variable: Variable, program: Program, value_range: Range | None) -> WordValues:
    """Return the WORDS_PER_INPUT words of an input.

    A truth value has 0 and 1 in turn. A whole number has its values in turn, then a few invalid
    ones. A real number has values over its range, values at and beyond the ends, special values
    (signed zeros, subnormals, infinities, NaN), then differences.
    """
    if variable.type == "truth":
        return (0.0, 1.0) * (WORDS_PER_INPUT // 2)
    if variable.type == "whole":
        is_byte = c_type(variable, program.number_type) == "uint8_t"
        count = len(variable.values) or 8
        odd = (count, count + 1, 255) if is_byte else (-1, count, -(2**31), 2**31 - 1)
        usual = [k % count for k in range(WORDS_PER_INPUT - len(odd))]
        return tuple(float(k) for k in (*usual, *odd))
    low, high = value_range or DEFAULT_INPUT_RANGE
    span, most = high - low, MAX_FINITE[program.number_type]
    spread = [low + span * k / (SPREAD_WORDS - 1) for k in range(SPREAD_WORDS)]
    edges = [math.nextafter(end, to) for end in (low, high) for to in (-math.inf, math.inf)]
    special = [*edges, low - span, high + span, 0.0, -0.0, 1.0, -1.0, 5e-324, -1e-40, 1e30]
    special += [most, -most, math.nan, math.inf, -math.inf]
    special += [0.0] * (ABSOLUTE_WORDS - SPREAD_WORDS - len(special))
    steps = [sign * span * 2.0 ** (-k / 2) for k in range(40) for sign in (1.0, -1.0)]
    return (*spread, *special, *steps, *[0.0] * (WORDS_PER_INPUT - ABSOLUTE_WORDS - len(steps)))


def _run_libfuzzer(app: Path, runs: int, most: int, seed: int) -> FuzzerRun:
    """Run a compiled fuzzer and return its sequences, covered edges and findings."""
    options = [f"-runs={runs}", f"-max_len={most}", f"-seed={seed}", f"-timeout={FUZZER_TIMEOUT}"]
    done = run_sanitised(app, [*options, "-len_control=0", "corpus"])
    edges = max(
        (int(found) for line in done.lines for found in COVERAGE_LINE.findall(line)), default=0
    )
    file = app.parent / SEQUENCES_FILE
    data = file.read_bytes() if file.exists() else b""  # absent if the first sequence fails
    return FuzzerRun(tuple(_read_sequences(data)), edges, done.findings)


def _read_sequences(data: bytes) -> Iterator[tuple[bytes, int]]:
    """Yield the sequences in the contents of a sequence file, each with its CRC-32."""
    at = 0
    while at < len(data):
        size, checksum = SEQUENCE_HEADER.unpack_from(data, at)
        at += SEQUENCE_HEADER.size
        yield data[at : at + size], checksum
        at += size


def _format_header(table: list[WordValues]) -> str:
    """Return the header `words.h`: the sizes and the word table."""
    sizes = {
        "ABSOLUTE": ABSOLUTE_WORDS,
        "FIRST": SPREAD_WORDS // 2,
        "LONGEST": MAX_SEQUENCE_TICKS,
    }
    defines = "".join(f"#define {name} {size}\n" for name, size in sizes.items())
    return defines + format_word_table(table)


def format_word_table(table: list[WordValues]) -> str:
    """Return the C definition of the array `word`, with one row of words for each input.

    It has the type `static const double [inputs][WORDS_PER_INPUT]`. Finite numbers are hexadecimal
    literals; the others are NAN, INFINITY and -INFINITY.
    """
    rows = ",\n".join(f"    {{{', '.join(_format_double(word) for word in own)}}}" for own in table)
    return f"static const double word[{len(table)}][{WORDS_PER_INPUT}] = {{\n{rows}\n}};\n"


def _format_double(value: float) -> str:
    """Return a C literal of a double, with the macros NAN and INFINITY for special values."""
    if math.isnan(value):
        return "NAN"
    return value.hex() if math.isfinite(value) else "-INFINITY" if value < 0.0 else "INFINITY"
