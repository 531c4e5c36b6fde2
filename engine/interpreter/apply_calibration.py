"""Calibration during a run: sets tunable parameters of one running Program."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction

from engine.interpreter.interpreter import Stepper
from language.ir.number_type import round_to_type
from language.ir.program import Program

DERIVE_BLOCKS = ("derive", "compare_stamps")
"""Blocks that run after a change of parameters, as in `X_Calibrate` of the C code."""


def calibrate(stepper: Stepper, program: Program, values: Mapping[str, Fraction]) -> bool:
    """Set tunable parameters and run the derive blocks; return whether the Program has any of them.

    Keys are parameter names without `calibration.`; names that the Program lacks are ignored.
    Values are rounded to the number type. Of `DERIVE_BLOCKS` those that exist run, once, after all
    values are set; without a known name none runs.
    """
    known = {constant.name for constant in program.constants}
    used = {f"calibration.{name}": value for name, value in values.items()}
    used = {name: value for name, value in used.items() if name in known}
    for name, value in used.items():
        stepper.set(name, round_to_type(value, program.number_type))
    for block in DERIVE_BLOCKS if used else ():
        if block in program.blocks:
            stepper.run(block)
    return bool(used)
