"""Assigns contracts: the variables that functions may write which the transitions of a mode run.

WP replaces a call by the contract of the called function. The numbers that a rewind computes
therefore do not enter the proof of a mode. The clause `assigns` lists all variables that the
function may write, from the Program; it is proven for the function and for its loops. All work
variables of a step are one location.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from codegen.emit.c_names import SOLVED_PREFIX_ON_PAGE, CNames
from codegen.passes.block_usage import locals_of
from codegen.proofs.acsl.function_outlining import Function, function_of
from language.ir.program import Program
from language.ir.traversal import block_writes, reachable_blocks

SCRATCH = "_Work *const work = &self->work;"
"""A line of C that occurs if the work variables of a step are in the instance."""


def is_inside(text: str) -> bool:
    """Tell whether the C of a module keeps the work variables of a step in the instance."""
    return SCRATCH in text


def required(parameters: str, work_is_inside: bool) -> Iterator[str]:
    """Yield `requires` clauses: the pointers of a function are valid and do not overlap.

    With `work_is_inside` the pointer `work` points into `self`.
    """
    pointers = re.findall(r"(const [^,*]*)?\*(\w+)", parameters)
    names = [name for _, name in pointers]
    for constant, name in pointers:
        yield f"requires \\valid{'_read' if constant else ''}({name});"
    if work_is_inside and "self" in names and "work" in names:
        yield "requires work == &self->work;"
        names.remove("work")
    if len(names) > 1:
        yield f"requires \\separated({', '.join(names)});"


LOOP = re.compile(r"^( *)for \(int32_t (\w+) = 0; \w+ < (\d+); \w+\+\+\) \{$", re.M)

LOCAL = re.compile(r"^    (?!const |return )\w+ (\w+)(?: = [^;]+)?;$", re.M)

NOTHING = "\\nothing"

STEP = "*work"
"""The location of all work variables of a step."""


def called_by(program: Program, blocks: Iterable[str]) -> list[str]:
    """Return the sorted blocks that some blocks run, directly or indirectly, without these."""
    given = tuple(blocks)
    inside = {name for block in given for name in reachable_blocks(block, program.blocks)}
    return sorted(inside - set(given))


def places_of(program: Program, block: str) -> list[str]:
    """Return the sorted C locations that a block and the blocks that it runs may write."""
    local = locals_of(program)
    names = {
        name
        for inner in reachable_blocks(block, program.blocks)
        for name in block_writes(program.blocks[inner])
        if name not in local[inner]
    }
    place = CNames(program, frozenset(), SOLVED_PREFIX_ON_PAGE)
    sizes = {v.name: f"[0 .. {v.size - 1}]" for v in program.variables if v.size}
    found = {STEP if n.startswith("work.") else place(n) + sizes.get(n, "") for n in names}
    return sorted(found)


def add_effect_contracts(program: Program, text: str, called: Iterable[str]) -> str:
    """Return the C of a Program with an `assigns` contract before each function in `called`."""
    inside = is_inside(text)
    for name in called:
        function, places = function_of(text, name), places_of(program, name)
        seen = assigned(seen_of(function, places))
        lines = [*required(function.parameters, inside), seen, "exits \\false;"]
        told = contract_text(lines) + add_loop_assigns(function, places)
        text = text[: function.start] + told + text[function.end :]
    return text


def seen_of(function: Function, places: Iterable[str]) -> list[str]:
    """Return the locations that a caller sees: work variables only if they are a parameter."""
    has_step = re.search(r"\bwork\b", function.parameters) is not None
    return [place for place in places if place != STEP or has_step]


def assigned(places: Iterable[str]) -> str:
    """Return the `assigns` clause for some locations; `\\nothing` if there are none."""
    return f"assigns {', '.join(places) or NOTHING};"


def contract_text(lines: Iterable[str]) -> str:
    """Return a contract as a C comment with the given clauses."""
    return "\n  ".join(["/*@", *lines]) + "\n*/\n"


def add_loop_assigns(function: Function, places: Iterable[str], held: Iterable[str] = ()) -> str:
    """Return the C of a function with invariants and `assigns` clauses of its loops.

    A loop may write its index, local variables and `places`; `held` are further loop invariants.
    """
    own, more = LOCAL.findall(function.body), [f"loop invariant {said};" for said in held]

    def told(found: re.Match[str]) -> str:
        indent, index, count = found.groups()
        lines = [
            f"loop invariant 0 <= {index} <= {count};",
            *more,
            f"loop {assigned((index, *own, *places))}",
            f"loop variant {count} - {index};",
        ]
        return f"{indent}/*@ {' '.join(lines)} */\n{found[0]}"

    return function.with_body(LOOP.sub(told, function.body)).text
