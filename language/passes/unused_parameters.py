"""Unused parameters: the pass that removes fixed parameters that no block reads.

before                      after
constant.m = 2.0 kg         constant.m_g = 19.62
constant.g = 9.81 m/s^2     block step
constant.m_g = 19.62            x := constant.m_g
block step
    x := constant.m_g

The pass `parameters` leaves the factors of a folded product behind. Tunable and derived parameters
stay: they are on the calibration page.
"""

from __future__ import annotations

import dataclasses

from language.ir.program import Program
from language.ir.traversal import names_used
from language.passes.hoisting import CONSTANT_PREFIX


def remove_unused_parameters(program: Program) -> Program:
    """Return the Program without the fixed parameters that no block reads."""
    used = names_used(program.blocks.values())
    constants = tuple(
        c for c in program.constants if c.name in used or not c.name.startswith(CONSTANT_PREFIX)
    )
    return dataclasses.replace(program, constants=constants)
