"""What a diagnosis writes is a spec: it is checked, runs, and is the same in C, bit for bit.

`make verify` does this for every effect at every place; here are those that need most.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.diagnosis.example_report import layers_of
from tests.diagnosis.run_variant import run_variant
from tests.language.spec_builders import project_of

JOINT = """language: 1
effect: joint
about: a torque that swings with the angle of the wheel, as a formula for an unknown may say
at: {element: {kind: elastic}}
reads: [w_w]
parameters: {a: {value: 0, range: [-2, 2], neutral: 0, starts: [0.3]}}
states: {th: {unit: rad, initial: 0}}
flow: {th: der(th) = w_w}
equations: {$torque: base + a * base * sin(2 * th)}
"""
TOGETHER = (
    ("actuator_delay@T_em", "backlash@half_shaft", "joint@half_shaft"),
    ("stiffness_hysteresis@half_shaft", "tyre_slip@vehicle", "torque_ripple@T_em"),
)


@pytest.mark.long
@pytest.mark.parametrize("ids", TOGETHER, ids=", ".join)
def test_a_variant_with_three_effects_is_the_same_in_c(
    tmp_path: Path, ids: tuple[str, ...]
) -> None:
    found = run_variant(tmp_path, layers_of(project_of(tmp_path, joint=JOINT), ids))
    assert found.is_whole, found
    assert found.ticks >= 200
