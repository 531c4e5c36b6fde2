"""Commands end with a verdict or a reason for faulty recordings: a sample of the study of these."""

from __future__ import annotations

from pathlib import Path

import pytest

from modewright.cli.app import build_application, expand_arguments
from modewright.cli.common.exit_codes import run_with_exit_code
from tests.validation.properties.robustness import draw_pair, find_failures, write_files

SEED = 1
CHEAP = (2, 7, 10, 15, 17, 18)
"""Pairs that take less than two seconds each."""
LONG = [pytest.param(number, marks=pytest.mark.long) for number in (19, 21, 23, 25, 26)]


@pytest.mark.parametrize("number", [*CHEAP, *LONG])
def test_faulty_recordings_end_with_a_reason(
    number: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pair = draw_pair(SEED, number)
    write_files(pair, tmp_path)
    monkeypatch.chdir(tmp_path)
    arguments = expand_arguments(pair.arguments)
    application = build_application(arguments)
    code = run_with_exit_code(lambda: application(arguments, standalone_mode=False))
    assert code in (0, 1)
    told = capsys.readouterr()
    assert list(find_failures(pair, tmp_path, code, told.out, told.err)) == []
