"""SIGTERM and SIGHUP end a command in order: no temporary file and no part of an output is left."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.diagnosis.rotor_project import COMMAND as DIAGNOSE, write_project

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[3]
STUDIES = ROOT / "tests" / "data" / "studies"
TRACE = ROOT / "tests" / "data" / "paper" / "est_paper_tip_out_1kHz.csv.gz"
COMMANDS: dict[str, list[str | Path]] = {
    "lockstep": ["lockstep", "ev_driveline", "-s", "tip_out"],
    "replay": ["replay", "estimator", TRACE, "--map", "reference_trace"],
    "fmu": ["fmu", "estimator", "--out", "out/estimator.fmu"],
    "diff": ["diff", "HEAD:spinner", "spinner"],
    "diagnose": [*DIAGNOSE, "--out", "out/found"],
}
"""Commands that compile or extract files into a temporary folder."""
LONGEST_SECONDS = 120.0
"""Time limit of a command."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A user's project under Git with an empty cache and an empty folder of temporary files."""
    made = write_project(tmp_path / "project")
    shutil.copytree(STUDIES / "spec", made / "spec", dirs_exist_ok=True)
    name = ["-c", "user.name=a", "-c", "user.email=a@b.c"]
    for words in (["init", "-q"], ["add", "spec"], [*name, "commit", "-q", "-m", "first"]):
        subprocess.run(["git", *words], cwd=made, check=True)
    for inner in ("out", "tmp"):
        (made / inner).mkdir()
    (made / "cache").mkdir(mode=0o700)
    return made


def start(folder: Path, command: list[str | Path]) -> subprocess.Popen[str]:
    environment = {
        **os.environ,
        "TMPDIR": str(folder / "tmp"),
        "MODEWRIGHT_CACHE": str(folder / "cache"),
    }
    words = [sys.executable, "-m", "modewright", *map(str, command)]
    return subprocess.Popen(words, cwd=folder, env=environment, stderr=subprocess.PIPE, text=True)


def wait_until_file(folder: Path, process: subprocess.Popen[str]) -> None:
    """Wait until there is a file below a folder."""
    deadline = time.monotonic() + LONGEST_SECONDS
    while not any(path.is_file() for path in folder.rglob("*")):
        assert process.poll() is None and time.monotonic() < deadline
        time.sleep(0.002)


@pytest.mark.parametrize("name", COMMANDS)
def test_sigterm_leaves_no_temporary_file(folder: Path, name: str) -> None:
    process = start(folder, COMMANDS[name])
    wait_until_file(folder / "tmp", process)
    process.send_signal(signal.SIGTERM)
    process.send_signal(signal.SIGTERM)  # `timeout` sends it twice
    _, message = process.communicate(timeout=LONGEST_SECONDS)
    assert process.returncode == 143, message
    assert "Traceback" not in message and "defect" not in message
    assert list((folder / "tmp").iterdir()) == []
    files = [path.name for path in (folder / "out").rglob("*") if path.is_file()]
    assert not [file for file in files if file.startswith(".")]
    if name != "diagnose":  # it goes on from the files that it has
        assert files == []


def test_sighup_of_a_closed_terminal_does_the_same(folder: Path) -> None:
    process = start(folder, COMMANDS["fmu"])
    wait_until_file(folder / "tmp", process)
    process.send_signal(signal.SIGHUP)
    process.communicate(timeout=LONGEST_SECONDS)
    assert process.returncode == 129
    assert list((folder / "tmp").iterdir()) == list((folder / "out").iterdir()) == []


def test_a_study_that_gets_sigterm_goes_on_later(folder: Path) -> None:
    command: list[str | Path] = ["sweep", "alone", "--out", "out/results", "--workers", "2"]
    process = start(folder, command)
    wait_until_file(folder / "out", process)
    process.send_signal(signal.SIGTERM)
    _, message = process.communicate(timeout=LONGEST_SECONDS)
    assert process.returncode == 143, message
    files = [path.name for path in (folder / "out").rglob("*") if path.is_file()]
    assert not [file for file in files if file.endswith(".part")]
    again = start(folder, command)
    again.communicate(timeout=LONGEST_SECONDS)
    assert again.returncode == 0
