"""What explains too little is refused; what answers to known inputs is no hidden one."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from diagnosis.adequacy import (
    FAINT,
    hardly_shows,
    is_inadequate,
    piles_up,
    refused,
    remembers,
    remembers_mostly,
)
from diagnosis.bench import Bench
from diagnosis.estimate import Estimate
from diagnosis.estimation import estimated
from diagnosis.evidence import evidence, inflations
from diagnosis.joined import burnt
from diagnosis.layers import effects_in, fitting
from diagnosis.level import settled, units_of
from diagnosis.search import Tried
from diagnosis.selection import Selection
from diagnosis.series import Series
from diagnosis.stirring import resting, stirring
from diagnosis.strain import is_strained, strain
from tests.diagnosis.test_estimation import bench
from tests.diagnosis.test_location import based, with_effect
from tests.language.making import ROOT

__all__ = ["bench"]
NEEDED = 50.0
"""Nats that a freedom has to gain at least."""
FEW, LOUDER = 1, 50.0
"""Recordings in which much is left, how much more than in the others."""
STRONG = {"T_c_w_em": 10.0}


@pytest.fixture(scope="module")
def rubbing(bench: Bench) -> Bench:
    """Return recordings of a driveline with dry friction at the motor."""
    return with_effect(bench, "coulomb_friction@w_em", STRONG)


def accepting(bench: Bench, rubbing: Bench, effect: str, base: Estimate | None = None) -> Selection:
    """Return a selection that has accepted an effect for what is recorded, over a base."""
    layers = {layer.id: layer for e in bench.effects for layer in fitting(bench.document, e)}
    base = base or based(rubbing)
    units = units_of(base.candidate, rubbing.series, base.values(0))
    candidate = rubbing.candidate((layers[effect],))
    model = settled(candidate, rubbing.series, base.noises, base.values(0), units)
    known = evidence(model, base, rubbing.series)
    tried = Tried(layers[effect], known.train, model, known)
    return Selection(base, model, (tried,), (tried,), ())


@pytest.mark.parametrize(
    ("effect", "inadequate"), [("coulomb_friction@w_em", False), ("sensor_lag@w_em", True)]
)
def test_what_explains_less_than_it_leaves_is_inadequate(
    bench: Bench, rubbing: Bench, effect: str, inadequate: bool
) -> None:
    selection = accepting(bench, rubbing, effect)
    assert is_inadequate(rubbing, selection, NEEDED) is inadequate


@pytest.mark.parametrize(
    ("effect", "does"), [("coulomb_friction@w_em", False), ("sensor_lag@w_em", True)]
)
def test_innovations_remember_what_is_still_missing(
    bench: Bench, rubbing: Bench, effect: str, does: bool
) -> None:
    base = based(rubbing)
    quiet = dataclasses.replace(base, noises=dataclasses.replace(base.noises, drifts={}))
    alone = estimated(quiet.candidate, rubbing.series, quiet.noises, quiet.point)
    selection = accepting(bench, rubbing, effect, alone)
    start = selection.model.candidate, rubbing.series, quiet.noises, selection.model.point
    selection = dataclasses.replace(selection, model=estimated(*start))
    assert remembers(rubbing, selection) is does
    assert remembers_mostly(rubbing, selection) is does


@pytest.mark.parametrize(("further", "piles"), [(0.3, False), (0.4, True)])
def test_two_that_gain_alike_at_one_place_are_neither(
    bench: Bench, rubbing: Bench, further: float, piles: bool
) -> None:
    selection = accepting(bench, rubbing, "coulomb_friction@w_em")
    (first,) = selection.accepted
    assert first.evidence is not None
    less = dataclasses.replace(first.evidence, train=further * first.evidence.train)
    second = dataclasses.replace(first, evidence=less)
    assert piles_up(dataclasses.replace(selection, accepted=(first, second))) is piles
    assert not piles_up(selection)


def test_what_was_refused_is_not_likely(bench: Bench, rubbing: Bench) -> None:
    selection = accepting(bench, rubbing, "coulomb_friction@w_em")
    assert selection.probabilities()["coulomb_friction@w_em"] > 0.9
    left = refused(selection)
    assert left.model is selection.base
    assert left.accepted == ()
    assert left.probabilities()["other"] > 0.9


def test_an_unknown_that_comes_when_inputs_move_answers_to_them() -> None:
    time = np.arange(0.0, 10.0, 0.01)
    torque = np.where((time > 3.0) & (time < 6.0), 100.0, 0.0)
    series = Series("a", Fraction(1, 100), Fraction(0), torque[:, None], torque[:, None])
    answer = np.exp(-np.abs(time - 3.05) / 0.1) - np.exp(-np.abs(time - 6.05) / 0.1)
    other = np.exp(-np.abs(time - 1.5) / 0.1) + np.exp(-np.abs(time - 8.0) / 0.1)
    start = burnt(series)
    assert stirring([series], [answer[start:]]) > 0.8
    assert stirring([series], [other[start:]]) < 0.1
    assert stirring([series], [0.0 * answer[start:]]) == 0.0


def test_an_unknown_that_is_heard_near_rest_is_what_a_friction_lacks() -> None:
    time = np.arange(0.0, 10.0, 0.01)
    speed = 50.0 * np.cos(0.3 * np.pi * time)
    series = Series("a", Fraction(1, 100), Fraction(0), speed[:, None], speed[:, None])
    start = burnt(series)
    rubs = np.exp(-((speed / 4.0) ** 2)) * np.sign(np.gradient(speed))
    hit = np.exp(-np.abs(time - 3.3) / 0.1)
    assert resting([series], [rubs[start:]]) > 0.9
    assert resting([series], [hit[start:]]) < 0.3


def test_a_few_recordings_in_which_much_is_left_do_not_speak_for_all(
    bench: Bench, rubbing: Bench
) -> None:
    base = based(rubbing)
    quiet = dataclasses.replace(base, noises=dataclasses.replace(base.noises, drifts={}))
    alone = estimated(quiet.candidate, rubbing.series, quiet.noises, quiet.point)
    right = accepting(bench, rubbing, "coulomb_friction@w_em", alone)
    before = alone.outcome.innovations
    assert len(before) > FEW
    for bad, mostly in ((FEW, False), (len(before), True)):
        outcome = dataclasses.replace(right.model.outcome)
        after = list(outcome.innovations)
        for k in np.argsort(-inflations(alone, rubbing.series))[:bad]:
            after[k] = LOUDER * before[k]
        vars(outcome)["joined"] = np.concatenate(after)
        model = dataclasses.replace(right.model, outcome=outcome)
        selection = dataclasses.replace(right, model=model)
        assert remembers(rubbing, selection)
        assert remembers_mostly(rubbing, selection) is mostly


@pytest.mark.parametrize(("most", "strained"), [(100, False), (2, True)])
def test_what_is_pulled_out_of_its_range_is_something_else(
    bench: Bench, rubbing: Bench, most: int, strained: bool, tmp_path: Path
) -> None:
    """Friction of which no more than a fifth may act would gain much beyond that."""
    text = (ROOT / "spec" / "effects" / "coulomb_friction.yaml").read_text()
    limited = text.replace("range: [0, 100]", f"range: [0, {most}]")
    (tmp_path / "coulomb_friction.yaml").write_text(limited)
    own = dataclasses.replace(rubbing, effects=effects_in(tmp_path), _made={})
    selection = accepting(own, own, "coulomb_friction@w_em")
    given = selection.model, selection.accepted
    assert is_strained(*given) is strained
    assert (strain(*given) < 1.0) is not strained


@pytest.mark.parametrize(("part", "loud"), [(0.1, 0.95), (10.0, 0.95), (0.1, 0.5)])
def test_what_gained_little_has_to_show_in_simulations(
    bench: Bench, rubbing: Bench, part: float, loud: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A faint name falls where simulations stay nearly as they were; a strong one need not show."""
    selection = accepting(bench, rubbing, "coulomb_friction@w_em")
    (first,) = selection.accepted
    assert first.evidence is not None
    assert not hardly_shows(rubbing, selection)
    known = dataclasses.replace(first.evidence, train=part * FAINT)
    faint = dataclasses.replace(selection, accepted=(dataclasses.replace(first, evidence=known),))
    sizes = {
        id(selection.base): np.array([0.1, 0.2]),
        id(selection.model): loud * np.array([0.1, 0.2]),
    }
    monkeypatch.setattr("diagnosis.adequacy.nrmse", lambda one, series: sizes[id(one)])
    assert hardly_shows(rubbing, faint) is (part < 1.0 and loud > 0.85)
