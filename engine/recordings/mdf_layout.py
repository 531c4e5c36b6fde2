"""MDF layout: checks that channels lie in the records of their group.

The C functions of asammdf read at the places that a file states, also behind the end of its data:
the values would be those of any memory, or the process would end.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

VARIABLE_LENGTH = 1
"""Type of a channel whose record holds the offset of a value of variable length."""
OFFSET_BYTES = 8
"""Size of such an offset."""
LENGTH_BYTES = 4
"""Size of the length in front of a value of variable length."""


def explain_outside(mdf: Any, group: int, index: int) -> str:
    """Return why a channel, its master or a part of it lies outside of its data, as a clause.

    `mdf` is an asammdf object. The text is empty if the channel can be read.
    """
    found = mdf.groups[group]
    parts = {(group, index), *_parts_of(found, index, group)}
    if (master := mdf.masters_db.get(group)) is not None:
        parts.add((group, master))
    for own, number in sorted(parts):
        text = _explain_channel(mdf, mdf.groups[own], number)
        if text:
            return text
    return ""


def _parts_of(group: Any, index: int, number: int, depth: int = 0) -> Iterator[tuple[int, int]]:
    """Yield the places of the channels that a structure contains."""
    dependencies = getattr(group, "channel_dependencies", None)
    for part in (dependencies[index] if dependencies else None) or ():
        if isinstance(part, tuple) and part[0] == number and depth < len(group.channels):
            yield (part[0], part[1])
            yield from _parts_of(group, part[1], number, depth + 1)


def _explain_channel(mdf: Any, group: Any, index: int) -> str:
    """Return why a channel lies outside of its record or of its values of variable length."""
    channel = group.channels[index]
    width = int(group.channel_group.samples_byte_nr)
    end = _end_of(group, index)
    if end > width:
        return f"channel `{channel.name}` ends at byte {end} of records of {width} bytes"
    invalid = int(getattr(group.channel_group, "invalidation_bytes_nr", 0) or 0)
    position = int(getattr(channel, "pos_invalidation_bit", -1))
    if invalid and position >= 8 * invalid:
        text = f"channel `{channel.name}` has bit {position} of {8 * invalid} that mark invalid "
        return text + "values"
    is_variable = getattr(channel, "channel_type", 0) == VARIABLE_LENGTH
    if is_variable and not _is_version_3(channel):
        return _explain_values(mdf, group, index, width + invalid)
    return ""


def _end_of(group: Any, index: int) -> int:
    """Return the byte of a record behind a channel; 0 for a channel that is not in records."""
    channel = group.channels[index]
    bits = int(channel.bit_count)
    if not bits:
        return 0
    if _is_version_3(channel):
        start = int(channel.start_offset) + 8 * int(getattr(channel, "additional_byte_offset", 0))
    else:
        start = 8 * int(channel.byte_offset) + int(channel.bit_offset)
    elements = 1
    dependencies = getattr(group, "channel_dependencies", None)
    for part in (dependencies[index] if dependencies else None) or ():
        if not isinstance(part, tuple):
            sizes = [int(getattr(part, f"dim_size_{k}", 1)) for k in range(int(part.dims))]
            elements *= math.prod(sizes)
    return (start + bits * elements + 7) // 8


def _is_version_3(channel: Any) -> bool:
    """Return whether a channel is one of MDF 3, whose types have other numbers."""
    return hasattr(channel, "start_offset")


def _explain_values(mdf: Any, group: Any, index: int, width: int) -> str:
    """Return why values of variable length lie outside of their data, as a clause."""
    reader = getattr(mdf, "_mdf", mdf)
    data = b"".join(bytes(fragment.data) for fragment in reader._load_data(group))
    values = np.frombuffer(reader._load_signal_data(group, index) or b"", dtype=np.uint8)
    if not len(values):
        return ""
    rows = len(data) // width
    table = np.frombuffer(data, dtype=np.uint8, count=rows * width).reshape(rows, width)
    start = int(group.channels[index].byte_offset)
    offsets = np.ascontiguousarray(table[:, start : start + OFFSET_BYTES]).view("<u8").ravel()
    limit = len(values) - LENGTH_BYTES
    is_inside = offsets <= np.uint64(max(limit, 0))
    ends = np.zeros(rows, dtype=np.int64)
    places = offsets[is_inside].astype(np.int64)
    lengths = sum(values[places + k].astype(np.int64) << 8 * k for k in range(LENGTH_BYTES))
    ends[is_inside] = places + LENGTH_BYTES + lengths
    bad = np.flatnonzero(~is_inside | (ends > len(values)))
    if limit < 0 or len(bad):
        row = int(bad[0]) + 1 if len(bad) else 1
        return f"the value {row} of channel `{group.channels[index].name}` lies outside of the file"
    return ""
