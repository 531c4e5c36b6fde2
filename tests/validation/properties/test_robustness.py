"""The study of robustness draws the same pairs again, and knows a failure from a reason."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.validation.properties.recording_corruption import CORRUPTIONS
from tests.validation.properties.robustness import (
    JSON_OUTPUT,
    Outcome,
    Pair,
    draw_pair,
    find_failures,
    summarise,
)

PAIR = Pair(0, "emps", "none", "check", ("recording", "check"), {})
JSON_PAIR = Pair(0, "emps", "none", "check", ("recording", "check", JSON_OUTPUT), {})


def test_a_pair_is_the_same_again_and_has_the_corruption_of_its_number() -> None:
    number = next(k for k, one in enumerate(CORRUPTIONS) if one.__name__ == "empty_file")
    pair = draw_pair(7, number)
    assert pair == draw_pair(7, number)
    assert pair.files == draw_pair(7, number).files
    assert pair.corruption == "empty_file"
    assert pair.files != draw_pair(8, number).files


@pytest.mark.parametrize(
    ("code", "output", "errors", "kind"),
    [
        (0, "misfit: w nan %", "", "word"),
        (0, "base fitted: inf nats", "", "word"),
        (0, "the place is None", "", "word"),
        (1, "", "", "silent"),
        (2, "", "Invalid value: shapes do not fit", "exit code"),
        (-11, "", "", "exit code"),
        (0, "", "x.py:3: RuntimeWarning: divide by zero", "warning"),
        (1, "", "Traceback (most recent call last):\nKeyError: 3", "traceback"),
    ],
)
def test_a_failure_is_seen(tmp_path: Path, code: int, output: str, errors: str, kind: str) -> None:
    found = list(find_failures(PAIR, tmp_path, code, output, errors))
    assert kind in [one.partition(":")[0] for one in found]


@pytest.mark.parametrize(
    ("code", "errors"),
    [
        (1, "a.csv:3:5: error: `nan` in column `v` is not a finite number\n    0.1,nan,3"),
        (1, "error: none of the information is used"),
        (2, "Invalid value: a.csv is named twice: each recording counts once"),
    ],
)
def test_a_reason_is_no_failure(tmp_path: Path, code: int, errors: str) -> None:
    assert list(find_failures(PAIR, tmp_path, code, "", errors)) == []


def test_json_is_strict(tmp_path: Path) -> None:
    found = list(find_failures(JSON_PAIR, tmp_path, 0, '{"noise": NaN}', ""))
    assert found[0] == "json: stdout has NaN"
    assert list(find_failures(JSON_PAIR, tmp_path, 0, '{"noise": null}', "")) == []
    assert "json" in next(find_failures(JSON_PAIR, tmp_path, 0, '{"noise":', ""))


def test_a_summary_counts_failures_by_kind() -> None:
    outcomes = [
        Outcome(0, "emps", "none", "fit", 0, (), 1.0, 2.0),
        Outcome(1, "emps", "none", "fit", 4, ("defect: a", "word: b"), 1.0, 3.0),
    ]
    facts = summarise(outcomes)
    assert (facts["pairs"], facts["failed"], facts["longest_s"]) == (2, 1, 3.0)
    assert facts["kinds"] == {"defect": 1, "word": 1}
