"""Value analysis: checks for infinities, NaN, division by zero, overflow and invalid accesses.

The value analysis of Frama-C (EVA) computes intervals of all values over all inputs and
calibrations, for any number of steps (abstract interpretation).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from codegen.emit.c_expression import format_literal
from codegen.emit.c_module import emit_c_files
from codegen.emit.c_names import C_REAL_TYPE, CNames, c_type
from codegen.harness.harness import tick_inputs, tunable_constants
from codegen.passes.step_restriction import restrict_to_step
from codegen.toolchain.external_tools import run_tool
from codegen.toolchain.templates import render
from codegen.toolchain.tool_verdict import ToolVerdict, tool_version
from language.ir.number_type import MAX_FINITE
from language.ir.ops import Count, Expr, Item, Loop, Op, Ref, RunBlock, Store
from language.ir.program import Constant, Program, Variable
from language.ir.rewrite_ops import direct_expressions, walk_post_order
from language.ir.traversal import walk_ops

KERNEL_OPTIONS = (
    *("-machdep", "gcc_x86_32", "-cpp-extra-args=-I. -Dvolatile="),
    *("-warn-special-float", "non-finite", "-warn-signed-overflow", "-warn-unsigned-overflow"),
    *("-warn-signed-downcast", "-warn-unsigned-downcast"),
)
"""Options of Frama-C. The page is not `volatile` here, because it changes only between steps."""
ANALYSIS_OPTIONS = ("-eva", "-eva-precision", "1", "-eva-no-show-progress")
"""Options of the value analysis."""
MERGED_STEP_OPTIONS = ("-eva-slevel-function", "main:0")
"""Options by which steps are not followed one by one: all states are merged, and counters begin
with any value."""
ALARM = re.compile(
    r"\[eva:alarm\] (?P<file>[^:]+):(?P<line>\d+): Warning: *(?P<what>[^\n]*)\n? *(?P<more>[^\n]*)"
)
"""An alarm in the output: file, line and text."""
REACHED = re.compile(r"(\d+) statements reached \(out of (\d+)\)")
"""The number of analysed statements in the output."""


def check_values(program: Program, folder: Path) -> ToolVerdict:
    """Run the value analysis on the C of a Program and return its verdict.

    Files are written to `folder`. Raises MissingToolError, BuildError.
    """
    files = {**emit_c_files(program, by_magnitude=False), "main.c": _main(program)}
    for name, text in files.items():
        (folder / name).write_text(text)
    sources = [name for name in files if name.endswith(".c")]
    turns = str(_turns(program))
    unrolled = ("-eva-min-loop-unroll", turns, *(MERGED_STEP_OPTIONS if program.run_modes else ()))
    done = run_tool(["frama-c", *KERNEL_OPTIONS, *ANALYSIS_OPTIONS, *unrolled, *sources], folder)
    tool = f"Frama-C {tool_version('frama-c', folder)}"
    alarms = {
        f"{m['file']}:{m['line']}: {m['what'] or m['more']}" for m in ALARM.finditer(done.stdout)
    }
    reached = REACHED.search(done.stdout)
    if done.returncode or reached is None:
        last = (done.stdout + done.stderr).strip().splitlines()[-1:]
        return ToolVerdict("values", tool, "no result", tuple(last) or ("no result",))
    about = f"{reached[1]} of {reached[2]} statements reached; any number of steps"
    return ToolVerdict("values", tool, about, tuple(sorted(alarms)))


def _turns(program: Program) -> int:
    """Return the number of loop iterations that are followed one by one.

    It is the largest number of iterations of a loop that runs blocks, if the Program runs a model,
    because its values grow from iteration to iteration and the analysis finds no bound. Otherwise
    it is 0.
    """
    if not program.run_modes:
        return 0
    loops = [
        op for block in program.blocks.values() for op in walk_ops(block) if isinstance(op, Loop)
    ]
    running = (
        op for op in loops if any(isinstance(inner, RunBlock) for inner in walk_ops(op.body))
    )
    return max((loop.count for loop in running), default=0)


def counter_limits(program: Program) -> dict[str, int]:
    """Return the largest value of each retained counter: timers and array indices.

    With these bounds a counter may begin with any value, and no steps need to be followed until it
    is full. A Program that runs no model has none.
    """
    if not program.run_modes:
        return {}
    sizes = {variable.name: variable.size for variable in program.variables}
    found: dict[str, int] = {}
    for op in (op for block in program.blocks.values() for op in walk_ops(block)):
        if isinstance(op, Count):
            found[op.timer] = max(op.limit, found.get(op.timer, 0))
        for array, index in _places(op):
            if isinstance(index, Ref) and index.name.startswith("memory.") and sizes.get(array):
                found[index.name] = min(sizes[array] - 1, found.get(index.name, sizes[array]))
    return found


def _places(op: Op) -> Iterator[tuple[str, Expr]]:
    """Yield the arrays that an operation reads or writes, with their indices."""
    if isinstance(op, Store):
        yield op.array, op.index
    for whole in direct_expressions(op):
        yield from ((e.name, e.index) for e in walk_post_order(whole) if isinstance(e, Item))


def _main(program: Program) -> str:
    """Return the C of the main that calls steps with any inputs and calibrations."""
    place = CNames(program)
    inputs = [
        (place(v.name).replace("in->", "in."), _any(program, v)) for v in tick_inputs(program)
    ]
    page = [
        (place(c.name).replace("cal->", "cal."), _within(program, c))
        for c in tunable_constants(restrict_to_step(program))
        if c.range
    ]
    real = C_REAL_TYPE[program.number_type]
    kinds = {variable.name: c_type(variable, program.number_type) for variable in program.variables}
    counts = [
        (place(name).replace("self->", "self."), f"({kinds[name]})Frama_C_interval(0, {most})")
        for name, most in counter_limits(restrict_to_step(program)).items()
    ]
    given = {"name": program.name, "real": real, "inputs": inputs, "page": page, "counts": counts}
    return render("proofs/values_main.c.jinja", given)


def _any(program: Program, variable: Variable) -> str:
    """Return the C text of any value of an input, inside or outside of its range."""
    if variable.type == "real":
        return _between(program, -MAX_FINITE[program.number_type], MAX_FINITE[program.number_type])
    if variable.type == "truth":
        return "Frama_C_interval(0, 1) != 0"
    low, high = (
        (0, 255) if c_type(variable, program.number_type) == "uint8_t" else (-(2**31), 2**31 - 1)
    )
    return f"({c_type(variable, program.number_type)})Frama_C_interval({low}, {high})"


def _within(program: Program, constant: Constant) -> str:
    """Return the C text of any value in the range of a constant."""
    assert constant.range
    return _between(program, *(float(end) for end in constant.range))


def _between(program: Program, low: float, high: float) -> str:
    """Return the C text of any real between two ends."""
    ends = (
        f"{format_literal(low, program.number_type)}, {format_literal(high, program.number_type)}"
    )
    return f"Frama_C_{C_REAL_TYPE[program.number_type]}_interval({ends})"
