"""The paper's own mismatch: tip-outs of its driveline, with an amplitude-dependent shaft hidden."""

from __future__ import annotations

from tests.generators.open_cases.case import Case, DrawnEffect, Sensors
from tests.generators.open_cases.driveline import Driveline
from tests.generators.open_cases.manoeuvre import Manoeuvre
from tests.generators.open_cases.shaft import SLIDERS

DRIVELINE = Driveline(
    R=8.1, J_em=0.05, k=4800.0, c=14.0, alpha=0.0256, b_em=0.002, J_v=107.9, b_w=0.2, f0=36.0,
    cd2=0.012,
)  # fmt: skip
"""Values of the paper's driveline, everything at the wheel but the motor."""
SHAFT = DrawnEffect("stiffness_hysteresis", {"share": 0.2, "slip_Nm": 25.0 / sum(SLIDERS)})
"""Beside the shaft, sliding: a fifth of its stiffness, 25 N*m in all."""
SPEED = 36.0
"""Wheel speed before a tip-out [rad/s]: 40 km/h."""
STEP, RISE = 1.0, 0.03
"""When a step begins, and how long it takes [s]."""
VARIANT = """\
language: 1
variant: paper_driveline
extends: blind_driveline
parameters:
  R:     {value: 8.1}
  J_em:  {range: [0.04, 0.06]}
  k:     {value: 4800 N*m/rad, range: [3800, 5800]}
  c:     {value: 14 N*m*s/rad, range: [9, 21]}
  alpha: {value: 0.0256 rad, range: [0.02, 0.031]}
  b_em:  {value: 0.002 N*m*s/rad, range: [0.001, 0.004]}
  J_v:   {value: 107.9 kg*m^2, range: [86, 130]}
  b_w:   {value: 0.2 N*m*s/rad, range: [0.1, 0.4]}
  f0:    {value: 36 N*m, range: [25, 47]}
  cd2:   {value: 0.012 N*m*s^2/rad^2, range: [0.008, 0.016]}
"""


def tip_out(before: float, after: float, duration: float = 3.5) -> Manoeuvre:
    """Return a step of the motor torque [N*m], through the gap if its sign changes."""
    corners = ([0.0, STEP, STEP + RISE, duration], [before, before, after, after])
    return Manoeuvre("tip-out", duration, SPEED, corners)


def tip_out_case(hidden: bool = True, rate: int = 100) -> Case:
    """Return a case of four tip-outs, the last one held out; without what is `hidden`: clean."""
    steps = ((30.0, -20.0), (60.0, -30.0), (50.0, 10.0), (40.0, -25.0))
    return Case(
        5,
        0,
        rate,
        DRIVELINE,
        (SHAFT,) if hidden else (),
        tuple(tip_out(*step) for step in steps),
        3,
        Sensors((0.2, 0.25), (0.5, 1.0), (0.1, 0.05), (0.02, 0.01)),
    )
