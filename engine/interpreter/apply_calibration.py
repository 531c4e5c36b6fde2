"""Page: a change of the calibration of one running Program."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from engine.interpreter.interpreter import Stepper
from language.ir.number_type import round_to_type
from language.ir.program import Program

DERIVE_BLOCKS = ("derive", "compare_stamps")
"""What runs after a change, as `X_Calibrate` does in C."""


def calibrate(stepper: Stepper, program: Program, values: Mapping[str, Fraction]) -> bool:
    """Set tunable parameters, derive what follows, compare stamps; tell whether one is used."""
    used = {f"calibration.{name}": value for name, value in values.items()}
    known = {constant.name for constant in program.constants}
    used = {name: value for name, value in used.items() if name in known}
    for name, value in used.items():
        stepper.set(name, round_to_type(value, program.number_type))
    for block in DERIVE_BLOCKS if used else ():
        if block in program.blocks:
            stepper.run(block)
    return bool(used)
