"""Formats of calibration files: writers and readers of DCM, CDFX and CSV by file name extension."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.exchange.calibration.cdfx_reader import read_cdfx
from codegen.exchange.calibration.cdfx_writer import format_cdfx
from codegen.exchange.calibration.characteristic import (
    FileCharacteristic,
    PageFile,
    report_duplicates,
)
from codegen.exchange.calibration.csv_page import format_csv, read_csv
from codegen.exchange.calibration.dcm_reader import read_dcm
from codegen.exchange.calibration.dcm_writer import format_dcm
from codegen.exchange.calibration.encoding import decode_text, read_bytes
from codegen.exchange.calibration.name_filter import NameFilter
from language.text.diagnostic import Problems, Source, Span, SpecError
from language.text.project_files import display_path

Reader = Callable[[str, bytes, Problems, NameFilter], PageFile]
"""A function that reads a page: name, bytes, problems and filter to a `PageFile`."""


@dataclass(frozen=True)
class Format:
    """The writer of a format (title, heading lines, page) and its reader."""

    write: Callable[[str, Sequence[str], Sequence[FileCharacteristic]], str]
    read: Reader


def _decode_dcm(name: str, data: bytes, problems: Problems, name_filter: NameFilter) -> PageFile:
    """Read a DCM file.

    DCM does not declare its encoding: it is UTF-8, else Latin-1, the usual encoding of Western
    Windows.
    """
    source, _ = decode_text(data, name, "latin-1")
    return read_dcm(source, problems, name_filter)


def _decode_cdfx(name: str, data: bytes, problems: Problems, name_filter: NameFilter) -> PageFile:
    """Read a CDFX file.

    XML declares its own encoding; the lines shown in messages are decoded as UTF-8.
    """
    lines = tuple(data.decode("utf-8", errors="replace").splitlines())
    return read_cdfx(Source(name, lines), data, problems, name_filter)


def _decode_csv(name: str, data: bytes, problems: Problems, name_filter: NameFilter) -> PageFile:
    """Read a CSV file in UTF-8."""
    source, text = decode_text(data, name)
    return read_csv(source, text, problems, name_filter)


FORMATS: Mapping[str, Format] = {
    "dcm": Format(format_dcm, _decode_dcm),
    "cdfx": Format(format_cdfx, _decode_cdfx),
    "csv": Format(format_csv, _decode_csv),
}
"""The formats by name, which is also the extension of a file."""


def format_name(path: Path, explicit_format: str | None = None) -> str | None:
    """Return the explicit format, else the extension of the file in lower case without its dot.

    Returns None if that is not a key of FORMATS.
    """
    name = explicit_format or path.suffix.lower().removeprefix(".")
    return name if name in FORMATS else None


def read_page(
    path: Path,
    problems: Problems,
    explicit_format: str | None = None,
    name_filter: NameFilter | None = None,
) -> PageFile:
    """Return the characteristics of a calibration file whose names the filter accepts; all if None.

    The format is that of `format_name`. Problems are reported to `problems`; raises SpecError for
    an unreadable file, an unknown format, duplicate names and errors of the format's reader.
    """
    name = display_path(path)
    data = read_bytes(path, name)
    form = format_name(path, explicit_format)
    if form is None:
        label = f"a page of a calibration ends with {', '.join(f'.{each}' for each in FORMATS)}"
        problems.error("form", Span(Source(name), 1, 1), label, "or name its format: `--format`")
        raise SpecError(problems.reported)
    page = FORMATS[form].read(name, data, problems, name_filter or NameFilter())
    report_duplicates(page.characteristics, problems)
    problems.raise_if_errors()
    return page
