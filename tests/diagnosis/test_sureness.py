"""A name beside others, or whose parameters differ from recording to recording, is less sure."""

from __future__ import annotations

import dataclasses

import pytest

from diagnosis.bench import Bench
from diagnosis.constancy import variation, varies
from diagnosis.layers import fitting, shipped_effects
from diagnosis.search import Tried
from diagnosis.selection import Selection
from diagnosis.sureness import UNSURE, less_sure
from tests.diagnosis.test_adequacy import accepting, rubbing
from tests.diagnosis.test_estimation import TRUTH, bench, recorded
from tests.diagnosis.test_needed import FRICTION, layer

__all__ = ["bench", "rubbing"]


def with_second(bench: Bench, selection: Selection, effect: str, part: float) -> Selection:
    """Return a selection with a second effect that gained `part` of what the first one did."""
    (first,) = selection.accepted
    assert first.evidence is not None
    layers = {layer.id: layer for e in shipped_effects() for layer in fitting(bench.document, e)}
    gained = dataclasses.replace(first.evidence, train=part * first.evidence.train)
    second = Tried(layers[effect], 1.0, first.estimate, gained)
    return dataclasses.replace(selection, accepted=(first, second))


def share(bench: Bench, selection: Selection, told: list[str]) -> float:
    """Return the probability of friction."""
    return less_sure(bench, selection, told.append).probabilities()[FRICTION]


@pytest.mark.parametrize("second", ["torque_gain@T_em", "sensor_lag@w_s", "unknown_input@w_w"])
def test_a_name_that_needs_others_beside_it_is_less_sure(
    bench: Bench, rubbing: Bench, second: str
) -> None:
    alone, told = accepting(bench, rubbing, FRICTION), list[str]()
    assert share(rubbing, alone, told) > 0.9
    assert not told
    both = with_second(bench, alone, second, 0.3)
    assert share(rubbing, both, told) == pytest.approx(UNSURE, abs=1e-3)
    assert told == ["less sure: coulomb_friction@w_em: it needs others beside it"]
    assert both.has_hidden is second.startswith("unknown_input")
    assert not alone.has_hidden


@pytest.mark.parametrize("apart", [0.0, 1.5])
def test_parameters_that_are_not_the_same_in_each_recording_make_a_name_less_sure(
    bench: Bench, apart: float
) -> None:
    """Half of the recordings have less friction than the others."""
    true = bench.candidate([layer(bench, FRICTION)])
    small, large = (recorded(true, {**TRUTH, "T_c_w_em": 3.0 + by}) for by in (-apart, apart))
    mixed = [(small, large)[k % 2][k] for k in range(len(small))]
    used = dataclasses.replace(bench, series=tuple(mixed), _made={})
    selection = accepting(bench, used, FRICTION)
    (first,) = selection.accepted
    assert varies(selection.model, first, used.series) is (apart > 0.0)
    told: list[str] = []
    probability = share(used, selection, told)
    assert (probability == pytest.approx(UNSURE, abs=1e-3)) is (apart > 0.0)
    assert told == [
        "less sure: coulomb_friction@w_em: its parameters are not the same in each recording"
    ] * (apart > 0.0)


def test_noise_alone_varies_about_nothing(bench: Bench, rubbing: Bench) -> None:
    """What is to be expected of noise does not count, and what has no parameters varies nothing."""
    selection = accepting(bench, rubbing, FRICTION)
    (first,) = selection.accepted
    assert abs(variation(selection.model, first.layer, rubbing.series)) < 15.0
    assert variation(selection.model, layer(bench, "unknown_input@w_em"), rubbing.series) == 0.0
    unknown = dataclasses.replace(selection.model, normal=None)
    assert variation(unknown, first.layer, rubbing.series) == 0.0
