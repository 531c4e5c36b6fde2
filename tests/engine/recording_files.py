"""Reading: small recordings written and read, and what the user is told of bad ones."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from engine.recordings.recording import Channel, Recording, read_recording
from language.loading.recording_map_reader import read_map
from language.model.system import RecordingMap
from language.overlays.expand_document import Project, read_document
from language.text.diagnostic import Problem, SpecError, render_all

Read = Callable[..., Recording]
RenderProblems = Callable[..., str]

HEAD = "t_s,torque_Nm,speed_rpm\n"
GOOD = HEAD + "0.01,92.5,2639\n0.02,91.0,\n0.03,-1.5,2640\n"
COLUMNS = """\
  torque_Nm: {to: T_em, unit: N*m}
  speed_rpm: {to: y_em, unit: rpm, blank: skip}
"""


def write_map(folder: Path, columns: str, unit: str = "s") -> RecordingMap:
    head = f"language: 1\nmap: bench\ntime: {{column: t_s, unit: {unit}}}\ncolumns:\n"
    path = folder / "map.yaml"
    path.write_text(head + columns, "utf-8")
    return read_map(read_document(path), Project(folder))


def render_problems(problems: Sequence[Problem]) -> str:
    """Return what the user is told, without the codes of the kinds."""
    return re.sub(r" \[MW\d+\]$", "", render_all(problems), flags=re.MULTILINE)


def problems_of_file(path: Path, folder: Path) -> str:
    mapping = write_map(folder, COLUMNS)
    with pytest.raises(SpecError) as caught:
        read_recording(path, mapping, list(mapping.columns))
    return render_problems(caught.value.problems)


def only_channel(recording: Recording) -> Channel:
    (channel,) = recording.channels.values()
    return channel
