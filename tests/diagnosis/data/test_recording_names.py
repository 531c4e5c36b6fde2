"""What recordings are called, so that no two are mistaken for each other."""

from __future__ import annotations

from pathlib import Path

from diagnosis.data.recording_names import distinguish_file_names, recording_names


def test_bare_names_where_they_tell_all_apart() -> None:
    paths = [Path("train/a.csv"), Path("held_out/b.csv")]
    assert list(recording_names(paths[:1], paths[1:]).values()) == ["a.csv", "b.csv"]


def test_one_that_is_held_out_is_not_called_as_one_that_is_learnt_from() -> None:
    names = recording_names([Path("train/a.csv")], [Path("held_out/a.csv"), Path("held_out/b.csv")])
    assert list(names.values()) == ["a.csv", "held_out/a.csv", "held_out/b.csv"]


def test_as_many_folders_as_are_needed() -> None:
    names = distinguish_file_names([Path("one/car/a.csv"), Path("two/car/a.csv")])
    assert list(names.values()) == ["one/car/a.csv", "two/car/a.csv"]
