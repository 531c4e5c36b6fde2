"""Picture format: the formats of pictures that are written to files."""

from __future__ import annotations

from pathlib import Path

PICTURE_FORMATS = ("png", "svg", "pdf")
"""Formats of pictures; a file has the suffix of its format."""


def picture_format(path: Path) -> str:
    """Return the format of a picture by the suffix of its path in any case.

    Raises ValueError for a suffix of no format in PICTURE_FORMATS.
    """
    form = path.suffix.lower().removeprefix(".")
    if form not in PICTURE_FORMATS:
        suffixes = ", ".join(f".{one}" for one in PICTURE_FORMATS)
        raise ValueError(f"{path}: a picture ends with {suffixes}")
    return form
