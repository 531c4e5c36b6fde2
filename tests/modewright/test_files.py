"""Files are written whole or not at all, whenever the writer is killed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from modewright.files import OutputError, write_files

KILLED = """
import os, signal, sys
from pathlib import Path
from modewright import files

count = int(sys.argv[2])
replace, write = os.replace, os.fdopen

def counted(act):
    def acting(*arguments, **named):
        global count
        count -= 1
        if count < 0:
            os.kill(os.getpid(), signal.SIGKILL)
        return act(*arguments, **named)
    return acting

os.replace, os.fdopen = counted(replace), counted(write)
folder = Path(sys.argv[1])
files.write_files({folder / name: name.encode() * 100_000 for name in "abc"})
"""
"""Writes three files, and is killed before the n-th of six steps: three written, three renamed."""


@pytest.mark.parametrize("step", range(7))
def test_a_killed_writer_leaves_no_half_of_a_file(tmp_path: Path, step: int) -> None:
    words = [sys.executable, "-c", KILLED, str(tmp_path), str(step)]
    done = subprocess.run(words, check=False, timeout=60)
    assert done.returncode == (0 if step == 6 else -9)
    there = {name: (tmp_path / name) for name in "abc" if (tmp_path / name).exists()}
    assert list(there) == list("abc")[: max(0, step - 3)]  # in their order: the last tells of all
    for name, path in there.items():
        assert path.read_bytes() == name.encode() * 100_000


def test_one_that_cannot_be_written_leaves_none(tmp_path: Path) -> None:
    with pytest.raises(OutputError):
        write_files({tmp_path / "a": b"a", tmp_path / "no" / "b": b"b"})
    assert list(tmp_path.iterdir()) == []
