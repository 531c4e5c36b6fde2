"""Reading: small recordings written and read, and what the user is told of bad ones."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from engine.recording import Channel, Recording, read_recording
from language.experiment import RecordingMap
from language.map import read_map
from language.problem import Problem, SpecError, render_all
from language.project import Project, read_document

Read = Callable[..., Recording]
Told = Callable[..., str]

HEAD = "t_s,torque_Nm,speed_rpm\n"
GOOD = HEAD + "0.01,92.5,2639\n0.02,91.0,\n0.03,-1.5,2640\n"
COLUMNS = """\
  torque_Nm: {to: T_em, unit: N*m}
  speed_rpm: {to: y_em, unit: rpm, blank: skip}
"""


def made_map(folder: Path, columns: str, unit: str = "s") -> RecordingMap:
    head = f"language: 1\nmap: bench\ntime: {{column: t_s, unit: {unit}}}\ncolumns:\n"
    path = folder / "map.yaml"
    path.write_text(head + columns, "utf-8")
    return read_map(read_document(path), Project(folder))


def rendered(problems: Sequence[Problem]) -> str:
    """Return what the user is told, without the codes of the kinds."""
    return re.sub(r" \[MW\d+\]$", "", render_all(problems), flags=re.MULTILINE)


def told_of(path: Path, folder: Path) -> str:
    mapping = made_map(folder, COLUMNS)
    with pytest.raises(SpecError) as caught:
        read_recording(path, mapping, list(mapping.columns))
    return rendered(caught.value.problems)


def only(recording: Recording) -> Channel:
    (channel,) = recording.channels.values()
    return channel
