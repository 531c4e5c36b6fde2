"""Source: a Program as C99 - header, source, mathematics (rules C12 and C13)."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from codegen.expression import SUFFIX, literal
from codegen.fault import why_set
from codegen.frame import apart
from codegen.gate import LATCH_EACH, gated
from codegen.leap import THROUGH, Leaps, leaping
from codegen.mathematics import math_files
from codegen.member import CONSTANTS, PAGE, Page, field_of, members
from codegen.names import (
    REAL,
    SOLVED_APART,
    SOLVED_ON_PAGE,
    CNames,
    c_member,
    c_type,
    enumerations,
    mode_constant,
    run_mode_constant,
    transition_constants,
    value_constant,
)
from codegen.purpose import purpose
from codegen.rendering import render, version
from codegen.scratch import STEP, Scratch, scratch_of, with_own
from codegen.statement import INDENT, WIDTH, Writer
from codegen.unread import without_unread
from codegen.usage import Usage, locals_of, turning, usages
from language.functions import FUNCTIONS_OF
from language.invariant import GROUP, INVARIANTS
from language.operation import Run
from language.printing import digest
from language.program import (
    Program,
    Variable,
)
from language.traversal import reads, walk
from language.wiring import finished

ENTRIES = ("init", "derive", "step")
RARE = (LATCH_EACH, THROUGH, "back_")
"""Blocks that are kept out of the way of what a step does nearly always."""
NOT_INLINED = {
    "RARELY": "Runs rarely: not inlined",
    "NOT_INLINED": "Computes much: its values are on the stack only while it runs",
}
"""Keywords of functions of a module, with why."""
STATIC = rf"static (?:{'|'.join(('inline', *NOT_INLINED))}) "
"""How the definition of such a function begins, as a pattern."""
INLINE = ("min", "max", "clip", "sign", "pow2", "whole", "within", "lookup", "lookup2")


def c_files(program: Program, by_amount: bool = True, leaps: Leaps = "on") -> dict[str, str]:
    """Return the generated files of a Program by name: one that has a `step`.

    `by_amount` as in `gated`, `leaps` as in `leaping`. A continuous automaton has none where an
    input varies inside a step: then ValueError.
    """
    if "step" not in program.blocks:
        raise ValueError(f"inputs of {program.name} vary inside a step: it has no C")
    context = {
        **module_context(c_program(program, by_amount, leaps), PAGE),
        "digest": digest(program),
    }
    files = {
        f"{program.name}.h": render("module.h.jinja", context),
        f"{program.name}_MemMap.h": render("memory_map.h.jinja", context),
        f"{program.name}.c": render("module.c.jinja", context),
    }
    if context["uses_math"]:
        files.update(math_files(program.number))
    return files


def c_program(program: Program, by_amount: bool = True, leaps: Leaps = "on") -> Program:
    """Return the Program that C is printed of: the same bits, in the way that suits C."""
    return leaping(gated(without_unread(stepped(program), ("work.",)), by_amount), leaps)


def stepped(program: Program) -> Program:
    """Return a Program with only what its `step` runs, as the C has it: no invariants."""
    if program.period is None:
        return finished(program, ENTRIES)
    blocks = {name: block for name, block in program.blocks.items() if name != INVARIANTS}
    variables = tuple(v for v in program.variables if not v.name.startswith(GROUP))
    return dataclasses.replace(program, blocks=blocks, variables=variables)


def module_context(program: Program, page: Page = CONSTANTS) -> dict[str, Any]:
    """Return what the templates of a Program's files read."""
    number = program.number
    turned = turning(program)
    local = locals_of(program, turned)
    used = usages(program, local, page.holds)
    kinds = {variable.name: c_type(variable, program.number) for variable in program.variables}
    called = {name.removeprefix("call ") for name in reads(program.blocks.values()) if " " in name}
    shared = _work(program, local)
    scratch = scratch_of(program, shared, used, page.holds_solved)
    if scratch and scratch.block != STEP:
        used = with_own(program, used, scratch)
    blocks = _blocks(program, local, turned, used, kinds, page, scratch)
    return {
        **_names(program),
        **members(program, page),
        "work": [field_of(variable, number) for variable in shared],
        "scratch": scratch and _scratch(program, scratch, kinds),
        "work_type": _work_type(program, page, scratch),
        "calls": {block: f"{block}({', '.join(used[block].parameters)})" for block in used},
        "blocks": [block for block in blocks if block["name"] not in ENTRIES],
        "entries": {block["name"]: block for block in blocks if block["name"] in ENTRIES},
        "keywords": [
            (word, why)
            for word, why in NOT_INLINED.items()
            if any(block["keyword"] == word for block in blocks)
        ],
        "has_stamps": "compare_stamps" in program.blocks,
        "uses_math": bool(called & {*FUNCTIONS_OF[number], *INLINE}),
        "uses_libm": bool(called & {"abs", "sqrt", "floor"}),
    }


def _names(program: Program) -> dict[str, Any]:
    """What the files are called, and the numbers that have names."""
    return {
        "name": program.name,
        "guard": f"{program.name.upper()}_H",
        "version": version(),
        "pace": _pace(program),
        "step": _step(program),
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
            (bit, fault, why_set(program, fault)) for bit, fault in enumerate(program.faults)
        ],
        "transitions": program.transitions,
        "real": REAL[program.number],
        "suffix": SUFFIX[program.number],
    }


def _pace(program: Program) -> str:
    if program.period is None:
        return f"Major step: {program.major_step} s"
    return f"Period: {program.period} s"


def _step(program: Program) -> str:
    if program.period is None:
        return (
            f"{program.major_step} s of flow under the inputs of the step before, then those of now"
        )
    return f"One tick of {program.period} s"


def _work(program: Program, local: Mapping[str, Iterable[str]]) -> list[Variable]:
    inside = {name for names in local.values() for name in names}
    return [v for v in program.variables if v.name.startswith("work.") and v.name not in inside]


def _work_type(program: Program, page: Page, scratch: Scratch | None) -> str:
    """Return the type of a step's values: where others see it, with the name of the module."""
    is_seen = page.holds_solved and scratch is not None and scratch.is_in_instance
    return f"{program.name}_Work" if is_seen else "Work"


def _scratch(program: Program, scratch: Scratch, kinds: Mapping[str, str]) -> dict[str, Any]:
    return {
        "block": scratch.block,
        "begun": _begun(program, scratch, kinds),
        "is_in_instance": scratch.is_in_instance,
    }


def _begun(
    program: Program, scratch: Scratch, kinds: Mapping[str, str]
) -> list[tuple[str, str]] | None:
    """Return what is set when a step begins, and to what; None where all of it is."""
    if scratch.is_cleared:
        return None
    zero = {"bool": "false", REAL[program.number]: literal(0.0, program.number)}
    return [(c_member(v.name), zero.get(kinds[v.name], "0")) for v in scratch.early]


def _blocks(
    program: Program,
    local: Mapping[str, frozenset[str]],
    turned: Mapping[str, frozenset[str]],
    used: Mapping[str, Usage],
    kinds: Mapping[str, str],
    page: Page,
    scratch: Scratch | None,
) -> list[dict[str, Any]]:
    """Return the functions of a module, those that are called first."""
    own = apart(program)
    modes, run_modes = ([m.name for m in of] for of in (program.modes, program.run_modes))
    found = []
    for name in _callees_first(program):
        word = _keyword(name, own)
        block = _block(program, name, local[name], turned[name], used, kinds, page, scratch, word)
        found.append({**block, "purpose": purpose(name, modes, run_modes), "keyword": word})
    return found


def _block(
    program: Program,
    name: str,
    local: frozenset[str],
    turned: frozenset[str],
    used: Mapping[str, Usage],
    kinds: Mapping[str, str],
    page: Page,
    scratch: Scratch | None,
    keyword: str,
) -> dict[str, Any]:
    place = CNames(program, local, SOLVED_ON_PAGE if page.holds_solved else SOLVED_APART)
    writer = Writer(program, used, local - turned, place, kinds)
    declared = [f"{INDENT}{kinds[n]} {c_member(n)};" for n in sorted(turned)]
    types = {
        "self": f"{program.name}_Self",
        "cal": f"{program.name}_Cal",
        "in": f"{program.name}_In",
        "work": _work_type(program, page, scratch),
    }
    qualifiers = dict.fromkeys(types, "const ") | {"cal": f"{page.qualifiers} "}
    usage = used[name]
    parameters = [
        f"{'' if pointer in usage.writes else qualifiers[pointer]}{types[pointer]} *{pointer}"
        for pointer in usage.parameters
    ]
    return {
        "name": name,
        "parameters": _listed(f"static {keyword} void {name}(", parameters),
        "needs": usage.needs,
        "lines": [
            *(declared and [*declared, ""]),
            *(_in_derive(name, line) for line in writer.lines(program.blocks[name])),
        ],
    }


def _keyword(name: str, own: frozenset[str]) -> str:
    if name.startswith(RARE):
        return "RARELY"
    return "NOT_INLINED" if name in own else "inline"


def _listed(opening: str, parameters: Sequence[str]) -> str:
    """Return what stands between the parentheses of a function, in lines that are not too long."""
    lines = [""]
    for place, parameter in enumerate(parameters):
        text = parameter + ("," if place + 1 < len(parameters) else "")
        start = opening if len(lines) == 1 else INDENT
        if lines[-1] and len(start) + len(lines[-1]) + len(text) + 2 > WIDTH:
            lines.append("")
        lines[-1] += f" {text}" if lines[-1] else text
    return f"\n{INDENT}".join(lines) if parameters else "void"


def _in_derive(block: str, line: str) -> str:
    """`X_Derive` writes through its own pointer, not through an instance."""
    return line.replace("self->derived.", "derived->") if block == "derive" else line


def _callees_first(program: Program) -> list[str]:
    """Return the blocks so that each comes after those that it runs: no prototypes needed."""
    done: dict[str, None] = {}

    def visit(name: str) -> None:
        if name in done:
            return
        for called in _runs(program, name):
            visit(called)
        done[name] = None

    for name in program.blocks:
        visit(name)
    return list(done)


def _runs(program: Program, name: str) -> list[str]:
    return [op.block for op in walk(program.blocks[name]) if isinstance(op, Run)]
