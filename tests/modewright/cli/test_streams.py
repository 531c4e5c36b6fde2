"""Streams: outputs that nobody reads, that are closed or full."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


def shell(line: str) -> subprocess.CompletedProcess[str]:
    command = f"{sys.executable} -m modewright"
    return subprocess.run(
        ["bash", "-c", f"set -o pipefail; {line}".replace("modewright", command, 1)],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("modewright explain driveline | head -1 > /dev/null", 0),
        ("modewright explain driveline >&-", 0),
        ("modewright check tip_out >&-", 0),
        ("modewright check tip_out 2>&-", 0),
    ],
)
def test_output_that_nobody_reads_is_no_failure(line: str, code: int) -> None:
    done = shell(line)
    assert (done.returncode, done.stderr) == (code, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_log_that_cannot_be_written_is_one_warning() -> None:
    done = shell("modewright --log-file /dev/full simulate ev_driveline -s tip_out")
    warning = "warning: the log /dev/full is incomplete: No space left on device\n"
    assert (done.returncode, done.stderr) == (0, warning)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
def test_a_full_disk_is_told_in_one_line() -> None:
    done = shell("modewright explain driveline > /dev/full")
    assert (done.returncode, done.stderr) == (1, "error: No space left on device\n")


def test_a_name_that_is_too_long_is_told_in_one_line(tmp_path: Path) -> None:
    done = shell(f"modewright simulate ev_driveline -s tip_out --out {tmp_path}/{'x' * 300}.csv")
    assert done.returncode == 1
    assert len(done.stderr) < 300 and "File name too long" in done.stderr
    assert list(tmp_path.iterdir()) == []
