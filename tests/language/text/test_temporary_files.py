"""No temporary file or folder is left over, whenever a signal arrives."""

from __future__ import annotations

import errno
import os
import signal
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from language.text.temporary_files import (
    POSTPONED_SIGNALS,
    postpone_signals,
    temporary_folder,
    write_atomically,
)


class EndedError(BaseException):
    """Raised by the handler of each signal."""


@pytest.fixture(autouse=True)
def _raising_handlers() -> Iterator[None]:
    def end(number: int, _frame: object) -> None:
        raise EndedError(number)

    before = {number: signal.signal(number, end) for number in POSTPONED_SIGNALS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", POSTPONED_SIGNALS)
def test_a_signal_is_raised_at_the_end_of_the_context(number: int) -> None:
    done = []
    with pytest.raises(EndedError), postpone_signals():
        os.kill(os.getpid(), number)
        os.kill(os.getpid(), number)
        done.append("all")
    assert done == ["all"]
    with pytest.raises(EndedError):
        os.kill(os.getpid(), number)


def test_an_ignored_signal_stays_ignored() -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    with postpone_signals():
        os.kill(os.getpid(), signal.SIGTERM)
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN


def test_another_thread_may_write(tmp_path: Path) -> None:
    thread = threading.Thread(target=write_atomically, args=(tmp_path / "a", b"a"))
    thread.start()
    thread.join()
    assert (tmp_path / "a").read_bytes() == b"a"


@pytest.mark.parametrize("step", ["mkstemp", "fdopen", "chmod", "replace"])
def test_a_signal_at_any_step_leaves_the_whole_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    module = tempfile if step == "mkstemp" else os
    act = getattr(module, step)

    def interrupted(*given: object, **named: object) -> object:
        result = act(*given, **named)
        os.kill(os.getpid(), signal.SIGTERM)
        return result

    monkeypatch.setattr(module, step, interrupted)
    with pytest.raises(EndedError):
        write_atomically(tmp_path / "a", b"new", 0o640)
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a").read_bytes() == b"new"
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt])
def test_an_error_leaves_no_temporary_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: type[BaseException]
) -> None:
    def fail(*_: object) -> None:
        raise error

    (tmp_path / "a").write_bytes(b"old")
    monkeypatch.setattr("language.text.temporary_files.os.replace", fail)
    with pytest.raises(error):
        write_atomically(tmp_path / "a", b"new")
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
    assert (tmp_path / "a").read_bytes() == b"old"


STEPS = ("mkdtemp", "body", "cleanup")


@pytest.mark.parametrize("step", STEPS)
def test_a_signal_at_any_step_leaves_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    steps = {"mkdtemp": (tempfile, "mkdtemp"), "cleanup": (tempfile.TemporaryDirectory, "cleanup")}

    def interrupted(*given: Any, **named: Any) -> object:
        os.kill(os.getpid(), signal.SIGTERM)
        result = act(*given, **named)
        os.kill(os.getpid(), signal.SIGTERM)
        return result

    if step in steps:
        act = getattr(*steps[step])
        monkeypatch.setattr(*steps[step], interrupted)
    with pytest.raises(EndedError), temporary_folder() as folder:
        (folder / "inner").mkdir()
        (folder / "inner" / "file").write_text("a")
        if step == "body":
            os.kill(os.getpid(), signal.SIGTERM)
    assert list(tmp_path.iterdir()) == []


def test_without_any_folder_for_temporary_files_the_user_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setattr(tempfile, "_candidate_tempdir_list", lambda: ["/proc/nowhere"])
    with pytest.raises(OSError, match="free space, or set TMPDIR") as caught, temporary_folder():
        pass
    assert caught.value.errno == errno.ENOSPC
