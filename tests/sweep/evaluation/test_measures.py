"""Measures against numbers derived by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from language.ir.root_region import CHART
from language.loading.mode_entry_event import ModeEntryEvent
from language.text.diagnostic import Source, Span
from sweep.definition.measure import DelayMeasure, EventMeasure, MatchMeasure, SignalMeasure
from sweep.evaluation.evaluate_measures import evaluate_measures
from sweep.evaluation.observed_variant import ModeChange, Observation
from sweep.evaluation.waveform import frequency_by_crossings, frequency_by_spectrum

AT = Span(Source("test"), 1, 1)
PLANT, SEEN = ("plant", CHART), ("est", CHART)
LOST, FOUND = ModeEntryEvent("plant", CHART, "gap"), ModeEntryEvent("est", CHART, "gap")
MS = Fraction(1, 1000)


def make_observation(
    plant: Sequence[tuple[float, str, str]] = (), est: Sequence[tuple[float, str, str]] = (),
    times: Sequence[float] = (), values: Sequence[float] = (),
) -> Observation:  # fmt: skip
    happenings = {
        PLANT: [ModeChange(*each) for each in plant], SEEN: [ModeChange(*each) for each in est],
    }  # fmt: skip
    signals = {"x": np.array(values, dtype=np.float64)}
    return Observation(happenings, np.array(times, dtype=np.float64), signals, 2.0)


def stays(*spans: tuple[float, float]) -> list[tuple[float, str, str]]:
    """The transitions of a mode `gap` that is entered and left."""
    return [
        happening
        for enter, leave in spans
        for happening in ((enter, "drive", "gap"), (leave, "gap", "coast"))
    ]


def match(observed: Observation, **changes: Any) -> dict[str, Any]:
    options: dict[str, Any] = {"within": None, "since": None, "until": None, **changes}
    measure = MatchMeasure("m", FOUND, LOST, 15 * MS, unit="s", span=AT, **options)
    return {
        key.removeprefix("m."): value
        for key, value in evaluate_measures([measure], observed).items()
    }


def test_each_stay_takes_the_first_detection_from_before_it_until_it_is_left() -> None:
    found = match(
        make_observation(
            stays((0.5, 0.52), (0.6, 0.63), (0.8, 0.81), (1.0, 1.1)),
            stays((0.502, 0.51), (0.59, 0.62), (0.7, 0.71), (0.812, 0.83), (1.05, 1.06)),
        )
    )
    assert found["delays"] == pytest.approx([0.002, -0.01, 0.05])
    assert found["first"] == pytest.approx(0.002)
    assert {key: found[key] for key in ("truths", "matched", "missed", "detections")} == {
        "truths": 4, "matched": 3, "missed": 1, "detections": 5,
    }  # fmt: skip
    assert found["false_events"] == 1  # 0.7; 0.812 is late, but near a stay
    assert found["first_missed"] == 0


def test_one_detection_matches_one_stay_only() -> None:
    found = match(make_observation(stays((0.500, 0.505), (0.510, 0.520)), stays((0.504, 0.6))))
    assert (found["matched"], found["missed"], found["delays"]) == (1, 1, pytest.approx([0.004]))


def test_within_shortens_the_window_and_from_the_stays() -> None:
    seen = make_observation(stays((0.5, 0.6), (0.9, 0.95)), stays((0.55, 0.56), (0.89, 0.93)))
    assert match(seen, within=20 * MS)["delays"] == pytest.approx([-0.01])
    late = match(seen, since=Fraction(9, 10))
    assert (late["truths"], late["delays"]) == (1, pytest.approx([-0.01]))
    assert (late["detections"], late["false_events"]) == (0, 0)


def test_a_run_without_a_stay_has_no_first() -> None:
    found = match(make_observation((), stays((0.5, 0.6))))
    assert (found["first"], found["first_missed"], found["false_events"]) == (None, None, 1)


def test_a_stay_that_is_not_left_lasts_until_the_end() -> None:
    found = match(make_observation([(1.5, "drive", "gap")], [(1.9, "drive", "gap")]))
    assert found["delays"] == pytest.approx([0.4])


def event(
    kind: str, number: int = 1, name: ModeEntryEvent = LOST, since: Any = None
) -> EventMeasure:
    return EventMeasure("e", kind, name, number, since, None, "s", AT)  # type: ignore[arg-type]


def test_times_and_counts_of_events() -> None:
    seen = make_observation(stays((0.5, 0.52), (0.6, 0.63)))
    assert evaluate_measures([event("time", 2)], seen) == {"e": 0.6}
    assert evaluate_measures([event("time", 3)], seen) == {"e": None}
    assert evaluate_measures([event("count")], seen) == {"e": 2}
    assert evaluate_measures([event("count", since=Fraction(11, 20))], seen) == {"e": 1}
    left = ModeEntryEvent("plant", CHART, "coast", "gap")
    assert evaluate_measures([event("time", name=left)], seen) == {"e": 0.52}
    other = ModeEntryEvent("plant", CHART, "coast", "drive")
    assert evaluate_measures([event("count", name=other)], seen) == {"e": 0}


def test_a_delay_is_signed_and_bounded() -> None:
    seen = make_observation(stays((0.5, 0.52), (0.6, 0.63)), stays((0.49, 0.51), (0.604, 0.61)))
    first = DelayMeasure("d", FOUND, LOST, 1, 15 * MS, 10 * MS, None, None, "s", AT)
    assert evaluate_measures([first], seen)["d"] == pytest.approx(-0.01)
    strict = DelayMeasure("d", FOUND, LOST, 1, 5 * MS, 10 * MS, None, None, "s", AT)
    assert evaluate_measures([strict], seen)["d"] is None
    second = DelayMeasure("d", FOUND, LOST, 2, 5 * MS, None, None, None, "s", AT)
    assert evaluate_measures([second], seen)["d"] == pytest.approx(0.004)


def signal(kind: str, observed: Observation, **changes: Any) -> Any:
    options: dict[str, Any] = {"since": None, "until": None, "within": 0.0, "by": "crossings"}
    measure = SignalMeasure("s", kind, "x", **{**options, **changes}, unit="1", span=AT)  # type: ignore[arg-type]
    return evaluate_measures([measure], observed)["s"]


def test_numbers_of_a_signal() -> None:
    seen = make_observation(times=[0.0, 0.5, 1.0, 1.5, 2.0], values=[3.0, -4.0, 0.0, 1.2, 1.0])
    assert signal("peak", seen) == 4.0
    assert (signal("max", seen), signal("min", seen), signal("final", seen)) == (3.0, -4.0, 1.0)
    assert signal("mean", seen) == pytest.approx(0.24)
    assert signal("rms", seen, until=Fraction(1, 2)) == math.sqrt(12.5)
    assert signal("peak", seen, since=Fraction(1)) == 1.2
    assert signal("settling", seen, within=0.25) == 1.5
    assert signal("settling", seen, within=0.1) == 2.0
    assert signal("settling", seen, within=9.0) == 0.0
    assert signal("rms", seen, since=Fraction(21, 10)) is None


def test_a_window_that_starts_at_what_did_not_happen_has_no_number() -> None:
    seen = make_observation(times=[0.0, 1.0], values=[1.0, 2.0])
    later = SignalMeasure("s", "max", "x", "e", None, 0.0, "crossings", "1", AT)
    assert evaluate_measures([event("time"), later], seen) == {"e": None, "s": None}


def test_the_frequency_of_a_decaying_oscillation_on_a_slope() -> None:
    times = np.arange(0.0, 3.0, 1.0e-3)
    wave = np.exp(-0.3 * times) * np.sin(2.0 * math.pi * 6.17 * times) + 0.4 * times - 3.0
    assert frequency_by_crossings(times, wave) == pytest.approx(6.17, rel=5e-3)
    assert frequency_by_spectrum(times, wave) == pytest.approx(6.17, rel=5e-3)
    assert frequency_by_crossings(times, 2.0 * times) is None
