"""Ctrl-C interrupts once; how the work ends is not disturbed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

from modewright.cli.common import interruption
from modewright.cli.common.interruption import (
    TERMINATION_SIGNALS,
    convert_signals,
    debounce_interrupts,
)

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


@pytest.fixture(autouse=True)
def _as_python_takes_it() -> Iterator[None]:
    """A shell has its background jobs ignore Ctrl-C, and so does what they start."""
    numbers = (signal.SIGINT, *TERMINATION_SIGNALS)
    before = {number: signal.getsignal(number) for number in numbers}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in TERMINATION_SIGNALS:
        signal.signal(number, signal.SIG_DFL)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def press(number: int = signal.SIGINT) -> None:
    os.kill(os.getpid(), number)


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


@pytest.mark.parametrize("number", TERMINATION_SIGNALS)
def test_a_signal_to_end_is_one_interrupt_with_its_exit_code(number: int) -> None:
    ended = []
    with pytest.raises(KeyboardInterrupt), convert_signals() as received:
        assert received.exit_code == 0
        try:
            press(number)
        finally:
            for _ in range(5):
                press(number)
                press(signal.SIGTERM)
            ended.append("as it should")
    assert ended == ["as it should"]
    assert received.exit_code == 128 + number
    press(number)


ENDED_IN_EXEC = """
import os, signal, sys
from modewright.cli.common.interruption import convert_signals
with convert_signals() as received:
    try:
        exec("os.kill(os.getpid(), signal.SIGTERM); import time; time.sleep(60)")
    except KeyboardInterrupt:
        pass
sys.exit(received.exit_code)
"""


def test_an_interrupt_in_exec_keeps_the_exit_code() -> None:
    assert subprocess.run([sys.executable, "-c", ENDED_IN_EXEC], check=False).returncode == 143


def test_the_signals_are_ignored_during_the_exit() -> None:
    with convert_signals() as received:
        assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
    press(signal.SIGTERM)
    assert received.exit_code == 0


def test_a_signal_that_the_process_ignores_stays_ignored() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with convert_signals() as received:
        press(signal.SIGHUP)
    assert received.exit_code == 0
