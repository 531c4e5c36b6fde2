"""Candidates are screened on some recordings first; what others alone show is not lost."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import pytest

from diagnosis.estimation.estimate import Estimate, evaluate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.estimation.noise_level import disturbance_units, fit_base
from diagnosis.model.candidate import Candidate
from diagnosis.model.parameter_vector import ParameterVector, extend_vector, values_at
from diagnosis.model.placed_effect import find_placements, shipped_effects
from diagnosis.selection import screening
from diagnosis.selection.screening import (
    MAX_SCREENED,
    MIN_BEST_FRACTION,
    MIN_SCREENING_GAIN,
    ScreeningSubset,
    screen_candidates,
)
from tests.diagnosis.estimation.test_levenberg_marquardt import TRUTH, bench, simulate_recordings

__all__ = ["bench"]
COUNT = 9
GAIN = 20.0
ENOUGH = 1000.0
"""Nats from which on one candidate is held against the others here."""


def away_on_some(raced: Callable[..., Estimate]) -> Callable[..., Estimate]:
    """First steps that on some of the recordings lead to where the brake has no drag."""

    def found(
        part: ScreeningSubset, candidate: Candidate, starts: Sequence[ParameterVector]
    ) -> Estimate:
        if len(part.rows) == COUNT:
            return raced(part, candidate, starts)
        base, none = part.base, {"T_r_w_w": 0.0, "share_w_w": 0.0}
        start = extend_vector(candidate, base.candidate, base.point, none)
        return evaluate(candidate, part.model_set.series, base.noise_levels, start)

    return found


@pytest.mark.parametrize("leads_away", [False, True])
@pytest.mark.parametrize("braked", [1, 5])
def test_what_a_single_recording_shows_is_found_where_it_is_not_looked_at_first(
    bench: ModelSet, braked: int, leads_away: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where steps on recordings that do not show it lead to where it does nothing."""
    brake = next(one for one in shipped_effects() if one.name == "brake_drag")
    drag = bench.compile_candidate(tuple(find_placements(bench.document, brake)))
    base, known = bench.compile_candidate(()), {**TRUTH, "T_r_w_w": 150.0}
    free, held = simulate_recordings(drag, known), simulate_recordings(drag, known, brake=300.0)
    series = tuple(
        dataclasses.replace((held if k == braked else free)[k % 2], name=f"{k}")
        for k in range(COUNT)
    )
    assert len(series) > MAX_SCREENED
    own = dataclasses.replace(bench, series=series, _compiled={})
    fitted = fit_base(base, series, disturbance_units(base, series, {}))
    if leads_away:
        monkeypatch.setattr(screening, "_halve_starts", away_on_some(screening._halve_starts))
    (promise,) = screen_candidates(
        own, fitted, [(drag.placed_effects[0], drag)], MIN_SCREENING_GAIN
    )
    assert promise.start is not None
    assert promise.gain > GAIN


def test_what_is_far_behind_is_not_followed_further(
    bench: ModelSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside dry friction of the motor an offset of its torque takes its first steps alone."""
    monkeypatch.setattr(screening, "STRONG_GAIN", ENOUGH)
    layers = {
        layer.id: layer for e in shipped_effects() for layer in find_placements(bench.document, e)
    }
    names = ("coulomb_friction@w_em", "torque_gain@T_br")
    known = [(layers[name], bench.compile_candidate((layers[name],))) for name in names]
    series = simulate_recordings(known[0][1], {**TRUTH, "T_c_w_em": 40.0})
    own = dataclasses.replace(bench, series=series, _compiled={})
    base = bench.compile_candidate(())
    fitted = fit_base(base, series, disturbance_units(base, series, {}))
    first, second = screen_candidates(own, fitted, known, MIN_SCREENING_GAIN)
    assert (first.placed_effect.id, second.placed_effect.id) == names
    assert first.gain > ENOUGH
    assert first.start is not None
    assert second.gain < MIN_BEST_FRACTION * first.gain
    assert second.start is None


@pytest.mark.parametrize(
    ("alone", "is_there"), [({}, False), ({"T_c_w_em": 33.0}, True), ({"k": 33.0}, False)]
)
def test_a_candidate_starts_where_it_was_fitted_alone_too(
    bench: ModelSet, alone: dict[str, float], is_there: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not with a parameter that the effect does not bring."""
    layers = {
        layer.id: layer for e in shipped_effects() for layer in find_placements(bench.document, e)
    }
    rubs = layers["coulomb_friction@w_em"]
    candidate, base = bench.compile_candidate((rubs,)), bench.compile_candidate(())
    series = simulate_recordings(candidate, {**TRUTH, "T_c_w_em": 40.0})
    own = dataclasses.replace(bench, series=series, _compiled={})
    fitted = fit_base(base, series, disturbance_units(base, series, {}))
    begun: list[list[float]] = []
    raced = screening._halve_starts

    def looking(
        part: ScreeningSubset, one: Candidate, starts: Sequence[ParameterVector]
    ) -> Estimate:
        begun.append([round(values_at(one, start, 0)["T_c_w_em"], 6) for start in starts])
        return raced(part, one, starts)

    monkeypatch.setattr(screening, "_halve_starts", looking)
    screen_candidates(own, fitted, [(rubs, candidate)], MIN_SCREENING_GAIN, {rubs.id: alone})
    assert [33.0 in starts for starts in begun] == [is_there] * len(begun)
    assert begun
