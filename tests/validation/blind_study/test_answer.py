"""Answers and bars, from verdicts written by hand."""

from __future__ import annotations

import random
from typing import Any

import pytest

from tests.validation.blind_study.acceptance_criteria import bars
from tests.validation.blind_study.case_score import Answer
from tests.validation.blind_study.negative_control import permutation_score

PLACES = {"actuator_lag": "inputs.T_em", "tyre_slip": "elements.vehicle", "road_grade": "flow.w_w"}


def label(*effects: str) -> dict[str, Any]:
    return {
        "effects": [{"id": name, "place": PLACES[name]} for name in effects],
        "rate_Hz": 100,
        "base": {"J_em": 0.05, "k": 6000.0},
    }


def verdict(*effects: str, says: str = "effect", place: str = "", **more: Any) -> dict[str, Any]:
    return {
        "verdict": says,
        "effects": [{"id": name, "place": PLACES[name]} for name in effects],
        "candidates": [{"id": name, "probability": 0.95} for name in effects],
        "ambiguous_with": [],
        "location": {"places": [place or PLACES[name] for name in effects]},
        "fit": {"held_out": {"w": {"nrmse_before": 0.5, "nrmse_after": 0.1}}},
        "base": {"k": {"after": {"value": 6120.0}}},
        **more,
    }


def answer(
    true: tuple[str, ...], said: dict[str, Any], plan: str = "full", cpu_s: float = 8.0
) -> Answer:
    return Answer("case", plan, label(*true), said, cpu_s)


def test_a_name_is_the_first_of_a_verdict_that_is_an_effect() -> None:
    right = answer(("tyre_slip",), verdict("tyre_slip"))
    assert right.is_named and right.is_placed() and right.probability == 0.95
    (error,) = right.base_errors
    assert error == pytest.approx(0.02)
    assert (right.misfit("before"), right.misfit("after")) == (0.5, 0.1)
    second = answer(("tyre_slip",), verdict("road_grade", "tyre_slip"))
    assert not second.is_named
    assert second.is_stated and not second.is_placed() and second.is_placed(2)


def test_ambiguous_counts_as_not_named_but_states_a_set() -> None:
    both = [{"id": "tyre_slip", "place": "x"}, {"id": "road_grade", "place": "y"}]
    said = verdict(says="ambiguous", ambiguous_with=both)
    found = answer(("tyre_slip",), said)
    assert not found.is_named and found.is_stated and found.said == "ambiguous"
    assert len(found.stated) == 2 and found.probability is None


def test_no_verdict_is_a_failure_and_an_alarm() -> None:
    failed = answer((), {}, "clean")
    assert failed.said == "failed" and failed.is_alarm and not failed.is_named
    assert not answer((), verdict(says="nothing_missing"), "clean").is_alarm


def test_bars_count_what_they_say() -> None:
    found = {
        bar.about: bar
        for bar in bars(
            [
                answer(("tyre_slip",), verdict("tyre_slip")),
                answer(("road_grade",), verdict("tyre_slip")),
                answer((), verdict(says="nothing_missing"), "clean"),
                answer((), verdict("tyre_slip"), "clean"),
                answer(("road_grade", "tyre_slip"), verdict("tyre_slip", "road_grade"), "pairs"),
                answer(("road_grade",), verdict("tyre_slip"), "removed"),
            ]
        )
    }
    assert found["first name right"].measured == 0.5
    assert not found["first name right"].met
    assert found["first name right, lowest rate of an effect (road_grade)"].measured == 0.0
    assert found["names with probability >= 0.9 that are right"].measured == 0.5
    assert found["expected calibration error of the probabilities"].measured == pytest.approx(0.45)
    assert found["false alarms"].measured == 0.5
    assert found["two effects: both named"].met
    assert not found["effect not in the library: wrong name with probability >= 0.9"].met
    reduction = found["reduction of held-out NRMSE, median of right names"]
    assert reduction.measured == pytest.approx(0.8)


def test_the_time_of_a_case_is_that_of_cases_with_and_without_an_effect() -> None:
    said = verdict("tyre_slip")
    effects = [answer(("tyre_slip",), said, cpu_s=took) for took in (9.0, 13.0, 40.0)]
    clean = [answer((), verdict(says="nothing_missing"), "clean", cpu_s=4.0)] * 2
    others = [answer(("tyre_slip",), said, "weak", cpu_s=90.0)] * 5
    (cost,) = (
        bar for bar in bars([*effects, *clean, *others]) if bar.about.startswith("processor time")
    )
    assert (cost.measured, cost.met) == (9.0, True)
    assert cost.text == "9.0 (13.0 with an effect, 4.0 without)"


def test_permuted_labels_fall_to_chance() -> None:
    names = list(PLACES)
    every = [answer((name,), verdict(name)) for name in names * 200]
    share = permutation_score(every, random.Random(1))
    assert share == pytest.approx(1 / len(names), abs=0.05)
