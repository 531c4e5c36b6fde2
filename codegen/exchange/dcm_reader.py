"""DCM reader: a DCM 2.0 file line by line, as INCA, CANape and others write it.

Lines that begin with `*`, `!` or `.` are comments. What says nothing about values (FUNKTION,
DISPLAYNAME, VAR ...) is passed over, and so are points that several maps share
(STUETZSTELLENVERTEILUNG): each map repeats those that it uses.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from codegen.exchange.characteristic import (
    MAX_PROBLEMS,
    Cell,
    Characteristic,
    PageFile,
    stop_if_many,
)
from codegen.exchange.dcm_block import SHARED, SIZES, Block, characteristic_of, is_count
from codegen.exchange.owned import Owned
from language.problem import Problems, Source, Span, nearest

COMMENTS = ("*", "!", ".")
WORD = re.compile(r'"[^"]*"|"?[^\s"]+|"')
SECTIONS = ("FUNKTIONEN", "VARIANTENKODIERUNG")
"""Sections that end with END and hold no values."""
HEADS = ("KONSERVIERUNG_FORMAT", "MODULKOPF", *SECTIONS, *SIZES)
VERSIONS = ("1.0", "2.0")
VALUE_WORDS = ("ST/X", "ST/Y", "WERT", "TEXT", "EINHEIT_X", "EINHEIT_Y", "EINHEIT_W")
PASSED_OVER = ("LANGNAME", "DISPLAYNAME", "FUNKTION", "VAR")
"""Words of a block that say nothing about its values."""

Words = list[Cell]
Lines = Iterator[Words]


@dataclass(frozen=True)
class _Reading:
    """`passed` are the unknown words that were told of: each once, and not more than a few."""

    source: Source
    problems: Problems
    passed: set[str] = field(default_factory=set)


def read_dcm(source: Source, problems: Problems, owned: Owned) -> PageFile:
    """Read what is `owned` of a DCM file; problems are reported, at last with SpecError."""
    reading = _Reading(_without_others(source, owned), problems)
    lines = _lines(reading)
    found: list[Characteristic] = []
    _require_format(next(lines, []), reading)
    problems.stop_if_any()
    for words in lines:
        head = words[0].text
        if head in SECTIONS:
            _pass_over(words[0], lines, problems)
        elif head in SIZES:
            block = _block(words, lines, reading)
            one = characteristic_of(block, problems) if block else None
            if one and head != SHARED:
                found.append(one)
        elif head == "KONSERVIERUNG_FORMAT":
            problems.error("duplicate", words[0].span, "`KONSERVIERUNG_FORMAT` stands here twice")
        elif head != "MODULKOPF":
            label = f"`{head}` does not begin anything in a DCM file"
            problems.error("form", words[0].span, label, nearest(head, HEADS))
        stop_if_many(problems)
    problems.stop_if_any()
    return PageFile(source, tuple(found))


def _without_others(source: Source, owned: Owned) -> Source:
    """Return a file in which the lines of blocks that are not `owned` are blank: up to their END,
    or to the next head where one has none.
    """
    kept, is_inside = [], False
    for number, line in enumerate(source.lines, start=1):
        head, name, *_ = (*WORD.findall(line), "", "")
        if head in HEADS:
            place = Span(source, number, line.find(name) + 1, len(name))
            is_inside = head in SIZES and bool(name) and not owned.has(Cell(name, place))
        kept.append("" if is_inside else line)
        is_inside = is_inside and head != "END"
    return dataclasses.replace(source, lines=tuple(kept))


def _require_format(words: Words, reading: _Reading) -> None:
    start = Span(reading.source, 1, 1)
    if not words or words[0].text != "KONSERVIERUNG_FORMAT":
        place = words[0].span if words else start
        label = "this is no DCM file: it does not begin with `KONSERVIERUNG_FORMAT`"
        reading.problems.error("form", place, label, "`KONSERVIERUNG_FORMAT 2.0`")
    elif len(words) != 2 or words[1].text not in VERSIONS:
        told = " ".join(word.text for word in words[1:])
        label = f"the format `{told}` of DCM is not known: 2.0 is"
        reading.problems.error("version", words[0].span, label)


def _lines(reading: _Reading) -> Lines:
    """Yield the words of each line that holds some and is no comment."""
    for number, line in enumerate(reading.source.lines, start=1):
        text = line.strip()
        if not text or text.startswith(COMMENTS):
            continue
        words = []
        for match in WORD.finditer(line):
            span = Span(reading.source, number, match.start() + 1, len(match[0]))
            if match[0].startswith('"') and (len(match[0]) < 2 or not match[0].endswith('"')):
                reading.problems.error("form", span, "a quote is opened and not closed")
            words.append(Cell(match[0], span))
        yield words


def _pass_over(head: Cell, lines: Lines, problems: Problems) -> None:
    if all(words[0].text != "END" for words in lines):
        problems.error("form", head.span, f"`{head.text}` has no `END`")


def _block(words: Words, lines: Lines, reading: _Reading) -> Block | None:
    """Return a block up to its END; None where its head is no name with its sizes."""
    head, *rest = words
    problems = reading.problems
    block = Block(head, rest[0] if rest else head, _sizes(head, rest[1:], problems))
    if not rest:
        problems.error("form", head.span, f"`{head.text}` is followed by a name")
    for line in lines:
        if line[0].text == "END":
            return block if rest and block.sizes is not None else None
        if line[0].text in SIZES:
            break
        _keep(block, line, reading)
        stop_if_many(problems)
    problems.error("form", head.span, f"`{head.text} {block.name.text}` has no `END`")
    problems.stop_if_any()
    return None


def _sizes(head: Cell, words: Words, problems: Problems) -> tuple[int, ...] | None:
    """Return the numbers behind a name: `4`, `4 3`, or `4 @ 3` of a block of values."""
    texts = [word.text for word in words]
    if head.text == "FESTWERTEBLOCK" and len(texts) == 3 and texts[1] == "@":
        texts = [texts[0], texts[2]]
    if len(texts) in SIZES[head.text] and all(map(is_count, texts)):
        return tuple(map(int, texts))
    place = words[0].span if words else head.span
    wanted = " or ".join(map(str, SIZES[head.text]))
    label = f"behind its name `{head.text}` has {wanted} whole numbers, how many values it has"
    if SIZES[head.text] == (0,):
        label = f"`{head.text}` has nothing behind its name"
    problems.error("form", place, label)
    return None


def _unquoted(cell: Cell) -> Cell:
    return Cell(cell.text.strip('"'), cell.span)


def _keep(block: Block, words: Words, reading: _Reading) -> None:
    """Take a line of a block."""
    word, *rest = words
    cells = [_unquoted(cell) for cell in rest]
    kept = _list_of(block, word.text)
    if kept is not None:
        if not cells:
            label = f"behind `{word.text}` there is no value"
            reading.problems.error("missing", word.span, label)
        kept.extend(cells)
    elif word.text.startswith("EINHEIT_") and len(cells) > 0:
        block.units[word.text.removeprefix("EINHEIT_")] = cells[0]
    elif word.text == "LANGNAME" and cells:
        block.about.append(cells[0].text)
    elif word.text not in PASSED_OVER and not word.text.startswith("EINHEIT_"):
        _pass_word(word, block, reading)


def _list_of(block: Block, word: str) -> list[Cell] | None:
    """Return where the values behind a word are kept; None for a word that has none."""
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


def _pass_word(word: Cell, block: Block, reading: _Reading) -> None:
    """Warn of a word that is not known; the first few are told, each where it stands first."""
    if word.text in reading.passed or len(reading.passed) >= MAX_PROBLEMS:
        return
    reading.passed.add(word.text)
    label = f"`{word.text}` is not known in `{block.head.text}`: it is passed over"
    reading.problems.warning("unknown-key", word.span, label, nearest(word.text, VALUE_WORDS))
