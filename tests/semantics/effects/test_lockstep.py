"""Effects in a model that a sampled automaton runs: engine and C are equal, bit for bit."""

from __future__ import annotations

from pathlib import Path

import modewright as mw
from tests.language.spec_builders import project_of

PLANT = """language: 1
variant: worn
extends: driveline
effects:
  unknown_input@w_w: {rename: {T_u: T_l}}
  coulomb_friction@w_em: {values: {T_c: 0.8 N*m}}
  torque_ripple@T_em: {values: {a: 3 N*m, ord: 12}}
  stiffness_nonlinear@half_shaft: {values: {q: -0.5}}
  actuator_lag@T_em: {values: {tau: 8 ms}}
"""
RIDER = """language: 1
automaton: rider
period: 1 ms
numbers: float64
model: worn
inputs:
  T_em: {unit: N*m, range: [-400, 400]}
  T_br: {unit: N*m, range: [0, 3000], default: 0 N*m}
  slope: {unit: rad, range: [-1, 1], default: 0 rad}
states:
  theta_d: {initial: 0.074 rad, range: [-1, 1]}
  theta_b: {initial: alpha, range: [-0.2, 0.2]}
  w_em: {initial: 310 rad/s, range: [-400, 2400]}
  w_w: {initial: 38 rad/s, range: [-50, 300]}
  T_l: {initial: 5 N*m, range: [-2000, 2000]}
  th_T_em: {initial: 0 rad, range: [-100000, 100000]}
  u_1_T_em: {initial: T_em, range: [-400, 400]}
  u_2_T_em: {initial: T_em, range: [-400, 400]}
  u_3_T_em: {initial: T_em, range: [-400, 400]}
modes: {run: {runs: {of: worn.drive_contact, method: rk4, substeps: 4, events: 8}}}
outputs: [w_em, w_w, theta_d, theta_b, T_l, u_1_T_em]
"""
RIG = """language: 1
system: rig
inputs: {T_req: {unit: N*m}}
instances: {plant: {of: worn}, rider: {of: rider}}
connections: {plant.T_em: T_req, rider.T_em: T_req}
"""
RUN = """language: 1
scenario: run
of: rig
horizon: 0.4 s
initial: {plant.theta_d: 0.074 rad}
inputs: {T_req: {start: 30 N*m, steps: {0.05 s: -20 N*m, 0.25 s: 60 N*m}}}
"""


def test_a_run_of_a_model_with_effects_is_the_same_in_c(tmp_path: Path) -> None:
    project_of(tmp_path, worn=PLANT, rider=RIDER, rig=RIG, run=RUN)
    trajectory, verdicts = mw.lockstep("rig", "run", root=tmp_path)
    assert trajectory.stopped is None
    assert len(trajectory.events_of("plant")) >= 2  # the gap is crossed, so the run jumps too
    assert all(verdict.is_equal and verdict.ticks > 1 for verdict in verdicts), verdicts
    assert verdicts[0].ticks == 401
