"""The better observer of the driveline: contact lost by torque with a rewind, not by a wait."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from tests.language.spec_builders import ROOT, project_of

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
    assert abs(hko - plant) < 1e-5


def test_it_ends_without_a_fault_and_with_no_load_left_to_explain(run: mw.Trajectory) -> None:
    assert not run.faults
    assert abs(run.signals["hko.T_l"][-1]) < 1e-3


SAMPLED = """\
language: 1
system: sampled
inputs: {T_req: {unit: N*m}}
instances: {plant: {of: driveline}, hko: {of: hko}}
sensors:
  em: {of: plant.w_em, noise: {sd: 0.3 rad/s}, sample: 10 ms}
  w: {of: plant.w_w, noise: {sd: 0.05 rad/s}, sample: 10 ms}
connections: {plant.T_em: T_req, hko.T_em: T_req, hko.y_em: em, hko.y_w: w}
outputs: {T_hs: hko.T_hs}
"""
SHORT = """\
language: 1
scenario: short
of: sampled
horizon: 0.6 s
seed: 4
initial: {plant.w_w: 40 km/h / 0.29 m, plant.theta_d: 0.0740754719736 rad}
inputs: {T_req: {start: 30 N*m, steps: {0.4785 s: -20 N*m}}}
record: {every: 1 ms}
"""


def test_it_ticks_between_measurements_that_come_ten_times_slower(tmp_path: Path) -> None:
    """The paper's scheme ticks with them, and is 14 ms late."""
    project_of(tmp_path, sampled=SAMPLED, short=SHORT)
    run = mw.simulate("sampled", "short", root=tmp_path)
    (lost,), (seen,) = losses(run, "plant"), losses(run, "hko")
    assert abs(seen - lost) < 1.5e-3
    assert not run.faults
