"""Formats: the files of calibration tools that are written and read, by their endings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.exchange.cdfx import cdfx_text
from codegen.exchange.cdfx_reader import read_cdfx
from codegen.exchange.characteristic import Characteristic, PageFile, report_twice
from codegen.exchange.csv_page import csv_text, read_csv
from codegen.exchange.dcm import dcm_text
from codegen.exchange.dcm_reader import read_dcm
from codegen.exchange.owned import Owned
from codegen.exchange.page_text import page_bytes, page_text
from language.finding import shown
from language.problem import Problems, Source, Span, SpecError

Reader = Callable[[str, bytes, Problems, Owned], PageFile]


@dataclass(frozen=True)
class Format:
    """How a page is written under a title with lines of a heading, and how it is read."""

    write: Callable[[str, Sequence[str], Sequence[Characteristic]], str]
    read: Reader


def _dcm(name: str, data: bytes, problems: Problems, owned: Owned) -> PageFile:
    """DCM says nothing of its encoding: UTF-8, else what Windows writes in the West."""
    source, _ = page_text(data, name, "latin-1")
    return read_dcm(source, problems, owned)


def _cdfx(name: str, data: bytes, problems: Problems, owned: Owned) -> PageFile:
    """XML says its encoding itself; its lines are shown where they are UTF-8."""
    lines = tuple(data.decode("utf-8", errors="replace").splitlines())
    return read_cdfx(Source(name, lines), data, problems, owned)


def _csv(name: str, data: bytes, problems: Problems, owned: Owned) -> PageFile:
    source, text = page_text(data, name)
    return read_csv(source, text, problems, owned)


FORMATS: Mapping[str, Format] = {
    "dcm": Format(dcm_text, _dcm),
    "cdfx": Format(cdfx_text, _cdfx),
    "csv": Format(csv_text, _csv),
}


def format_name(path: Path, named: str | None = None) -> str | None:
    """Return the name of the format that is named, else that of a file's ending; None if none."""
    name = named or path.suffix.lower().removeprefix(".")
    return name if name in FORMATS else None


def read_page(
    path: Path, problems: Problems, named: str | None = None, owned: Owned | None = None
) -> PageFile:
    """Read a file of calibration data, of its names those that are `owned`.

    Raises SpecError with its problems.
    """
    name = shown(path)
    data = page_bytes(path, name)
    form = format_name(path, named)
    if form is None:
        label = f"a page of a calibration ends with {', '.join(f'.{each}' for each in FORMATS)}"
        problems.error("form", Span(Source(name), 1, 1), label, "or name its format: `--format`")
        raise SpecError(problems.found)
    found = FORMATS[form].read(name, data, problems, owned or Owned())
    report_twice(found.characteristics, problems)
    problems.stop_if_any()
    return found
