"""C modules: prints a Program as a header, a source file and a memory map (rules C12, C13 and C16).

`run_c_passes` prepares the Program, `module_context` collects the values of the templates.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from codegen.emit.c_expression import MATH_SUFFIX, format_literal, reads_table
from codegen.emit.c_math import emit_math_files, emit_page_header
from codegen.emit.c_names import (
    C_REAL_TYPE,
    SOLVED_PREFIX_CONSTANT,
    SOLVED_PREFIX_ON_PAGE,
    CNames,
    c_member,
    c_type,
    enumerations,
    mode_constant,
    run_mode_constant,
    transition_constants,
    value_constant,
)
from codegen.emit.c_statement import INDENT, MAX_LINE_WIDTH, StatementEmitter
from codegen.emit.c_struct import ECU_PAGE, HOST_PAGE, PageLayout, member_of, struct_members
from codegen.emit.function_comments import describe_function
from codegen.emit.work_variables import STEP, Scratch, adjust_usages, scratch_of
from codegen.passes.block_usage import Usage, block_usages, locals_of, loop_locals
from codegen.passes.fast_path import FastPathMode
from codegen.passes.pass_list import run_c_passes
from codegen.toolchain.templates import product_version, render
from language.ir.ops import FaultBit
from language.ir.printer import digest
from language.ir.program import ENTRY_BLOCKS, InlineMark, Program, Variable
from language.ir.rewrite_ops import direct_expressions, walk_post_order
from language.ir.traversal import called_blocks, called_functions, walk_ops
from language.lowering.calibration_stamp import STALE_CALIBRATION
from language.model.declaration import MICRO_STEP_LIMIT_FAULT
from language.model.graph_algorithms import post_order
from language.numerics.function_table import FUNCTIONS_BY_TYPE
from language.observers.covariance_update import COVARIANCE_RANGE
from language.programs.major_step import LIVELOCK, ZENO
from language.programs.model_run import EVENT_LIMIT
from language.programs.rewind import REWIND_LIMIT

FAULT_REASONS = {
    COVARIANCE_RANGE: "a variance was outside its range",
    EVENT_LIMIT: "more transitions in a tick than `events`: the rest is dropped",
    LIVELOCK: "transitions at an instant did not end: no more are taken",
    MICRO_STEP_LIMIT_FAULT: "transitions of a tick did not end: no more are taken",
    REWIND_LIMIT: "a rewind would go back further than ticks are kept",
    STALE_CALIBRATION: "solved numbers belong to another calibration",
    ZENO: "more transitions than a step may have: its rest is dropped",
}
"""Comments of the fault bits that the product sets (rule C16)."""

RANGE_REASON = "{} was outside its range"
"""The comment of a fault bit of a range."""


def fault_reason(program: Program, fault: str) -> str:
    """Return the comment that tells why a fault bit is set.

    A fault of the product has its text in FAULT_REASONS. For a fault of a range it is RANGE_REASON
    with the names of the signals, joined with ` or `. Any other fault (one that the spec declares)
    has an empty text.
    """
    if fault in FAULT_REASONS:
        return FAULT_REASONS[fault]
    ops = (op for block in program.blocks.values() for op in walk_ops(block))
    set_by = (
        op.signal for op in ops if isinstance(op, FaultBit) and op.fault == fault and op.value
    )
    names = dict.fromkeys(name for name in set_by if name)
    return RANGE_REASON.format(" or ".join(names)) if names else ""


INLINE_KEYWORDS: Mapping[InlineMark, str] = {"rarely": "RARELY", "not-inlined": "NOT_INLINED"}
"""The keyword of a function with a mark (rule C23); a function without one is `inline`."""
NOT_INLINED = {
    "RARELY": "Runs rarely: not inlined",
    "NOT_INLINED": "Computes much: its values are on the stack only while it runs",
}
"""Keywords of functions that are not inlined, with the comments of their definitions."""

STATIC_PATTERN = rf"static (?:{'|'.join(('inline', *NOT_INLINED))}) "
"""Pattern of the first words of a function definition in generated C."""

INLINE_FUNCTIONS = ("min", "max", "clip", "sign", "pow2", "whole", "within", "lookup", "lookup2")
"""Elementary functions that are inline functions of the ha_math header."""


def emit_c_files(
    program: Program, by_magnitude: bool = True, fast_path: FastPathMode = "on"
) -> dict[str, str]:
    """Return the C files of a Program by name: `X.h`, `X_MemMap.h`, `X.c`, and those of functions.

    Functions are in ha_math and ha_page, each only if the C calls it.

    `by_magnitude` is passed to `merge_range_checks`, `fast_path` to `add_fast_path`. The files
    contain the digest of the given Program, before any pass. Raises ValueError for a Program
    without a block `step`, which is one of a continuous automaton whose inputs vary inside a step.
    """
    if "step" not in program.blocks:
        raise ValueError(f"inputs of {program.name} vary inside a step: it has no C")
    context = {
        **module_context(run_c_passes(program, by_magnitude, fast_path), ECU_PAGE),
        "digest": digest(program),
    }
    files = {
        f"{program.name}.h": render("emit/module.h.jinja", context),
        f"{program.name}_MemMap.h": render("emit/memory_map.h.jinja", context),
        f"{program.name}.c": render("emit/module.c.jinja", context),
    }
    if context["uses_math"]:
        files.update(emit_math_files(program.number_type))
    if context["uses_page_tables"]:
        files.update(emit_page_header(program.number_type))
    return files


def module_context(program: Program, page_layout: PageLayout = HOST_PAGE) -> dict[str, Any]:
    """Return the context of the templates of a module: names, structures, functions and flags.

    `program` has passed `run_c_passes`. The layout of the page decides whether solved numbers are
    members of the page or constants of the file. Functions are in an order in which callees come
    first; those of ENTRY_BLOCKS are in `entries` by name, all others in `blocks`.
    """
    number = program.number_type
    loop_variables = loop_locals(program)
    local = locals_of(program, loop_variables)
    usage_by_block = block_usages(program, local, page_layout.groups)
    kinds = {variable.name: c_type(variable, program.number_type) for variable in program.variables}
    called = called_functions(program.blocks.values())
    shared = _shared_work_variables(program, local)
    scratch = scratch_of(program, shared, usage_by_block, page_layout.holds_solved)
    if scratch and scratch.block != STEP:
        usage_by_block = adjust_usages(program, usage_by_block, scratch)
    blocks = _emit_functions(
        program, local, loop_variables, usage_by_block, kinds, page_layout, scratch
    )
    return {
        **_name_context(program),
        **struct_members(program, page_layout),
        "work": [member_of(variable, number) for variable in shared],
        "scratch": scratch and _scratch_context(program, scratch, kinds),
        "work_type": _work_type(program, page_layout, scratch),
        "calls": {
            block: f"{block}({', '.join(usage_by_block[block].parameters)})"
            for block in usage_by_block
        },
        "blocks": [block for block in blocks if block["name"] not in ENTRY_BLOCKS],
        "entries": {block["name"]: block for block in blocks if block["name"] in ENTRY_BLOCKS},
        "keywords": [
            (word, why)
            for word, why in NOT_INLINED.items()
            if any(block["keyword"] == word for block in blocks)
        ],
        "has_stamps": "compare_stamps" in program.blocks,
        "uses_math": bool(called & {*FUNCTIONS_BY_TYPE[number], *INLINE_FUNCTIONS}),
        "uses_page_tables": _uses_volatile_tables(program, page_layout),
        "uses_libm": bool(called & {"abs", "sqrt", "floor"}),
    }


def _uses_volatile_tables(program: Program, page_layout: PageLayout) -> bool:
    """Tell whether a block looks up a value in a table on the page, and the page is volatile."""
    is_volatile = _names_in_function(program, frozenset(), page_layout).is_volatile
    return any(
        reads_table(part, is_volatile)
        for block in program.blocks.values()
        for op in walk_ops(block)
        for expr in direct_expressions(op)
        for part in walk_post_order(expr)
    )


def _names_in_function(program: Program, local: frozenset[str], page_layout: PageLayout) -> CNames:
    """Return the C text of names inside a function with the given local variables."""
    return CNames(
        program,
        local,
        SOLVED_PREFIX_ON_PAGE if page_layout.holds_solved else SOLVED_PREFIX_CONSTANT,
    )


def _name_context(program: Program) -> dict[str, Any]:
    """Return the context of names: files, modes, transitions, enumerations, faults."""
    return {
        "name": program.name,
        "guard": f"{program.name.upper()}_H",
        "version": product_version(),
        "pace": _format_pace(program),
        "step": _describe_step(program),
        "modes": [(mode_constant(program, mode.number), mode.number) for mode in program.modes],
        "regions": [
            (
                info.name,
                [(mode_constant(program, m.number, info.name), m.number) for m in info.modes],
            )
            for info in program.regions
        ],
        "numbered": [(c, number) for number, c in transition_constants(program).items()],
        "run_modes": [(run_mode_constant(program, m.number), m.number) for m in program.run_modes],
        "enumerations": [
            (name, [(value_constant(program, values, n), n) for n in range(len(values))])
            for name, values in enumerations(program)
        ],
        "faults": [
            (bit, fault, fault_reason(program, fault)) for bit, fault in enumerate(program.faults)
        ],
        "transitions": program.transitions,
        "real": C_REAL_TYPE[program.number_type],
        "suffix": MATH_SUFFIX[program.number_type],
    }


def _format_pace(program: Program) -> str:
    """Return the comment with the period, or with the major step of a continuous automaton."""
    if program.period is None:
        return f"Major step: {program.major_step} s"
    return f"Period: {program.period} s"


def _describe_step(program: Program) -> str:
    """Return the comment of the function that executes one step."""
    if program.period is None:
        return (
            f"{program.major_step} s of flow under the inputs of the step before, then those of now"
        )
    return f"One tick of {program.period} s"


def _shared_work_variables(program: Program, local: Mapping[str, Iterable[str]]) -> list[Variable]:
    """Return the work variables of a step that are not local to one function."""
    inside = {name for names in local.values() for name in names}
    return [v for v in program.variables if v.name.startswith("work.") and v.name not in inside]


def _work_type(program: Program, page_layout: PageLayout, scratch: Scratch | None) -> str:
    """Return the C type of the work variables of a step.

    It has the name of the module if it is public.
    """
    is_seen = page_layout.holds_solved and scratch is not None and scratch.is_in_instance
    return f"{program.name}_Work" if is_seen else "Work"


def _scratch_context(
    program: Program, scratch: Scratch, kinds: Mapping[str, str]
) -> dict[str, Any]:
    """Return the template context of the work variables of a step."""
    return {
        "block": scratch.block,
        "begun": _initial_assignments(program, scratch, kinds),
        "is_in_instance": scratch.is_in_instance,
    }


def _initial_assignments(
    program: Program, scratch: Scratch, kinds: Mapping[str, str]
) -> list[tuple[str, str]] | None:
    """Return pairs of a work variable and the zero that it is set to at the start of a step.

    Returns None if the whole structure is set to zero.
    """
    if scratch.is_zeroed:
        return None
    zero = {
        "bool": "false",
        C_REAL_TYPE[program.number_type]: format_literal(0.0, program.number_type),
    }
    return [(c_member(v.name), zero.get(kinds[v.name], "0")) for v in scratch.initialised]


def _emit_functions(
    program: Program,
    local: Mapping[str, frozenset[str]],
    loop_variables: Mapping[str, frozenset[str]],
    usage_by_block: Mapping[str, Usage],
    kinds: Mapping[str, str],
    page_layout: PageLayout,
    scratch: Scratch | None,
) -> list[dict[str, Any]]:
    """Return the template contexts of all functions, callees first."""
    modes, run_modes = ([m.name for m in of] for of in (program.modes, program.run_modes))
    functions = []
    calls = {name: called_blocks(block) for name, block in program.blocks.items()}
    for name in post_order(calls):
        mark = program.inlining.get(name)
        keyword = INLINE_KEYWORDS[mark] if mark else "inline"
        function = _emit_function(
            program,
            name,
            local[name],
            loop_variables[name],
            usage_by_block,
            kinds,
            page_layout,
            scratch,
            keyword,
        )
        functions.append(
            {**function, "purpose": describe_function(name, modes, run_modes), "keyword": keyword}
        )
    return functions


def _emit_function(
    program: Program,
    name: str,
    local: frozenset[str],
    loop_variables: frozenset[str],
    usage_by_block: Mapping[str, Usage],
    kinds: Mapping[str, str],
    page_layout: PageLayout,
    scratch: Scratch | None,
    keyword: str,
) -> dict[str, Any]:
    """Return the template context of the function of one block: its parameters and lines."""
    c_names = _names_in_function(program, local, page_layout)
    writer = StatementEmitter(program, usage_by_block, local - loop_variables, c_names, kinds)
    declared = [f"{INDENT}{kinds[n]} {c_member(n)};" for n in sorted(loop_variables)]
    types = {
        "self": f"{program.name}_Self",
        "cal": f"{program.name}_Cal",
        "in": f"{program.name}_In",
        "work": _work_type(program, page_layout, scratch),
    }
    qualifiers = dict.fromkeys(types, "const ") | {"cal": f"{page_layout.qualifiers} "}
    usage = usage_by_block[name]
    parameters = [
        f"{'' if pointer in usage.writes else qualifiers[pointer]}{types[pointer]} *{pointer}"
        for pointer in usage.parameters
    ]
    return {
        "name": name,
        "parameters": _format_parameters(f"static {keyword} void {name}(", parameters),
        "needs": usage.needs,
        "lines": [
            *(declared and [*declared, ""]),
            *(_redirect_derived(name, line) for line in writer.emit_block(program.blocks[name])),
        ],
    }


def _format_parameters(opening: str, parameters: Sequence[str]) -> str:
    """Return the text between the parentheses of a function, broken into lines.

    A line has at most MAX_LINE_WIDTH characters.
    """
    lines = [""]
    for place, parameter in enumerate(parameters):
        text = parameter + ("," if place + 1 < len(parameters) else "")
        start = opening if len(lines) == 1 else INDENT
        if lines[-1] and len(start) + len(lines[-1]) + len(text) + 2 > MAX_LINE_WIDTH:
            lines.append("")
        lines[-1] += f" {text}" if lines[-1] else text
    return f"\n{INDENT}".join(lines) if parameters else "void"


def _redirect_derived(block: str, line: str) -> str:
    """Return a line of a function; `X_Derive` writes derived constants through its own pointer."""
    return line.replace("self->derived.", "derived->") if block == "derive" else line
