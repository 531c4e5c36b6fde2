"""DCM: a page as DCM 2.0 (ETAS), in ASCII.

Axes are compiled in, so tables are FESTKENNLINIE and FESTKENNFELD: X is the first axis of `over`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from codegen.comment import comment
from codegen.exchange.characteristic import Cell, Characteristic, turned

KINDS = ("FESTWERT", "FESTKENNLINIE", "FESTKENNFELD")
"""What a characteristic is called, by its number of axes."""
IN_LINE = 6
"""Most numbers in a line, as other tools write them."""


def dcm_text(title: str, heading: Sequence[str], page: Sequence[Characteristic]) -> str:
    """Return a page as a DCM file; `title` is the function that all belong to."""
    lines = [f"* {line}" for line in heading]
    lines += ["", "KONSERVIERUNG_FORMAT 2.0", "", "FUNKTIONEN"]
    lines += [f'  FKT {title} "" ""', "END", ""]
    for one in page:
        lines += [*_block(one, title), ""]
    return "\n".join(lines)


def _block(one: Characteristic, title: str) -> Iterator[str]:
    sizes = "".join(f" {len(axis.points)}" for axis in one.axes)
    yield f"{KINDS[len(one.axes)]} {one.name.text}{sizes}"
    if one.about:
        yield f"  LANGNAME {_quoted(one.about)}"
    yield f"  FUNKTION {title}"
    for letter, axis in zip("XY", one.axes, strict=False):
        yield f"  EINHEIT_{letter} {_quoted(axis.unit.text if axis.unit else '')}"
    if one.unit:
        yield f"  EINHEIT_W {_quoted(one.unit.text)}"
    word = "TEXT" if one.is_text else "WERT"
    texts = [_quoted(cell.text) if one.is_text else cell.text for cell in one.values]
    if not one.axes:
        yield f"  {word} {texts[0]}"
    else:
        yield from _lines("ST/X", [cell.text for cell in one.axes[0].points])
    if len(one.axes) == 1:
        yield from _lines(word, texts)
    elif one.axes:
        yield from _rows(one, word)
    yield "END"


def _rows(one: Characteristic, word: str) -> Iterator[str]:
    """A row of values over X for each point of Y."""
    first, second = one.axes
    values: Sequence[Cell] = turned(one.values, len(second.points))
    for number, point in enumerate(second.points):
        yield f"  ST/Y {point.text}"
        row = values[number * len(first.points) : (number + 1) * len(first.points)]
        yield from _lines(word, [cell.text for cell in row])


def _lines(word: str, texts: Sequence[str]) -> Iterator[str]:
    for start in range(0, len(texts), IN_LINE):
        yield f"  {word} {' '.join(texts[start : start + IN_LINE])}"


def _quoted(text: str) -> str:
    """Return a text between quotes, of which it can hold none."""
    return '"' + comment(text).replace('"', "'") + '"'
