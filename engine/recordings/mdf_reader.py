"""MDF reader: reads the channels of an MDF file, each with the time stamps of its group."""

from __future__ import annotations

import contextlib
import gc
import io
import logging
import sys
from pathlib import Path
from typing import Any

import numpy as np

from engine.recordings.recording_file import (
    RecordedFile,
    Samples,
    exact_fraction,
    require_size,
    unreadable_error,
)
from language.overlays.expand_document import display_path
from language.text.diagnostic import MissingToolError, Source, Span

MASTER_CHANNELS = ("time", "t", "timestamps")
"""Names of channels that hold the time of their group."""
MAGIC = (b"MDF     ", b"UnFinMF ")
"""First bytes of a finished and of an unfinished MDF file."""
MIN_SIZE = 168
"""Size of the first two blocks of an MF4 file in bytes."""


def read_mdf(path: Path) -> RecordedFile:
    """Open an MDF file of version 3 or 4; channels are read on demand and cached.

    Names are those of all channels but time channels (`MASTER_CHANNELS`), as often as they occur.
    Raises SpecError if the file cannot be read, is empty, too large or does not start as MDF
    (`MAGIC`), and MissingToolError without asammdf. Messages of asammdf are silenced.
    """
    source = Source(display_path(path))
    require_size(path, source)
    try:
        import asammdf
    except ImportError:
        raise MissingToolError(
            "an MF4 file needs the package `asammdf`: pip install 'modewright[mdf]'"
        ) from None
    with path.open("rb") as file:
        start = file.read(MIN_SIZE)
    if len(start) < MIN_SIZE or not start.startswith(MAGIC):
        raise unreadable_error(source, "understood as MDF: it does not start like one")
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)
    mdf = _open_mdf(asammdf, path, source)
    names = [name for name, places in mdf.channels_db.items() for _ in places]
    names = [name for name in names if name.lower() not in MASTER_CHANNELS]
    cached: dict[str, Samples] = {}

    def read(name: str) -> Samples:
        if name not in cached:
            cached[name] = _read_samples(mdf, name, source)
        return cached[name]

    return RecordedFile(source, "channel", names, read, len(names), is_stamped=True)


def _open_mdf(asammdf: Any, path: Path, source: Source) -> Any:
    """Return the file as an asammdf object. Raises SpecError.

    Errors that the library raises during garbage collection of a broken file are suppressed.
    """
    hook, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            return asammdf.MDF(path)
    except Exception as error:
        message = _first_line(error)
    finally:
        gc.collect()  # destructors of broken objects run while their errors are suppressed
        sys.unraisablehook = hook
    raise unreadable_error(source, f"understood as MDF: {message}")


def _read_samples(mdf: Any, name: str, source: Source) -> Samples:
    """Return the samples of a channel; values marked invalid are None, texts and arrays NaN.

    Raises SpecError if the channel cannot be read.
    """
    try:
        signal = mdf.get(name, ignore_invalidation_bits=True)
        values = np.asarray(signal.samples)
        stamps = [exact_fraction(time) for time in signal.timestamps]
    except Exception as error:
        raise unreadable_error(
            source, f"understood: channel `{name}`: {_first_line(error)}"
        ) from None
    if values.ndim != 1 or values.dtype.kind not in "biuf":
        texts = [str(value) for value in values]
        numbers: list[float | None] = [np.nan] * len(values)
    else:
        numbers = [float(value) for value in values]
        texts = [repr(value) for value in numbers]
    invalid = getattr(signal, "invalidation_bits", None)
    if invalid is not None:
        flags = np.asarray(invalid)
        numbers = [None if bad else v for v, bad in zip(numbers, flags, strict=True)]
    return Samples(
        numbers, lambda k: texts[k], lambda k: Span(source, k + 1, 1), stamps, signal.unit or ""
    )


def _first_line(error: Exception) -> str:
    """Return the first line of an error message, or the name of the error."""
    text = str(error).strip().splitlines()
    return text[0] if text else type(error).__name__
