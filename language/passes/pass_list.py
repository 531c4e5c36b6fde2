"""The passes of the language in their order; both back ends use the resulting Program."""

from __future__ import annotations

from language.ir.program import Program
from language.passes.common_subexpressions import eliminate_common_subexpressions
from language.passes.input_hoisting import hoist_inputs
from language.passes.parameter_folding import fold_parameters
from language.passes.program_pass import ProgramPass
from language.passes.unused_parameters import remove_unused_parameters

LANGUAGE_PASSES: tuple[ProgramPass, ...] = (
    ProgramPass(
        "parameters",
        "expressions of parameters become constants and derived parameters",
        fold_parameters,
        invalidates=frozenset({"no-unused-parameters"}),
    ),
    ProgramPass(
        "inputs",
        "expressions of inputs are computed where the inputs are latched",
        hoist_inputs,
    ),
    ProgramPass(
        "common-subexpressions",
        "a block computes each real expression once (value numbering)",
        eliminate_common_subexpressions,
    ),
    ProgramPass(
        "unused-parameters",
        "fixed parameters that no block reads are removed",
        remove_unused_parameters,
        establishes=frozenset({"no-unused-parameters"}),
    ),
)
"""The passes that `program_of` runs after lowering."""


def run_passes(program: Program) -> Program:
    """Return the Program after all LANGUAGE_PASSES."""
    for step in LANGUAGE_PASSES:
        program = step.run(program)
    return program
