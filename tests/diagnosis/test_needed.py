"""What an effect stood in for has its place and what it gained; what is worth most comes first."""

from __future__ import annotations

import pytest

from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.evidence import Evidence, evidence, less
from diagnosis.layers import Layer, fitting, shipped_effects
from diagnosis.level import settled, units_of
from diagnosis.needed import Needed, renewed, still_needed
from diagnosis.search import Tried
from diagnosis.threshold import EVERYWHERE
from tests.diagnosis.test_estimation import TRUTH, bench, recorded
from tests.diagnosis.test_location import based

__all__ = ["bench"]
LAG, DELAY = "sensor_lag@w_s", "sensor_delay@w_s"
DRAG, FRICTION = "quadratic_drag@w_em", "coulomb_friction@w_em"

STARTS = {"tau_w_s": 0.01, "T_d_w_s": 0.01, "T_c_w_em": 1.0, "c_2_w_em": 1e-5}


def layer(bench: Bench, wanted: str) -> Layer:
    effect = next(e for e in shipped_effects() if e.name == wanted.partition("@")[0])
    return next(one for one in fitting(bench.document, effect) if one.id == wanted)


def looked_at_after(bench: Bench, own: dict[str, float], first: str, second: str) -> Needed:
    """What is needed of two effects, the second found after the first, where the second acts, or
    both.
    """
    layers = [layer(bench, one) for one in (first, second)]
    true = layers if len(own) == len(layers) else layers[1:]
    series = recorded(bench.candidate(tuple(true)), {**TRUTH, **own})
    used = Bench(
        bench.document, bench.project, bench.automaton, (), series, bench.seen, bench.drifts
    )
    base = based(used)
    units = units_of(base.candidate, series, base.values(0))

    def fitted(count: int) -> Estimate:
        start = {**base.values(0), **STARTS}
        return settled(used.candidate(tuple(layers[:count])), series, base.noises, start, units)

    one, both = fitted(1), fitted(2)
    tried = (
        Tried(layers[0], 0.0, one, evidence(one, base, series)),
        Tried(layers[1], 0.0, both, evidence(both, one, series)),
    )
    return still_needed(used, Needed(base, both, tried), units, EVERYWHERE, lambda text: None)


def test_a_stand_in_goes_and_what_it_gained_is_that_of_the_other(bench: Bench) -> None:
    found = looked_at_after(bench, {"T_d_w_s": 0.03}, LAG, DELAY)
    (kept,) = found.kept
    assert kept.layer.id == DELAY
    assert kept.evidence is not None
    assert kept.evidence.train > 300.0
    assert kept.estimate is found.model
    assert found.model.values(0)["T_d_w_s"] == pytest.approx(0.03, rel=0.1)
    before = [Tried(layer(bench, one), 5.0) for one in (LAG, DELAY)]
    out, leading = renewed(before, before, found.kept)
    assert (out.estimate, leading) == (None, kept)


def test_what_is_worth_most_at_a_place_comes_first(bench: Bench) -> None:
    found = looked_at_after(bench, {"c_2_w_em": 2e-4, "T_c_w_em": 2.0}, DRAG, FRICTION)
    assert [one.layer.id for one in found.kept] == [FRICTION, DRAG]
    first, last = (one.evidence for one in found.kept)
    assert first is not None
    assert last is not None
    assert min(first.train, last.train) > 45.0
    assert found.model.values(0)["T_c_w_em"] == pytest.approx(2.0, rel=0.1)


def test_what_is_kept_knows_what_it_gains_beside_the_others(bench: Bench) -> None:
    found = looked_at_after(bench, {"T_d_w_s": 0.03, "T_c_w_em": 2.0}, DELAY, FRICTION)
    first, last = found.kept
    assert (first.layer.id, last.layer.id) == (DELAY, FRICTION)
    assert first.beside > 300.0
    assert last.beside == 0.0  # not looked for: it was found beside the first
    assert last.evidence is not None
    assert last.gained == last.evidence.train
    assert first.gained >= first.beside


def test_a_gain_less_others_is_what_is_left() -> None:
    whole, part = Evidence(10.0, 9.0, (4.0, 5.0)), Evidence(3.0, 2.0, (1.5, 0.5))
    assert less(whole, [part]) == Evidence(7.0, 7.0, (2.5, 4.5))
    assert less(whole, []) == whole
