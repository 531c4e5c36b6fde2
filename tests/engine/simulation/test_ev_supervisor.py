"""The supervisor of spec/ev_supervisor: what its day looks like, and the same in C."""

from __future__ import annotations

import numpy as np

import modewright as mw

WAY = [
    (0.10, "operation.precharge"),
    (0.25, "operation.ready"),
    (0.60, "operation.drive"),
    (1.00, "operation.drive.torque.pull"),
    (2.20, "operation.drive.derating.warm"),  # hot since 1.2 s, a wait of 1 s
    (3.00, "operation.drive.torque.creep"),
    (3.00, "operation.drive.torque.regen"),  # the next micro-step
    (3.52, "operation.drive.torque.creep"),
    (4.03, "fault"),  # not isolated since 4 s, a wait of 30 ms
    (4.30, "operation"),
    (4.50, "operation.precharge"),
    (4.57, "operation.ready"),
    (5.00, "operation.drive"),
    (5.00, "operation.drive.torque.pull"),
]


def test_a_day_of_the_supervisor_and_its_c() -> None:
    trajectory, verdicts = mw.lockstep("supervised", "day", optimise="O0")
    relays = ("main", "pre")
    way = [(round(e.time, 6), e.target) for e in trajectory.events if e.region not in relays]
    assert way == WAY
    assert [verdict.differing for verdict in verdicts] == [0]
    assert not trajectory.faults


def test_the_derating_goes_on_where_it_was_before_the_fault() -> None:
    """75 degC lies half way from 60 (all of the torque) to 90 (half of it): 0.75 of 80 N*m."""
    trajectory = mw.simulate("supervised", "day")
    at = int(np.searchsorted(trajectory.times, 5.5))
    assert trajectory.signals["sup.T_cmd"][at] == 60.0
    modes = trajectory.modes["sup.operation_drive_derating"]
    assert modes[int(trajectory.signals["sup.operation_drive_derating"][at])] == "warm"
