"""Files are written whole or not at all, whenever the writer is killed."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from modewright.cli.app import app
from modewright.runtime.output_files import (
    OutputError,
    make_folder,
    require_calibration_output,
    require_separate_outputs,
    require_writable,
    write_files,
)

KILLED = """
import os, signal, sys
from pathlib import Path
from modewright.runtime import output_files as files

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


@pytest.mark.parametrize("step", range(7))
def test_a_writer_that_is_asked_to_end_writes_all_files_first(tmp_path: Path, step: int) -> None:
    ended = KILLED.replace("SIGKILL", "SIGTERM").replace("< 0", "== -1")
    words = [sys.executable, "-c", ended, str(tmp_path), str(step)]
    done = subprocess.run(words, check=False, timeout=60)
    assert done.returncode == (0 if step == 6 else -15)
    assert sorted(path.name for path in tmp_path.iterdir()) == list("abc")


def test_one_that_cannot_be_written_leaves_none(tmp_path: Path) -> None:
    with pytest.raises(OutputError):
        write_files({tmp_path / "a": b"a", tmp_path / "no" / "b": b"b"})
    assert list(tmp_path.iterdir()) == []


def test_a_file_keeps_its_mode_and_a_link_leads_where_it_led(tmp_path: Path) -> None:
    kept, link, new = tmp_path / "kept", tmp_path / "links" / "link", tmp_path / "new"
    link.parent.mkdir()
    kept.write_bytes(b"old")
    kept.chmod(0o600)
    link.symlink_to("../kept")
    require_writable(link, new)
    write_files({link: b"told", new: b"new"})
    assert link.is_symlink() and kept.read_bytes() == b"told"
    assert (kept.stat().st_mode & 0o777, new.stat().st_mode & 0o777) == (0o600, 0o644)
    assert [each.name for each in link.parent.iterdir()] == ["link"]


def test_a_pipe_is_written_to_and_stays(tmp_path: Path) -> None:
    pipe, heard = tmp_path / "pipe", []
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: heard.append(pipe.read_bytes()), daemon=True)
    reader.start()
    require_writable(pipe)
    write_files({pipe: b"told"})
    reader.join(10)
    assert (heard, pipe.is_fifo()) == ([b"told"], True)


def test_an_output_replaces_no_spec(tmp_path: Path) -> None:
    spec, link, fitted = tmp_path / "a.yaml", tmp_path / "out.sarif", tmp_path / "b.yaml"
    spec.write_text("language: 1\nautomaton: a\n")
    fitted.write_text("language: 1\ncalibration: b\n")
    link.symlink_to(spec)
    for path in (spec, link):
        with pytest.raises(OutputError, match="this is a spec"):
            require_writable(path)
    with pytest.raises(OutputError, match="this is no calibration"):
        require_calibration_output(spec)
    require_calibration_output(fitted)
    require_calibration_output(tmp_path / "new.yaml")


def test_a_socket_is_no_place_for_an_output(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind(str(tmp_path / "s"))
        with pytest.raises(OutputError, match="this is a device or a socket"):
            require_writable(tmp_path / "s")


@pytest.mark.parametrize("name", ["loop", "loop/x.csv", "n" * 300, "a\0b"])
def test_a_path_that_cannot_be_followed_is_no_output(name: str, tmp_path: Path) -> None:
    """A loop of links, a name that is too long, and a character that no name may have."""
    (tmp_path / "loop").symlink_to(tmp_path / "back")
    (tmp_path / "back").symlink_to(tmp_path / "loop")
    path = tmp_path / name
    for check in (
        require_writable,
        require_calibration_output,
        make_folder,
        require_separate_outputs,
        lambda path: require_separate_outputs(tmp_path, path),
    ):
        with pytest.raises(OutputError, match=r"links|too long|no name of a file"):
            check(path)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["back", "loop"]


def test_commands_refuse_a_loop_of_links_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop").symlink_to("back")
    (tmp_path / "back").symlink_to("loop")
    (tmp_path / "here.yaml").write_text(
        "language: 1\nautomaton: here\nperiod: 1 ms\nnumbers: float64\n"
    )
    lines = [
        *("schema -o loop", "dbc here.yaml -o loop/x", "a2l here.yaml -o loop"),
        *("generate here.yaml -o loop", "fmu here.yaml -o loop/x.fmu", "--log-file loop schema"),
        *("diff here.yaml here.yaml --html loop", "check here.yaml --sarif loop"),
        *("graph here.yaml -o loop/x.svg", "simulate here.yaml -s none -o loop/x.csv"),
    ]
    for line in lines:
        with pytest.raises(OutputError, match="loop"):
            app(line.split(), standalone_mode=False)
