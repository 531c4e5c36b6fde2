"""Scores of cases, from labels and verdicts written by hand."""

from __future__ import annotations

from typing import Any

import pytest

from tests.validation.study.accepted_names import relatives_of, right_names
from tests.validation.study.case_score import Answer
from tests.validation.study.figures import FIGURES, Figure, Measured, measure

PLACES = {
    "actuator_lag": "inputs.T_em", "actuator_delay": "inputs.T_em", "tyre_slip": "elements.vehicle",
    "road_grade": "flow.w_w", "coulomb_friction": "flow.w_em", "stribeck_friction": "flow.w_em",
}  # fmt: skip


def verdict(
    *effects: str,
    says: str = "effect",
    place: str = "",
    probability: float = 0.95,
    after: float = 0.1,
) -> dict[str, Any]:
    named = [{"id": name, "place": PLACES[name]} for name in effects]
    return {
        "verdict": says,
        "effects": named if says == "effect" else [],
        "candidates": [{**one, "probability": probability} for one in named],
        "ambiguous_with": named if says == "ambiguous" else [],
        "location": {"places": [place or PLACES[name] for name in effects] or [place]},
        "fit": {"held_out": {"w": {"nrmse_before": 0.5, "nrmse_after": after}}},
    }


def answer(
    true: tuple[str, ...],
    said: dict[str, Any],
    group: str = "full",
    generator: str = "one",
    **more: Any,
) -> Answer:
    label = {"effects": [{"id": name, "place": PLACES[name]} for name in true], **more}
    return Answer(generator, group, "case", label, said, 8.0)


def figure(about: str) -> Figure:
    (found,) = (one for one in FIGURES if one.about == about)
    return found


def measured(about: str, *answers: Answer, is_strict: bool = False) -> Measured:
    return measure(figure(about), answers, is_strict)


def test_a_name_is_right_if_the_first_one_is_an_effect_of_the_case() -> None:
    right = answer(("tyre_slip",), verdict("tyre_slip"))
    assert right.is_named() and right.is_placed and right.probability == 0.95
    assert right.removed_misfit == pytest.approx(0.8)
    second = answer(("tyre_slip",), verdict("road_grade", "tyre_slip"))
    assert not second.is_named()
    assert second.is_stated() and not second.is_placed


def test_the_first_name_of_an_ambiguous_verdict_is_the_first_of_its_set() -> None:
    found = answer(("tyre_slip",), verdict("tyre_slip", "road_grade", says="ambiguous"))
    assert found.is_named() and not found.is_alone_named() and found.said == "ambiguous"
    assert found.stated == ("tyre_slip", "road_grade")
    second = answer(("tyre_slip",), verdict("road_grade", "tyre_slip", says="ambiguous"))
    assert not second.is_named() and second.is_stated()


def test_a_verdict_that_nothing_explains_has_no_first_name() -> None:
    unknown = answer(("tyre_slip",), verdict(says="unknown"))
    assert not unknown.is_named() and not unknown.is_alone_named() and unknown.first == ""


def test_no_verdict_is_an_alarm() -> None:
    failed = answer((), {}, "clean")
    assert failed.is_alarm and not failed.is_named() and failed.removed_misfit == 0.0
    assert not answer((), verdict(says="nothing_missing"), "clean").is_alarm


def test_accepted_names_are_right_unless_the_score_is_strict() -> None:
    given = ("coulomb_friction",), verdict("stribeck_friction"), "full"
    assert answer(*given, "driveline_b").is_named()
    assert not answer(*given, "driveline_b").is_named(is_strict=True)
    assert not answer(*given, "open_cases").is_named()
    both = verdict("stribeck_friction", "coulomb_friction", says="ambiguous")
    assert answer(given[0], both, "full", "driveline_b").is_named()
    assert not answer(given[0], both, "full", "driveline_b").is_named(is_strict=True)
    assert right_names("open_cases", "tyre_slip") == {"tyre_slip"}


def test_unknown_and_uncertain_relatives_count_if_the_effect_is_removed() -> None:
    true = ("actuator_lag",)
    unknown = answer(true, verdict(says="unknown", place="inputs.T_em"), "removed")
    assert unknown.is_unknown() and unknown.is_unknown(is_strict=True)
    assert not answer(true, verdict(says="unknown", place="flow.w_w"), "removed").is_unknown()
    relative = answer(true, verdict("actuator_delay", probability=0.7), "removed")
    assert relative.is_unknown() and not relative.is_unknown(is_strict=True)
    assert not answer(true, verdict("actuator_delay"), "removed").is_unknown()
    assert not answer(true, verdict("tyre_slip", probability=0.5), "removed").is_unknown()
    assert "stribeck_friction" in relatives_of(["coulomb_friction"])
    assert "coulomb_friction" not in relatives_of(["coulomb_friction"])


def test_generators_have_the_same_weight() -> None:
    right, wrong = verdict("tyre_slip"), verdict("road_grade")
    many = [answer(("tyre_slip",), right) for _ in range(30)]
    few = [answer(("tyre_slip",), said, generator="other") for said in (right, wrong)]
    found = measured("first name right", *many, *few)
    assert found.mean == 0.75 and found.by_generator == {"one": 1.0, "other": 0.5}
    assert 0.5 <= found.low < 0.75 < found.high <= 1.0
    assert found.text_of("one") == "100.0 %" and found.text_of("third") == ""
    assert measured("false alarms", *many).mean_text == ""


def test_figures_count_the_cases_of_their_groups() -> None:
    some = (
        answer(("tyre_slip",), verdict("tyre_slip")),
        answer(("road_grade",), verdict("tyre_slip", after=0.6)),
        answer((), verdict(says="nothing_missing", after=0.5), "clean"),
        answer((), verdict("tyre_slip"), "clean"),
        answer(("road_grade", "tyre_slip"), verdict("tyre_slip", "road_grade"), "pairs"),
    )
    assert measured("first name right", *some).mean == 0.5
    assert measured("false alarms", *some).mean == 0.5
    assert measured("two effects: both named", *some).mean == 1.0
    sure = measured("names with a probability >= 0.9 that are right", *some)
    assert sure.mean == pytest.approx(1 / 3)
    assert measured("held-out misfit larger than before", *some).mean == pytest.approx(0.2)
    assert measured("no verdict", *some, answer((), {}, "clean")).mean == pytest.approx(1 / 6)


def test_weak_effects_that_are_not_visible_do_not_count() -> None:
    weak = [
        answer(
            ("tyre_slip",),
            verdict(says="nothing_missing"),
            "weak",
            visibility={"w": {"refit": 0.5}},
        ),
        answer(("tyre_slip",), verdict("tyre_slip"), "weak", visibility={"w": {"refit": 4.0}}),
        answer(("tyre_slip",), verdict("tyre_slip"), "weak"),
    ]
    assert measured("0.3 x strength: first name right", *weak).mean == 1.0
