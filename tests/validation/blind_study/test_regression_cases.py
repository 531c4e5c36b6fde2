"""The comparison of fixed cases with their stored verdicts."""

from __future__ import annotations

import json

from tests.validation.blind_study.case_score import Answer
from tests.validation.blind_study.regression_cases import VERDICTS, compare_verdicts, verdict_of

VERDICT = {
    "verdict": "effect",
    "effects": [{"id": "drag", "place": "w_w"}],
    "ambiguous_with": [{"id": "friction", "place": "w_w"}],
    "location": {"places": ["w_w", "w_em", "theta"]},
}
LABEL = {"effects": [{"id": "drag", "place": "w_w"}]}


def test_a_verdict_that_differs_from_the_stored_one_is_reported() -> None:
    found = verdict_of(Answer("c1", "full", LABEL, VERDICT, 1.0))
    assert found["effects"] == ["drag@w_w"]
    assert found["places"] == ["w_w", "w_em"]
    assert compare_verdicts({"full c1": found}, {"full c1": found}) == []
    other = verdict_of(Answer("c1", "full", LABEL, {**VERDICT, "verdict": "unknown"}, 1.0))
    (line,) = compare_verdicts({"full c1": found}, {"full c1": other})
    assert line.startswith("full c1: stored")
    assert len(compare_verdicts({"full c1": found}, {})) == 1


def test_thirty_verdicts_are_stored() -> None:
    stored = json.loads(VERDICTS.read_text("utf-8"))
    assert len(stored) == 30
    assert sum(verdict["true"] == "none" for verdict in stored.values()) == 4
