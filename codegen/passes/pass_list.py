"""The passes of the C generator in their order, after those of the language (rule C18)."""

from __future__ import annotations

from codegen.passes.dead_stores import remove_dead_stores
from codegen.passes.fast_path import FastPathMode, add_fast_path
from codegen.passes.inline_policy import mark_inlining
from codegen.passes.range_check_merging import merge_range_checks
from codegen.passes.step_restriction import restrict_to_step
from language.ir.program import Program
from language.passes.program_pass import ProgramPass

REMOVABLE_GROUPS = ("work.",)
"""Groups of variables whose assignments are removed if nothing reads them."""


def c_passes(by_magnitude: bool = True, fast_path: FastPathMode = "on") -> tuple[ProgramPass, ...]:
    """Return the passes of the C generator in their order; all keep the bits of all results.

    `by_magnitude` is passed to `merge_range_checks`, `fast_path` to `add_fast_path`.
    """
    return (
        ProgramPass(
            "step",
            "what C does not execute is removed",
            restrict_to_step,
        ),
        ProgramPass(
            "unread-results",
            "assignments to work variables that nothing reads are removed",
            lambda program: remove_dead_stores(program, REMOVABLE_GROUPS),
            establishes=frozenset({"no-unread-results"}),
        ),
        ProgramPass(
            "range-checks",
            "all inputs of a step are checked with one condition",
            lambda program: merge_range_checks(program, by_magnitude),
        ),
        ProgramPass(
            "fast-path",
            "a step without an event has a block without branches",
            lambda program: add_fast_path(program, fast_path),
            invalidates=frozenset({"no-unread-results"}),
        ),
        ProgramPass(
            "inlining",
            "blocks that are not inlined in C are marked",
            mark_inlining,
        ),
    )


C_PASSES = c_passes()
"""The passes of the generator as `modewright generate` runs them."""


def run_c_passes(
    program: Program, by_magnitude: bool = True, fast_path: FastPathMode = "on"
) -> Program:
    """Return the Program that is printed as C, after all passes of `c_passes`."""
    for step in c_passes(by_magnitude, fast_path):
        program = step.run(program)
    return program
