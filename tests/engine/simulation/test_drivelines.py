"""Drivelines of the literature: RK4 of the Program against scipy's methods (tests/data/specs)."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from functools import cache

import numpy as np
import pytest

import modewright as mw
from engine.reference.scipy_reference import simulate_with_scipy
from engine.reference.scipy_stepper import ScipyMethod
from engine.simulation.simulate import simulate
from language.model.system import Instance, Scenario, System
from modewright.api.simulation import load
from tests.language.spec_builders import ROOT

SPECS = ROOT / "tests/data/specs/drivelines"
DRIVES = {
    "two_gaps": ("tip_out_in", 20),
    "light_damping": ("coasting_down", 40),
    "clutch": ("launch", 10),
}
"""Scenario, and the events that there are at least."""
WIDE = Fraction(8, 10_000)
"""Step [s] of scipy's methods: they choose their own inside it, and look at guards in quarters.
The largest stable one of RK4 with a tenth of the damping is 0.812 ms: above it a spec is
refused."""
EVENTS_WITHIN = 2e-7
"""Of RK4 at the step of the spec against orders 8 and 5 at a tolerance of 1e-11 [s]."""
SIGNALS_WITHIN = {"two_gaps": 2e-6, "clutch": 2e-6, "light_damping": 1e-4}
"""Of the largest value; the last one's gap has h k / c = 0.34, to the fifth over 120: 4e-5."""
AWAY = 5e-6
"""Around an event [s], a sample may fall on either side of it."""


def drive(name: str, horizon: Fraction | None = None) -> tuple[System, Scenario]:
    loaded = load(name, DRIVES[name][0], root=SPECS)
    wanted = horizon or loaded.scenario.horizon
    return loaded.system, dataclasses.replace(loaded.scenario, horizon=wanted)


def wide(system: System) -> System:
    """Return the system with longer steps for who chooses his own inside them."""

    def widened(instance: Instance) -> Instance:
        automaton = dataclasses.replace(instance.automaton, step=WIDE)
        return dataclasses.replace(instance, automaton=automaton)

    instances = {name: widened(instance) for name, instance in system.instances.items()}
    return dataclasses.replace(system, instances=instances)


@cache
def ours(name: str) -> mw.Trajectory:
    return simulate(*drive(name))


def by(name: str, method: ScipyMethod, horizon: Fraction | None = None) -> mw.Trajectory:
    system, scenario = drive(name, horizon)
    return simulate_with_scipy(wide(system), scenario, method)


def assert_same(name: str, theirs: mw.Trajectory) -> None:
    """The same transitions at the same times, and the same signals away from them."""
    mine, count = ours(name), len(theirs.times)
    events = [e for e in mine.events if e.time <= theirs.times[-1]]
    moves = [(e.region, e.source, e.target) for e in events]
    assert [(e.region, e.source, e.target) for e in theirs.events] == moves
    late = [abs(a.time - b.time) for a, b in zip(events, theirs.events, strict=True)]
    assert max(late) <= EVENTS_WITHIN, max(late)
    near = np.zeros(count, dtype=bool)
    for event in events:
        near |= np.abs(theirs.times - event.time) < AWAY
    for signal, values in theirs.signals.items():
        off = np.abs(mine.signals[signal][:count] - values)[~near]
        assert off.max() <= SIGNALS_WITHIN[name] * max(1e-3, np.abs(values).max()), (
            signal,
            off.max(),
        )


@pytest.mark.long
@pytest.mark.parametrize("name", DRIVES)
def test_rk4_follows_the_method_of_order_8(name: str) -> None:
    theirs = by(name, "DOP853")
    assert theirs.stopped is None and len(theirs.events) >= DRIVES[name][1]
    assert_same(name, theirs)


@pytest.mark.long
@pytest.mark.parametrize("method", ["Radau", "LSODA"])
@pytest.mark.parametrize("name", ["two_gaps", "clutch"])
def test_rk4_follows_the_implicit_methods(name: str, method: ScipyMethod) -> None:
    horizon = {"two_gaps": Fraction(3, 10), "clutch": Fraction(7, 5)}[name]
    theirs = by(name, method, horizon)
    assert theirs.stopped is None and len(theirs.events) >= 2
    assert_same(name, theirs)


@pytest.mark.long
@pytest.mark.parametrize("method", ["DOP853", "Radau", "LSODA"])
def test_the_paper_s_first_gap_by_every_method(method: str) -> None:
    """0.5060139445701604 and 0.5249921050106992 s: an independent reproduction by DOP853."""
    root = ROOT / "tests/data/specs/table_1"
    found = mw.simulate("ev_driveline_ideal", "short", root=root, method=method)
    times = [event.time for event in found.events_of("plant")]
    assert np.allclose(times, [0.5060139445701604, 0.5249921050106992], rtol=0, atol=1e-9)


def test_a_method_that_is_not_known_is_told() -> None:
    with pytest.raises(ValueError, match="`RK5` is no method of integration"):
        mw.simulate("ev_driveline_ideal", "tip_out", method="RK5")
