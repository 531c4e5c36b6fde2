"""MDF run: a trajectory as an MF4 file for measurement tools, with mode names as value-to-text."""

from __future__ import annotations

import contextlib
import io
import logging
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

import numpy as np

from engine.results.sampled_run import SignalArray
from engine.results.trajectory import Trajectory
from language.text.diagnostic import MissingToolError

MDF_VERSION = "4.10"
"""Version of ASAM MDF that most tools read."""
START = datetime(1970, 1, 1, tzinfo=UTC)
"""Start of the measurement in the file: a run has no date."""


def encode_mdf(trajectory: Trajectory) -> bytes:
    """Return a trajectory as the bytes of an MF4 file with one group and the master `time` [s].

    Channels have the names and units of the signals. Modes have whole numbers with a value-to-text
    conversion to their names. The comment of the file has the name of the run, its faults and the
    reason for which it stopped. Of rows at one time the last one is written, because time stamps of
    a channel increase. Raises MissingToolError without asammdf.
    """
    try:
        import asammdf
    except ImportError:
        raise MissingToolError(
            "an MF4 file needs the package `asammdf`: pip install 'modewright[mdf]'; or write .csv"
        ) from None
    logging.getLogger("asammdf").setLevel(logging.CRITICAL)
    last = np.append(np.diff(trajectory.times) > 0.0, True)[: len(trajectory.times)]
    stamps = trajectory.times[last]
    signals = [
        asammdf.Signal(
            _smallest(values[last]),
            stamps,
            name=name,
            unit=trajectory.units[name],
            conversion=_mode_conversion(trajectory.modes.get(name, {})),
        )
        for name, values in trajectory.signals.items()
    ]
    with contextlib.redirect_stdout(io.StringIO()):
        file = asammdf.MDF(version=MDF_VERSION)
        file.start_time = START
        file.append(signals, acq_name=trajectory.name, common_timebase=True)
        file.header.comment = _comment(trajectory)
        buffer = io.BytesIO()
        file.save(buffer)
        file.close()
    return buffer.getvalue()


def _smallest(values: SignalArray) -> Any:
    """Return integers (n_samples,) with the fewest bytes that hold them; reals as they are."""
    if values.dtype != np.int64 or not len(values):
        return values
    kind = np.promote_types(
        np.min_scalar_type(int(values.min())), np.min_scalar_type(int(values.max()))
    )
    return values.astype(kind) if kind.kind in "iu" else values


def _mode_conversion(names: Mapping[int, str]) -> dict[str, Any] | None:
    """Return the conversion of mode numbers to names; None for a signal without names."""
    if not names:
        return None
    conversion: dict[str, Any] = {"default": b""}
    for k, (number, name) in enumerate(sorted(names.items())):
        conversion |= {f"val_{k}": number, f"text_{k}": name.encode()}
    return conversion


def _comment(trajectory: Trajectory) -> str:
    """Return the comment of the file."""
    lines = [f"run {trajectory.name}, written by modewright"]
    lines += [f"fault: {fault}" for fault in trajectory.faults]
    lines += [f"stopped: {trajectory.stopped}"] if trajectory.stopped else []
    return "\n".join(lines)
