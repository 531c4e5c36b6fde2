"""Constants of the decision: collected from the code, and replayed from stored numbers."""

from __future__ import annotations

import math
from typing import Any

import pytest

from diagnosis.criterion import explained_share
from tests.validation.study.calibrate_constants import best_constants
from tests.validation.study.case_score import Answer
from tests.validation.study.decision_constants import decision_constants
from tests.validation.study.decision_replay import (
    MIN_PROBABILITY,
    Constants,
    log_score,
    mean_score,
    use_constants,
    verdict_probabilities,
)


def decision(share: float, energy: float = 50.0, gain: float = 100.0) -> dict[str, Any]:
    candidate = {"id": "tyre_slip", "place": "x", "gain": gain, "share": share, "parameters": 2}
    known = {"energy": energy, "channels": 2, "sampled_energy": 4.0 * gain}
    return {**known, "candidates": [candidate]}


def answer(true: str, group: str, found: dict[str, Any], generator: str = "one") -> Answer:
    effects = [{"id": true, "place": "x"}] if true else []
    return Answer(generator, group, "case", {"effects": effects}, {}, 1.0, found)


def test_the_constants_of_the_criteria_have_reasons() -> None:
    found = {one.name: one for one in decision_constants()}
    assert found["FORM_ERROR"].value == explained_share.FORM_ERROR
    assert all(one.reason.endswith(".") for one in found.values())
    assert all(one.module.startswith("diagnosis/criterion/") for one in found.values())


def test_the_least_share_is_that_of_the_product() -> None:
    least_share = explained_share.least_share
    assert least_share() == pytest.approx(explained_share.MIN_SHARE)
    with use_constants(Constants(form_error=0.5)):
        assert least_share() < explained_share.MIN_SHARE - 0.05
    assert least_share() == pytest.approx(explained_share.MIN_SHARE)


def test_probabilities_follow_the_explained_share() -> None:
    good, poor = (verdict_probabilities(decision(share)) for share in (0.98, 0.3))
    assert sum(good.values()) == pytest.approx(1.0)
    assert good["tyre_slip"] > 0.9 > 0.1 > poor["tyre_slip"]
    assert verdict_probabilities(decision(0.3, energy=0.1)) == {"nothing_missing": 1.0}


def test_scores_are_those_of_what_is_true() -> None:
    assert log_score(answer("tyre_slip", "full", decision(0.98))) > math.log(0.9)
    assert log_score(answer("", "clean", decision(0.3, energy=0.1))) == 0.0
    assert log_score(answer("", "clean", decision(0.98))) == math.log(MIN_PROBABILITY)
    assert log_score(answer("road_grade", "removed", decision(0.3))) > math.log(0.9)


def test_the_best_constants_separate_the_cases() -> None:
    """Effects explain 55 %, other forms 40 %: the error of the form has to be larger."""
    some = [answer("tyre_slip", "full", decision(0.55)) for _ in range(5)]
    some += [answer("road_grade", "removed", decision(0.4)) for _ in range(5)]
    best = best_constants(some)
    before, after = (mean_score(some, one)["one"] for one in (Constants(), best))
    assert best.form_error > explained_share.FORM_ERROR
    assert after > before
