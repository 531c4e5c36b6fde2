"""Fixtures that read recordings written on the spot."""

from __future__ import annotations

from pathlib import Path

import pytest

from engine.recordings.recording import Recording, read_recording
from language.text.diagnostic import SpecError
from tests.engine.recording_files import COLUMNS, Read, RenderProblems, render_problems, write_map


@pytest.fixture
def read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Read:
    """Return a function that writes a file `drive.csv` and reads it with a map."""
    monkeypatch.chdir(tmp_path)

    def reading(
        data: str | bytes, columns: str = COLUMNS, name: str = "drive.csv", unit: str = "s"
    ) -> Recording:
        path = tmp_path / name
        path.write_bytes(data.encode() if isinstance(data, str) else data)
        mapping = write_map(tmp_path, columns, unit)
        return read_recording(path, mapping, list(mapping.columns))

    return reading


@pytest.fixture
def told(read: Read) -> RenderProblems:
    """Return a function that gives the rendered problems of a bad file."""

    def telling(data: str | bytes, columns: str = COLUMNS, name: str = "drive.csv") -> str:
        with pytest.raises(SpecError) as caught:
            read(data, columns, name)
        return render_problems(caught.value.problems)

    return telling
