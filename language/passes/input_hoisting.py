"""Input hoisting: the pass that computes expressions of inputs where the inputs are latched.

before                                      after
block rates                                 block latch
    x := (before.u * constant.k * state.y)      before.u_k := (before.u * constant.k)
                                            block rates
                                                x := (before.u_k * state.y)

Inputs of a continuous automaton are constant between two latches, so a step computes such an
expression once and not at each evaluation of a rate.
"""

from __future__ import annotations

import dataclasses

from language.ir.formula_name import format_formula
from language.ir.ops import Assign, Binary, Branch, Compare, Expr, Op, Ref, Unary
from language.ir.program import Program, Variable
from language.ir.traversal import block_writes, expr_functions, expr_names
from language.passes.common_subexpressions import CHEAP_FUNCTIONS
from language.passes.hoisting import CONSTANT_PREFIX, HoistedValues, replace_hoistable

LATCHED_PREFIX = "before."
LATCH_BLOCK = "latch"


def hoist_inputs(program: Program) -> Program:
    """Return a continuous Program whose expressions of inputs are computed in the block `latch`.

        x = before.u * k * state.y    ->    latch: before.u_k = before.u * k
                                            x = before.u_k * state.y

    Only real operations on latched inputs and fixed constants are hoisted, since the calibration
    page may change between two latches. An expression with a call other than CHEAP_FUNCTIONS is
    recomputed only at the start and after a change of an input that it reads. EXCLUDED_BLOCKS are
    unchanged. A sampled Program is returned unchanged.
    """
    if program.period is not None:
        return program
    latched = set(block_writes(program.blocks[LATCH_BLOCK]))
    found = HoistedValues(program)

    def is_latched(name: str) -> bool | None:
        """Return True for a latched input, None for a fixed constant and False otherwise."""
        return name in latched or (None if name.startswith(CONSTANT_PREFIX) else False)

    def change(expr: Expr) -> Expr:
        """Return the reference to the hoisted value of an expression."""
        return found.ref_to(LATCHED_PREFIX, expr)

    blocks = replace_hoistable(program, is_latched, change)
    ops = [Assign(name, expr, format_formula(expr)) for name, expr in found.expressions.items()]
    looks, once = _recompute_if_changed(program, ops)
    blocks[LATCH_BLOCK] = (*looks, *blocks[LATCH_BLOCK], *once)
    variables = [Variable(op.target, "real", about=op.key) for op in ops]
    variables += [Variable(op.target, "truth") for op in looks]
    return dataclasses.replace(program, blocks=blocks, variables=(*program.variables, *variables))


def _recompute_if_changed(program: Program, ops: list[Assign]) -> tuple[list[Assign], list[Op]]:
    """Return two lists: tests whether inputs change, and the recomputation of hoisted values.

    The tests run before the inputs are latched. An expression that calls a costly function is
    recomputed only at the start and after a change of an input that it reads.
    """
    whole = {
        v.name: v.type == "whole" for v in program.variables if v.name.startswith(LATCHED_PREFIX)
    }
    looks: dict[str, Assign] = {}
    found: list[Op] = []
    for op in ops:
        read = dict.fromkeys(expr_names(op.value))
        if set(expr_functions(op.value)) <= {*CHEAP_FUNCTIONS}:
            found.append(op)
            continue
        is_due: Expr = Unary("not", Ref("memory.started"))
        for before in (name for name in read if name in whole):
            name = before.removeprefix(LATCHED_PREFIX)
            now = Ref(f"input.{name}", whole[before])
            is_other = Compare("!=", now, Ref(before, whole[before]))
            looks[name] = Assign(f"work.changed_{name}", is_other)
            is_due = Binary("or", is_due, Ref(f"work.changed_{name}"))
        found.append(Branch(is_due, (op,)))
    return list(looks.values()), found
