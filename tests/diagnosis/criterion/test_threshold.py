"""Thresholds: one for each group of effects, and the usual one for the others; as a file."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from diagnosis.criterion.threshold import (
    DEFAULT_THRESHOLD,
    DEFAULT_THRESHOLDS,
    FORMAT,
    Thresholds,
    format_thresholds,
    read_thresholds,
)
from diagnosis.model.placed_effect import shipped_effects
from tests.diagnosis.selection.fake_fits import places_of, rotor_model_set


def test_an_effect_has_the_threshold_of_its_group() -> None:
    first, second = places_of(rotor_model_set(), shipped_effects(), 2)
    given = Thresholds({first.effect.name: 31.0}, 12.0)
    assert given.threshold_of(first) == 31.0
    assert given.threshold_of(second) == 12.0
    assert DEFAULT_THRESHOLDS.threshold_of(first) == DEFAULT_THRESHOLD


@pytest.mark.parametrize(
    ("groups", "text"),
    [
        ({}, "20"),
        ({"a": 61.2}, "20 to 61"),
        ({"a": 5.0, "b": 20.4}, "5 to 20"),
        ({"a": 20.2}, "20"),
    ],
)
def test_thresholds_are_told_with_their_ends(groups: dict[str, float], text: str) -> None:
    assert Thresholds(groups, 20.0).text == text


def test_a_file_gives_the_thresholds_that_were_written(tmp_path: Path) -> None:
    given = Thresholds({"backlash": 31.5, "drag": 8.0}, 12.25, "those of a test")
    path = tmp_path / "thresholds.json"
    path.write_text(format_thresholds(given), "utf-8")
    assert read_thresholds(path) == given


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{", "cannot be read as thresholds"),
        ("[]", f"its format is not {FORMAT}"),
        ('{"format": "other/1"}', f"its format is not {FORMAT}"),
        (f'{{"format": "{FORMAT}", "usual": 0}}', "a number of nats above 0"),
        (f'{{"format": "{FORMAT}", "effects": {{"a": true}}}}', "a number of nats above 0"),
        (f'{{"format": "{FORMAT}", "effects": [1]}}', "a number of nats above 0"),
    ],
)
def test_a_file_without_thresholds_is_refused(text: str, told: str, tmp_path: Path) -> None:
    path = tmp_path / "thresholds.json"
    path.write_text(text, "utf-8")
    with pytest.raises(ValueError, match=told):
        read_thresholds(path)


def test_a_pipe_holds_no_thresholds(tmp_path: Path) -> None:
    path = tmp_path / "thresholds.json"
    os.mkfifo(path)
    with pytest.raises(ValueError, match="cannot be read as thresholds"):
        read_thresholds(path)
