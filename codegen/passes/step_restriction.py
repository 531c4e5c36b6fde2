"""Step restriction: the pass that removes what the C of a Program does not execute.

before                      after
block init                  block init
block derive                block derive
block step                  block step
block flow, dense, peek     <only the blocks that these run>
block invariants

C enters a Program at `init`, `derive` and `step`; the engine alone runs the parts of a step, and it
checks invariants.
"""

from __future__ import annotations

import dataclasses

from language.ir.program import ENTRY_BLOCKS, Program
from language.lowering.invariants import INVARIANT_PREFIX, INVARIANTS
from language.lowering.program_builder import finalise_program


def restrict_to_step(program: Program) -> Program:
    """Return a Program without what its C does not execute.

    A continuous Program (`period` is None) keeps what the blocks of ENTRY_BLOCKS reach. A sampled
    Program loses only the block and the variables of its invariants (rule 11b).
    """
    if program.period is None:
        return finalise_program(program, ENTRY_BLOCKS)
    blocks = {name: block for name, block in program.blocks.items() if name != INVARIANTS}
    variables = tuple(v for v in program.variables if not v.name.startswith(INVARIANT_PREFIX))
    return dataclasses.replace(program, blocks=blocks, variables=variables)
