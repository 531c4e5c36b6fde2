"""Files that a user names: regular ones are opened, all others are refused at once."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from language.text.diagnostic import SpecError
from language.text.document import read_text
from language.text.regular_file import (
    NOT_REGULAR,
    open_lock_file,
    open_regular_file,
    read_regular_bytes,
)


def make_folder(path: Path) -> None:
    path.mkdir()


def make_pipe(path: Path) -> None:
    os.mkfifo(path)


def make_link_to_a_device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def make_socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(os.path.relpath(path))


OTHERS = (make_folder, make_pipe, make_link_to_a_device, make_socket)


@pytest.fixture(autouse=True)
def _in_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # the path of a socket has at most 108 characters


@pytest.mark.parametrize("make", OTHERS)
def test_what_is_no_regular_file_is_refused_at_once(
    tmp_path: Path, make: Callable[[Path], None]
) -> None:
    path = tmp_path / "file.yaml"
    make(path)
    with pytest.raises(OSError, match=NOT_REGULAR):
        open_regular_file(path)
    with pytest.raises(SpecError) as caught:
        read_text(path)
    assert NOT_REGULAR in caught.value.problems[0].label


def test_a_link_to_a_regular_file_is_followed(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"content")
    (tmp_path / "link").symlink_to(tmp_path / "file")
    assert read_regular_bytes(tmp_path / "link") == b"content"
    assert read_regular_bytes(tmp_path / "link", 3) == b"con"


def test_a_missing_file_is_an_os_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        open_regular_file(tmp_path / "file")


def test_a_lock_file_is_created_and_keeps_its_content(tmp_path: Path) -> None:
    path = tmp_path / ".lock"
    open_lock_file(path).close()
    path.write_bytes(b"content")
    open_lock_file(path).close()
    assert path.read_bytes() == b"content"


def test_a_lock_file_is_no_link_pipe_or_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"content")
    (tmp_path / "link").symlink_to(tmp_path / "file")
    os.mkfifo(tmp_path / "pipe")
    for name in ("link", "pipe", "."):
        with pytest.raises(OSError):
            open_lock_file(tmp_path / name)
    assert (tmp_path / "file").read_bytes() == b"content"
