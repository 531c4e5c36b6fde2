"""Setting up takes the first Python on PATH, and of its version the build that is quick."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "tools" / "find_python.sh"
TOOLS = "/usr/bin:/bin"


def build(folder: Path, *says: object, code: int = 0) -> Path:
    """Make a `python3` that says its version, what it took and its path."""
    folder.mkdir()
    made = folder / "python3"
    made.write_text(f"#!/bin/sh\necho {' '.join(map(str, says))}\nexit {code}\n")
    made.chmod(0o755)
    return made


def found(*folders: Path, asked: str = "") -> subprocess.CompletedProcess[str]:
    path = ":".join([*map(str, folders), TOOLS])
    command = ["/bin/sh", str(SCRIPT), *([asked] if asked else [])]
    return subprocess.run(command, env={"PATH": path}, capture_output=True, text=True)


@pytest.mark.parametrize(("took", "wanted"), [(0.012, "/one"), (0.016, "/other")])
def test_a_build_that_is_slower_by_a_quarter_is_not_taken(
    tmp_path: Path, took: float, wanted: str
) -> None:
    build(tmp_path / "a", "3.99", took, "/one")
    build(tmp_path / "b", "3.99", 0.01, "/other")
    assert found(tmp_path / "a", tmp_path / "b").stdout.strip() == wanted


def test_another_version_is_not_taken_for_its_speed(tmp_path: Path) -> None:
    build(tmp_path / "a", "3.98", 0.05, "/first here")
    build(tmp_path / "b", "3.99", 0.01, "/other")
    assert found(tmp_path / "a", tmp_path / "b").stdout.strip() == "/first here"


def test_one_that_is_too_old_or_broken_is_passed_over(tmp_path: Path) -> None:
    build(tmp_path / "a", code=1)
    build(tmp_path / "b", "3.99", 0.01, "/other")
    assert found(tmp_path / "a", tmp_path / "b").stdout.strip() == "/other"


def test_the_one_that_is_asked_for_is_taken(tmp_path: Path) -> None:
    slow = build(tmp_path / "a", "3.99", 0.09, "/slow")
    build(tmp_path / "b", "3.99", 0.01, "/quick")
    assert found(tmp_path / "b", asked=str(slow)).stdout.strip() == "/slow"


def test_without_one_it_is_told_what_to_do(tmp_path: Path) -> None:
    tools = tmp_path / "tools"
    tools.mkdir()
    for name in ("awk", "cut"):
        (tools / name).symlink_to(Path("/usr/bin") / name)
    command = ["/bin/sh", str(SCRIPT)]
    told = subprocess.run(command, env={"PATH": str(tools)}, capture_output=True, text=True)
    assert told.returncode == 3
    assert told.stderr == "no Python 3.11 or newer on PATH: try make PYTHON=/path/to/python3\n"
