"""What is told of long work: lines where there is no terminal, none too often."""

from __future__ import annotations

import re

import pytest

from modewright.cli.common import console


@pytest.mark.parametrize(("every", "lines"), [(0.0, 3), (1000.0, 0)])
def test_a_log_is_told_now_and_then_how_far_a_work_is(
    every: float,
    lines: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(console, "REPORT_INTERVAL", every)
    with console.progress_bar("sweep tip_outs", "variants") as tell:
        for done in (10, 20, 30):
            tell(done, 5, 200)
    told = capsys.readouterr().err.splitlines()
    assert len(told) == lines
    for line, done in zip(told, (10, 20, 30), strict=False):
        assert re.fullmatch(rf"sweep tip_outs: {done} of 200 variants, \S+ variants/s", line)
