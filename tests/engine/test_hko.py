"""The better observer of the driveline: contact lost by torque with a rewind, not by a wait."""

from __future__ import annotations

import numpy as np
import pytest

import modewright as mw
from tests.language.making import ROOT

WAITED = 2e-3
"""How late the paper's estimator sees it at 1 kHz, as printed [s]."""
GAP = {"no_contact", "gap"}


@pytest.fixture(scope="module")
def run() -> mw.Trajectory:
    return mw.simulate("ev_driveline_hko", "tip_out", root=ROOT)


def losses(run: mw.Trajectory, instance: str) -> list[float]:
    """Return when contact is lost, or seen to be [s]."""
    return [event.time for event in run.events_of(instance) if event.target in GAP]


def test_the_first_gap_is_seen_earlier_than_by_a_wait(run: mw.Trajectory) -> None:
    lost, waited, seen = (losses(run, name)[0] for name in ("plant", "est", "hko"))
    assert abs(waited - lost - WAITED) < 0.1e-3
    assert 0.0 < seen - lost < 1.0e-3


def test_every_gap_is_seen_once_and_no_later_than_by_a_wait(run: mw.Trajectory) -> None:
    lost, waited, seen = (np.array(losses(run, name)) for name in ("plant", "est", "hko"))
    assert lost.size == waited.size == seen.size == 5
    assert np.all(seen > lost)
    assert np.all(seen <= waited)
    assert np.mean(seen - lost) < 0.8 * np.mean(waited - lost)


def test_the_rewind_puts_the_gap_where_it_is(run: mw.Trajectory) -> None:
    """Without it the observer would stand at the edge of the gap when it sees that it is left."""
    seen = losses(run, "hko")[0]
    (row,) = np.flatnonzero(np.abs(run.times - seen) < 1e-9)[-1:]
    plant, hko = (float(run.signals[f"{name}.theta_b"][row]) for name in ("plant", "hko"))
    edge = 0.0256
    assert edge - plant > 4e-4
    assert abs(hko - plant) < 1e-6


def test_it_ends_without_a_fault_and_with_no_load_left_to_explain(run: mw.Trajectory) -> None:
    assert not run.faults
    assert abs(run.signals["hko.T_l"][-1]) < 1e-3
