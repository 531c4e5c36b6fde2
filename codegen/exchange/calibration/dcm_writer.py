"""DCM writer: a calibration page in the format DCM 2.0 (ETAS), in ASCII.

Axes are compiled into the C, so tables are FESTKENNLINIE and FESTKENNFELD. X is the first axis of
`over`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from codegen.emit.c_comment import sanitise_comment
from codegen.exchange.calibration.characteristic import Cell, FileCharacteristic, transpose_map

DCM_KINDS = ("FESTWERT", "FESTKENNLINIE", "FESTKENNFELD")
"""The keyword of a characteristic by its number of axes."""
VALUES_PER_LINE = 6
"""Maximum number of values in a line, as other tools write them."""


def format_dcm(title: str, heading: Sequence[str], page: Sequence[FileCharacteristic]) -> str:
    """Return a page as the text of a DCM 2.0 file.

    `title` is the function (FKT) of all characteristics. Each text of `heading` is a comment line
    that begins with `* `.
    """
    lines = [f"* {line}" for line in heading]
    lines += ["", "KONSERVIERUNG_FORMAT 2.0", "", "FUNKTIONEN"]
    lines += [f'  FKT {title} "" ""', "END", ""]
    for one in page:
        lines += [*_format_block(one, title), ""]
    return "\n".join(lines)


def _format_block(characteristic: FileCharacteristic, title: str) -> Iterator[str]:
    """Yield the lines of a characteristic."""
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
    """Yield for each point of Y its line, then the lines of values over X."""
    first, second = characteristic.axes
    values: Sequence[Cell] = transpose_map(characteristic.values, len(second.points))
    for number, point in enumerate(second.points):
        yield f"  ST/Y {point.text}"
        row = values[number * len(first.points) : (number + 1) * len(first.points)]
        yield from _format_lines(word, [cell.text for cell in row])


def _format_lines(word: str, texts: Sequence[str]) -> Iterator[str]:
    """Yield lines that begin with a keyword and hold at most VALUES_PER_LINE texts."""
    for start in range(0, len(texts), VALUES_PER_LINE):
        yield f"  {word} {' '.join(texts[start : start + VALUES_PER_LINE])}"


def _quote(text: str) -> str:
    """Return a text in double quotes, as one line of ASCII.

    Double quotes inside become single ones.
    """
    return '"' + sanitise_comment(text).replace('"', "'") + '"'
