"""Refused: each spec here has mistakes; the text beside it is exactly what the user is told."""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
SPECS = sorted(HERE.glob("*.yaml"))


@pytest.mark.parametrize("spec", SPECS, ids=lambda path: path.stem)
def test_the_user_is_told_exactly_this(
    spec: Path, monkeypatch: pytest.MonkeyPatch, update: bool
) -> None:
    monkeypatch.chdir(ROOT)
    text = mw.render_all(mw.check(str(spec.relative_to(ROOT)))) + "\n"
    expected = spec.with_suffix(".txt")
    if update:
        expected.write_text(text)
    assert text == expected.read_text()
    assert ": error: " in text


def test_no_expected_text_is_left_over() -> None:
    assert {path.stem for path in HERE.glob("*.txt")} == {path.stem for path in SPECS}
