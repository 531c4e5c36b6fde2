"""Mutated files: a damaged file is read or refused with a reason, in time and without a traceback.

The number of mutations of each subject is MODEWRIGHT_MUTATIONS. A failure names the subject and the
number of the mutation, which reproduces it.
"""

from __future__ import annotations

import csv
import os
import shutil
import signal
import sys
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from engine.recordings.recording import read_recording
from language.loading.recording_map_reader import read_map
from language.overlays.expand_document import Project, read_document
from language.text.diagnostic import DataError, SpecError
from modewright.runtime.output_files import OutputError
from tests.fuzzing.mutations import mutate
from tests.fuzzing.other_readers import READERS, is_close
from tests.fuzzing.subjects import SUBJECTS, generate, write_project

pytestmark = pytest.mark.long

COUNT = int(os.environ.get("MODEWRIGHT_MUTATIONS", "25"))
"""Number of mutations of each subject."""
SEALED = ("side file", "store")
"""Subjects beside the values of a run: a change of them changes no value."""
READ_TWICE = ("mf4", "mf4 without map", "blf")
"""Subjects that libraries in C read, which might read other memory."""
LONGEST_SECONDS = 20.0
"""Time limit of a reading."""
REASONS = (SpecError, DataError, OutputError)
"""Exceptions that the command line prints as a reason, with exit code 1."""


class TooLongError(BaseException):
    """A reading took longer than LONGEST_SECONDS."""


@contextmanager
def time_limit() -> Iterator[None]:
    def stop(*_: Any) -> None:
        raise TooLongError

    old = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, LONGEST_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, old)


@pytest.fixture(scope="session")
def pristine(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project whose files are all valid."""
    folder = tmp_path_factory.mktemp("fuzz") / "project"
    (folder / "cache").mkdir(parents=True, mode=0o700)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MODEWRIGHT_CACHE", str(folder / "cache"))
        write_project(folder)
        generate(folder)
    return folder


def read(subject: str, folder: Path) -> tuple[str, object]:
    """Return `read` with what was read, or `refused` with the reason; other endings raise."""
    try:
        with time_limit(), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return "read", SUBJECTS[subject].read(folder)
    except REASONS as error:
        return "refused", str(error)
    except BaseException as error:
        if type(error).__name__ == "Exit":  # of the command line
            assert getattr(error, "exit_code", None) in (0, 1)
            return "refused", "by the command"
        raise


def files_of(subject: str, folder: Path) -> list[Path]:
    """Return the files of a subject."""
    found = sorted(path for path in folder.glob(SUBJECTS[subject].file) if path.is_file())
    assert found, subject
    return found


@pytest.mark.parametrize("subject", SUBJECTS)
def test_a_mutated_file_is_read_or_refused(
    subject: str, pristine: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MODEWRIGHT_CACHE", str(pristine / "cache"))
    failures: list[str] = []
    expected = read(subject, pristine)
    folder = tmp_path / "project"
    shutil.copytree(pristine, folder)
    if subject == "cache":
        monkeypatch.setenv("MODEWRIGHT_CACHE", str(folder / "cache"))
    for number in range(COUNT):
        files = files_of(subject, pristine)
        original = files[number % len(files)]
        target = folder / original.relative_to(pristine)
        target.write_bytes(mutate(original.read_bytes(), f"{subject} {number}"))
        try:
            outcome, result = read(subject, folder)
            if outcome == "refused" and not result:
                failures.append(f"{number}: no reason")
            if subject == "cache" and (outcome, result) != expected:
                failures.append(f"{number}: a damaged cache changes the result")
            if subject in SEALED and outcome == "read" and result != expected[1]:
                failures.append(f"{number}: a damaged file gives another result")
            if subject in READ_TWICE and (outcome, result) != read(subject, folder):
                failures.append(f"{number}: a second reading gives another result")
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            place = traceback.extract_tb(sys.exc_info()[2])[-1]
            name = f"{Path(place.filename).name}:{place.lineno}"
            failures.append(f"{number}: {type(error).__name__} at {name}: {error}"[:200])
        if subject == "store":
            shutil.rmtree(folder / "study" / "out")
            shutil.copytree(pristine / "study" / "out", folder / "study" / "out")
        else:
            shutil.copyfile(original, target)
    assert not failures, f"{len(failures)} of {COUNT} mutations:\n" + "\n".join(failures)


@pytest.mark.parametrize(
    ("subject", "position"),
    [(name, k) for name, one in SUBJECTS.items() for k in range(len(one.neutral))],
    ids=[f"{name} {f.__name__}" for name, one in SUBJECTS.items() for f in one.neutral],
)
def test_a_mutation_that_changes_nothing_changes_no_result(
    subject: str, position: int, pristine: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MODEWRIGHT_CACHE", str(pristine / "cache"))
    folder = tmp_path / "project"
    shutil.copytree(pristine, folder)
    expected = read(subject, folder)
    (target,) = files_of(subject, folder)
    target.write_bytes(SUBJECTS[subject].neutral[position](target.read_bytes()))
    outcome, result = read(subject, folder)
    assert outcome == "read", result
    assert result == expected[1]


@pytest.mark.parametrize("subject", READERS)
def test_no_mutated_file_differs_silently(subject: str, pristine: Path, tmp_path: Path) -> None:
    """A file that is read has the values of another reader, or what is assumed is told."""
    mutated, recording, other_reader = READERS[subject]
    folder = tmp_path / "project"
    shutil.copytree(pristine, folder)
    mapping = read_map(read_document(folder / "spec" / "bench.yaml"), Project(folder))
    failures: list[str] = []
    original = (pristine / mutated).read_bytes()
    compared = 0
    for number in range(COUNT):
        (folder / mutated).write_bytes(mutate(original, f"{subject} {number}"))
        try:
            found = read_recording(folder / recording, mapping, ["u"])
        except REASONS:
            continue
        try:
            other = other_reader(folder)
        except (ValueError, csv.Error):
            other = None
        channel = found.channels["u"]
        own = list(zip(map(float, channel.times), channel.values, strict=True))
        compared += other is not None
        if not found.assumptions and (other is None or not is_close(own, other)):
            failures.append(f"{number}: {'irregular' if other is None else 'other values'}")
    assert not failures, f"{len(failures)} of {COUNT} mutations:\n" + "\n".join(failures)
    assert compared or COUNT < 100  # few mutations leave a file regular
