"""Ctrl-C interrupts once; how the work ends is not disturbed."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator

import pytest

from modewright.cli.common import interruption
from modewright.cli.common.interruption import debounce_interrupts

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


@pytest.fixture(autouse=True)
def _as_python_takes_it() -> Iterator[None]:
    """A shell has its background jobs ignore Ctrl-C, and so does what they start."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def press() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def test_six_interruptions_are_one() -> None:
    ended = []
    with debounce_interrupts(), pytest.raises(KeyboardInterrupt):
        try:
            press()
        finally:
            for _ in range(5):
                press()
            ended.append("as it should")
    assert ended == ["as it should"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_work_that_does_not_end_is_interrupted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interruption, "GRACE_PERIOD", 0.0)
    with debounce_interrupts():
        for _ in range(2):
            with pytest.raises(KeyboardInterrupt):
                press()


def test_who_ignores_ctrl_c_or_takes_it_otherwise_is_left_alone() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with debounce_interrupts():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
