"""Windows of a map: the times of a recording that are used."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from engine.recordings.recording import Recording, read_recording, split_by_windows
from language.loading.recording_map_reader import read_map
from language.overlays.expand_document import Project, read_document
from language.text.diagnostic import SpecError
from tests.engine.recording_files import render_problems

HEAD = "language: 1\nmap: bench\ntime: {column: t_s, unit: s}\ncolumns: {a: {to: u, unit: A}}\n"


def read(folder: Path, windows: str) -> Recording:
    (folder / "map.yaml").write_text(HEAD + windows, "utf-8")
    rows = "".join(f"{k / 10},{k}\n" for k in range(51))
    (folder / "run.csv").write_text("t_s,a\n" + rows, "utf-8")
    mapping = read_map(read_document(folder / "map.yaml"), Project(folder))
    return read_recording(folder / "run.csv", mapping, ["a"])


def test_each_window_is_a_piece_with_both_its_ends(tmp_path: Path) -> None:
    found = split_by_windows(read(tmp_path, "windows: [[1 s, 1.2 s], [3.05 s, 3.2 s]]\n"))
    assert [piece.channels["a"].values for piece in found] == [(10.0, 11.0, 12.0), (31.0, 32.0)]
    assert [float(piece.end) for piece in found] == [1.2, 3.2]


def test_a_recording_goes_from_the_first_window_to_the_last(tmp_path: Path) -> None:
    recording = read(tmp_path, "windows: [[1 s, 1.2 s], [3 s, 3.2 s]]\n")
    assert recording.channels["a"].times[0] == Fraction(1)
    assert recording.end == Fraction(32, 10)
    assert recording.is_used(Fraction(1)) and not recording.is_used(Fraction(2))


def test_windows_of_another_file_leave_this_one_whole(tmp_path: Path) -> None:
    recording = read(tmp_path, "windows: {walk.csv: [[1 s, 2 s]]}\n")
    assert len(recording.channels["a"].values) == 51
    assert split_by_windows(recording) == [recording]


def test_windows_of_this_file_go_before_those_of_every_file(tmp_path: Path) -> None:
    assert len(read(tmp_path, "windows: {run.csv: [[1 s, 2 s]]}\n").channels["a"].values) == 11


def test_a_window_without_values_is_told(tmp_path: Path) -> None:
    with pytest.raises(SpecError) as caught:
        read(tmp_path, "windows: [[1 s, 2 s], [7 s, 8 s]]\n")
    assert render_problems(caught.value.problems).endswith(
        "error: `a` has no value from 7 s to 8 s, a window of this map\n"
        "  map: bench\n"
        "       ^^^^^\n"
        "help: run.csv goes from 0 s to 5 s"
    )
