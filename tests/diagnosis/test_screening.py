"""Candidates are screened on some recordings first; what others alone show is not lost."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import pytest

from diagnosis import screening
from diagnosis.bench import Bench
from diagnosis.candidate import Candidate
from diagnosis.estimate import Estimate, looked_at
from diagnosis.layers import fitting, shipped_effects
from diagnosis.level import first_fit, units_of
from diagnosis.point import Point, extended, values_at
from diagnosis.screening import BEHIND, HINT, MOST_SCREENED, Part, promises
from tests.diagnosis.test_estimation import TRUTH, bench, recorded

__all__ = ["bench"]
COUNT = 9
GAIN = 20.0
ENOUGH = 1000.0
"""Nats from which on one candidate is held against the others here."""


def away_on_some(raced: Callable[..., Estimate]) -> Callable[..., Estimate]:
    """First steps that on some of the recordings lead to where the brake has no drag."""

    def found(part: Part, candidate: Candidate, starts: Sequence[Point]) -> Estimate:
        if len(part.rows) == COUNT:
            return raced(part, candidate, starts)
        base, none = part.base, {"T_r_w_w": 0.0, "share_w_w": 0.0}
        start = extended(candidate, base.candidate, base.point, none)
        return looked_at(candidate, part.bench.series, base.noises, start)

    return found


@pytest.mark.parametrize("leads_away", [False, True])
@pytest.mark.parametrize("braked", [1, 5])
def test_what_a_single_recording_shows_is_found_where_it_is_not_looked_at_first(
    bench: Bench, braked: int, leads_away: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where steps on recordings that do not show it lead to where it does nothing."""
    brake = next(one for one in shipped_effects() if one.name == "brake_drag")
    drag = bench.candidate(tuple(fitting(bench.document, brake)))
    base, known = bench.candidate(()), {**TRUTH, "T_r_w_w": 150.0}
    free, held = recorded(drag, known), recorded(drag, known, brake=300.0)
    series = tuple(
        dataclasses.replace((held if k == braked else free)[k % 2], name=f"{k}")
        for k in range(COUNT)
    )
    assert len(series) > MOST_SCREENED
    own = dataclasses.replace(bench, series=series, _made={})
    fitted = first_fit(base, series, units_of(base, series, {}))
    if leads_away:
        monkeypatch.setattr(screening, "_raced", away_on_some(screening._raced))
    (promise,) = promises(own, fitted, [(drag.layers[0], drag)], HINT)
    assert promise.start is not None
    assert promise.gain > GAIN


def test_what_is_far_behind_is_not_followed_further(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside dry friction of the motor an offset of its torque takes its first steps alone."""
    monkeypatch.setattr(screening, "STRONG", ENOUGH)
    layers = {layer.id: layer for e in shipped_effects() for layer in fitting(bench.document, e)}
    names = ("coulomb_friction@w_em", "torque_gain@T_br")
    known = [(layers[name], bench.candidate((layers[name],))) for name in names]
    series = recorded(known[0][1], {**TRUTH, "T_c_w_em": 40.0})
    own = dataclasses.replace(bench, series=series, _made={})
    base = bench.candidate(())
    fitted = first_fit(base, series, units_of(base, series, {}))
    first, second = promises(own, fitted, known, HINT)
    assert (first.layer.id, second.layer.id) == names
    assert first.gain > ENOUGH
    assert first.start is not None
    assert second.gain < BEHIND * first.gain
    assert second.start is None


@pytest.mark.parametrize(
    ("alone", "is_there"), [({}, False), ({"T_c_w_em": 33.0}, True), ({"k": 33.0}, False)]
)
def test_a_candidate_starts_where_it_was_fitted_alone_too(
    bench: Bench, alone: dict[str, float], is_there: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not with a parameter that the effect does not bring."""
    layers = {layer.id: layer for e in shipped_effects() for layer in fitting(bench.document, e)}
    rubs = layers["coulomb_friction@w_em"]
    candidate, base = bench.candidate((rubs,)), bench.candidate(())
    series = recorded(candidate, {**TRUTH, "T_c_w_em": 40.0})
    own = dataclasses.replace(bench, series=series, _made={})
    fitted = first_fit(base, series, units_of(base, series, {}))
    begun: list[list[float]] = []
    raced = screening._raced

    def looking(part: Part, one: Candidate, starts: Sequence[Point]) -> Estimate:
        begun.append([round(values_at(one, start, 0)["T_c_w_em"], 6) for start in starts])
        return raced(part, one, starts)

    monkeypatch.setattr(screening, "_raced", looking)
    promises(own, fitted, [(rubs, candidate)], HINT, {rubs.id: alone})
    assert [33.0 in starts for starts in begun] == [is_there] * len(begun)
    assert begun
