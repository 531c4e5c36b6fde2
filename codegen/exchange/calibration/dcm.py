"""DCM: a page as DCM 2.0 (ETAS), in ASCII.

Axes are compiled in, so tables are FESTKENNLINIE and FESTKENNFELD: X is the first axis of `over`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from codegen.emit.c_comment import sanitise_comment
from codegen.exchange.calibration.characteristic import Cell, FileCharacteristic, transpose_map

DCM_KINDS = ("FESTWERT", "FESTKENNLINIE", "FESTKENNFELD")
"""What a characteristic is called, by its number of axes."""
VALUES_PER_LINE = 6
"""Most numbers in a line, as other tools write them."""


def format_dcm(title: str, heading: Sequence[str], page: Sequence[FileCharacteristic]) -> str:
    """Return a page as a DCM file; `title` is the function that all belong to."""
    lines = [f"* {line}" for line in heading]
    lines += ["", "KONSERVIERUNG_FORMAT 2.0", "", "FUNKTIONEN"]
    lines += [f'  FKT {title} "" ""', "END", ""]
    for one in page:
        lines += [*_format_block(one, title), ""]
    return "\n".join(lines)


def _format_block(characteristic: FileCharacteristic, title: str) -> Iterator[str]:
    sizes = "".join(f" {len(axis.points)}" for axis in characteristic.axes)
    yield f"{DCM_KINDS[len(characteristic.axes)]} {characteristic.name.text}{sizes}"
    if characteristic.about:
        yield f"  LANGNAME {_quote(characteristic.about)}"
    yield f"  FUNKTION {title}"
    for letter, axis in zip("XY", characteristic.axes, strict=False):
        yield f"  EINHEIT_{letter} {_quote(axis.unit.text if axis.unit else '')}"
    if characteristic.unit:
        yield f"  EINHEIT_W {_quote(characteristic.unit.text)}"
    word = "TEXT" if characteristic.is_text else "WERT"
    texts = [
        _quote(cell.text) if characteristic.is_text else cell.text for cell in characteristic.values
    ]
    if not characteristic.axes:
        yield f"  {word} {texts[0]}"
    else:
        yield from _format_lines("ST/X", [cell.text for cell in characteristic.axes[0].points])
    if len(characteristic.axes) == 1:
        yield from _format_lines(word, texts)
    elif characteristic.axes:
        yield from _format_rows(characteristic, word)
    yield "END"


def _format_rows(characteristic: FileCharacteristic, word: str) -> Iterator[str]:
    """A row of values over X for each point of Y."""
    first, second = characteristic.axes
    values: Sequence[Cell] = transpose_map(characteristic.values, len(second.points))
    for number, point in enumerate(second.points):
        yield f"  ST/Y {point.text}"
        row = values[number * len(first.points) : (number + 1) * len(first.points)]
        yield from _format_lines(word, [cell.text for cell in row])


def _format_lines(word: str, texts: Sequence[str]) -> Iterator[str]:
    for start in range(0, len(texts), VALUES_PER_LINE):
        yield f"  {word} {' '.join(texts[start : start + VALUES_PER_LINE])}"


def _quote(text: str) -> str:
    """Return a text between quotes, of which it can hold none."""
    return '"' + sanitise_comment(text).replace('"', "'") + '"'
