"""The comparison of fixed cases with their stored verdicts."""

from __future__ import annotations

from tests.validation.study.case_score import Answer
from tests.validation.study.regression_cases import compare_verdicts, verdict_of

VERDICT = {
    "verdict": "effect",
    "effects": [{"id": "drag", "place": "w_w"}],
    "ambiguous_with": [{"id": "friction", "place": "w_w"}],
    "location": {"places": ["w_w", "w_em", "theta"]},
}
LABEL = {"effects": [{"id": "drag", "place": "w_w"}]}


def test_a_verdict_that_differs_from_the_stored_one_is_reported() -> None:
    found = verdict_of(Answer("g", "full", "c1", LABEL, VERDICT, 1.0))
    assert found["effects"] == ["drag@w_w"]
    assert found["places"] == ["w_w", "w_em"]
    assert compare_verdicts({"g c1": found}, {"g c1": found}) == []
    other = verdict_of(Answer("g", "full", "c1", LABEL, {**VERDICT, "verdict": "unknown"}, 1.0))
    (line,) = compare_verdicts({"g c1": found}, {"g c1": other})
    assert line.startswith("g c1: stored")
    assert len(compare_verdicts({"g c1": found}, {})) == 1
