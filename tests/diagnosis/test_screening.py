"""Candidates are screened on some recordings first; what others alone show is not lost."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.bench import Bench
from diagnosis.layers import fitting, shipped_effects
from diagnosis.level import first_fit, units_of
from diagnosis.prediction import noises_of
from diagnosis.search import MOST_SCREENED, screened
from tests.diagnosis.test_estimation import TRUTH, bench, recorded

__all__ = ["bench"]
COUNT = 9
GAIN = 20.0


@pytest.mark.parametrize("braked", [1, 5])
def test_what_a_single_recording_shows_is_found_where_it_is_not_looked_at_first(
    bench: Bench, braked: int
) -> None:
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
    fitted = first_fit(base, series, units_of(base, series, noises_of(series, {}), {}))
    assert fitted.cost - screened(own, drag, fitted).cost > GAIN
