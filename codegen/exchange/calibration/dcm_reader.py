"""DCM reader: reads DCM 2.0 files line by line, as INCA, CANape and other tools write them.

Lines that begin with `*`, `!` or `.` are comments. Keywords without values (FUNKTION, DISPLAYNAME,
VAR and others) are skipped. So are shared axis points (STUETZSTELLENVERTEILUNG), because each map
repeats the points that it uses.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from codegen.exchange.calibration.characteristic import (
    MAX_PROBLEMS,
    Cell,
    FileCharacteristic,
    PageFile,
    stop_if_many,
)
from codegen.exchange.calibration.dcm_block import (
    SHARED_AXIS,
    SIZES,
    DcmBlock,
    characteristic_of,
    is_count,
)
from codegen.exchange.calibration.name_filter import NameFilter
from language.text.diagnostic import Problems, Source, Span, suggest_name

COMMENT_MARKS = ("*", "!", ".")
"""First characters of comment lines."""
INLINE_COMMENT_MARKS = ("*", "!")
"""First characters of a comment behind values; a point may begin a number."""
WORD_PATTERN = re.compile(r'"[^"]*"|"?[^\s"]+|"')
"""A word of a line: a text in quotes, or characters without a blank."""
SECTIONS = ("FUNKTIONEN", "VARIANTENKODIERUNG")
"""Sections that end with END and hold no values."""
HEADS = ("KONSERVIERUNG_FORMAT", "MODULKOPF", *SECTIONS, *SIZES)
"""Keywords that begin a block or section."""
VERSIONS = ("1.0", "2.0")
"""Versions of the format that are read."""
VALUE_WORDS = ("ST/X", "ST/Y", "WERT", "TEXT", "EINHEIT_X", "EINHEIT_Y", "EINHEIT_W")
"""Keywords of lines in a block that hold values or units."""
IGNORED_WORDS = ("LANGNAME", "DISPLAYNAME", "FUNKTION", "VAR")
"""Keywords of lines in a block that do not affect its values."""

Words = list[Cell]
Lines = Iterator[Words]


@dataclass(frozen=True)
class _ReadContext:
    """The source of a file, its problems, and the unknown keywords already reported."""

    source: Source
    problems: Problems
    reported_words: set[str] = field(default_factory=set)


def read_dcm(source: Source, problems: Problems, name_filter: NameFilter) -> PageFile:
    """Return the characteristics of a DCM file whose names the filter accepts.

    Shared axis points (STUETZSTELLENVERTEILUNG) and blocks of other names are skipped; an unknown
    keyword inside a block is a warning. Problems are reported to `problems`; SpecError is raised at
    the end if one is an error, after MAX_PROBLEMS errors, or at once if the format line is missing
    or a block has no END.
    """
    context = _ReadContext(_blank_other_blocks(source, name_filter), problems)
    lines = _word_lines(context)
    characteristics: list[FileCharacteristic] = []
    _require_format(next(lines, []), context)
    problems.raise_if_errors()
    for words in lines:
        head = words[0].text
        if head in SECTIONS:
            _skip_section(words[0], lines, problems)
        elif head in SIZES:
            block = _read_block(words, lines, context)
            one = characteristic_of(block, problems) if block else None
            if one and head != SHARED_AXIS:
                characteristics.append(one)
        elif head == "KONSERVIERUNG_FORMAT":
            problems.error("duplicate", words[0].span, "`KONSERVIERUNG_FORMAT` stands here twice")
        elif head != "MODULKOPF":
            label = f"`{head}` does not begin anything in a DCM file"
            problems.error("form", words[0].span, label, suggest_name(head, HEADS))
        stop_if_many(problems)
    problems.raise_if_errors()
    return PageFile(source, tuple(characteristics))


def _blank_other_blocks(source: Source, name_filter: NameFilter) -> Source:
    """Return a source in which the lines of blocks that the filter rejects are empty.

    A rejected block reaches up to its END, or to the next head if it has none.
    """
    lines, is_inside = [], False
    for number, line in enumerate(source.lines, start=1):
        head, name, *_ = (*WORD_PATTERN.findall(line), "", "")
        if head in HEADS:
            place = Span(source, number, line.find(name) + 1, len(name))
            is_inside = head in SIZES and bool(name) and not name_filter.accepts(Cell(name, place))
        lines.append("" if is_inside else line)
        is_inside = is_inside and head != "END"
    return dataclasses.replace(source, lines=tuple(lines))


def _require_format(words: Words, context: _ReadContext) -> None:
    """Report a problem unless the words are `KONSERVIERUNG_FORMAT` and a known version."""
    start = Span(context.source, 1, 1)
    if not words or words[0].text != "KONSERVIERUNG_FORMAT":
        place = words[0].span if words else start
        label = "this is no DCM file: it does not begin with `KONSERVIERUNG_FORMAT`"
        context.problems.error("form", place, label, "`KONSERVIERUNG_FORMAT 2.0`")
    elif len(words) != 2 or words[1].text not in VERSIONS:
        version = " ".join(word.text for word in words[1:])
        label = f"the format `{version}` of DCM is not known: 2.0 is"
        context.problems.error("version", words[0].span, label)


def _word_lines(context: _ReadContext) -> Lines:
    """Yield the words of each line that is neither empty nor a comment; report unclosed quotes."""
    for number, line in enumerate(context.source.lines, start=1):
        text = line.strip()
        if not text or text.startswith(COMMENT_MARKS):
            continue
        words = []
        for match in WORD_PATTERN.finditer(line):
            span = Span(context.source, number, match.start() + 1, len(match[0]))
            if match[0].startswith('"') and (len(match[0]) < 2 or not match[0].endswith('"')):
                context.problems.error("form", span, "a quote is opened and not closed")
            words.append(Cell(match[0], span))
        yield words


def _skip_section(head: Cell, lines: Lines, problems: Problems) -> None:
    """Consume lines up to END; report a problem if there is none."""
    if all(words[0].text != "END" for words in lines):
        problems.error("form", head.span, f"`{head.text}` has no `END`")


def _read_block(words: Words, lines: Lines, context: _ReadContext) -> DcmBlock | None:
    """Return the block up to its END; None if its head lacks a name or has wrong sizes.

    Raises SpecError if END is missing.
    """
    head, *rest = words
    problems = context.problems
    block = DcmBlock(head, rest[0] if rest else head, _read_sizes(head, rest[1:], problems))
    if not rest:
        problems.error("form", head.span, f"`{head.text}` is followed by a name")
    for line in lines:
        if line[0].text == "END":
            return block if rest and block.sizes is not None else None
        if line[0].text in SIZES:
            break
        _read_line(block, line, context)
        stop_if_many(problems)
    problems.error("form", head.span, f"`{head.text} {block.name.text}` has no `END`")
    problems.raise_if_errors()
    return None


def _read_sizes(head: Cell, words: Words, problems: Problems) -> tuple[int, ...] | None:
    """Return the sizes behind a name: `4`, `4 3`, or `4 @ 3` for a block of values.

    Returns None with a problem reported if they are not those of SIZES.
    """
    texts = [word.text for word in words]
    if head.text == "FESTWERTEBLOCK" and len(texts) == 3 and texts[1] == "@":
        texts = [texts[0], texts[2]]
    if len(texts) in SIZES[head.text] and all(map(is_count, texts)):
        return tuple(map(int, texts))
    place = words[0].span if words else head.span
    expected = " or ".join(map(str, SIZES[head.text]))
    label = f"behind its name `{head.text}` has {expected} whole numbers, how many values it has"
    if SIZES[head.text] == (0,):
        label = f"`{head.text}` has nothing behind its name"
    problems.error("form", place, label)
    return None


def _unquote(cell: Cell) -> Cell:
    """Return a cell without the quotes around its text."""
    return Cell(cell.text.strip('"'), cell.span)


def _read_line(block: DcmBlock, words: Words, context: _ReadContext) -> None:
    """Add a line to a block; report a keyword without values, and warn of an unknown keyword."""
    word, *rest = words
    target = _target_list(block, word.text)
    if target is not None or word.text.startswith("EINHEIT_"):
        rest = _without_comment(rest, context.problems)
    cells = [_unquote(cell) for cell in rest]
    if target is not None:
        if not cells:
            label = f"behind `{word.text}` there is no value"
            context.problems.error("missing", word.span, label)
        target.extend(cells)
    elif word.text.startswith("EINHEIT_") and len(cells) > 0:
        block.units[word.text.removeprefix("EINHEIT_")] = cells[0]
    elif word.text == "LANGNAME" and cells:
        block.about.append(cells[0].text)
    elif word.text not in IGNORED_WORDS and not word.text.startswith("EINHEIT_"):
        _warn_unknown_word(word, block, context)


def _without_comment(cells: Words, problems: Problems) -> Words:
    """Return the values of a line up to a comment behind them; warn of such a comment.

    The format has comments in lines of their own only, but files are annotated by hand.
    """
    for position, cell in enumerate(cells):
        if cell.text.startswith(INLINE_COMMENT_MARKS):
            label = "the rest of the line is passed over as a comment"
            problems.warning("form", cell.span, label, "a comment of DCM has a line of its own")
            return cells[:position]
    return cells


def _target_list(block: DcmBlock, word: str) -> list[Cell] | None:
    """Return the list of a block that receives the values of a keyword; None for other keywords."""
    match word:
        case "ST/X" | "ST_TX/X":
            return block.points_x
        case "ST/Y" | "ST_TX/Y":
            return block.points_y
        case "WERT":
            return block.numbers
        case "TEXT":
            return block.texts
        case _:
            return None


def _warn_unknown_word(word: Cell, block: DcmBlock, context: _ReadContext) -> None:
    """Warn of the first occurrence of an unknown keyword, for at most MAX_PROBLEMS of them."""
    if word.text in context.reported_words or len(context.reported_words) >= MAX_PROBLEMS:
        return
    context.reported_words.add(word.text)
    label = f"`{word.text}` is not known in `{block.head.text}`: it is passed over"
    context.problems.warning("unknown-key", word.span, label, suggest_name(word.text, VALUE_WORDS))
