"""Constant folding and hoisting (decision 0001): three passes, each from Program to Program.

    parameters    x = p * q * y    ->    x = p_q * y
                  p_q becomes a constant, or a derived parameter if p or q is tunable
                  x = y / p        ->    x = y * per_p
    inputs        an expression of inputs and constants is computed in the block `latch`
    program       common subexpressions are named (common_subexpressions.py)

Both back ends run the resulting Program, so both have its bits.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping
from typing import Literal

from language.ir.expression_type import is_whole
from language.ir.formula_name import format_formula, formula_name
from language.ir.number_type import NumberType
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Expr,
    Op,
    Ref,
    Unary,
    Value,
)
from language.ir.printer import format_expr
from language.ir.program import Constant, Program, Variable
from language.ir.rewrite_ops import map_expressions, map_operands, operands
from language.ir.traversal import block_writes, expr_names, names_used
from language.numerics.evaluate import Scalar, evaluate
from language.passes.common_subexpressions import CHEAP_FUNCTIONS, eliminate_common_subexpressions

SMALLEST_NORMAL: Mapping[NumberType, float] = {"float64": 2.0**-1022, "float32": 2.0**-126}
"""The smallest normal number; a smaller reciprocal has lost digits and is not used."""
EXCLUDED_BLOCKS = ("derive", "init", "start", "compare_stamps", "latch")
"""Blocks that run once, and the blocks that compute hoisted values."""
CONSTANT_PREFIX = "constant."
TUNABLE_PREFIXES = ("calibration.", "derived.")
LATCHED_PREFIX = "before."
LATCH_BLOCK = "latch"


def run_passes(program: Program) -> Program:
    """Return the Program after all passes of PASSES: parameters, inputs, program."""
    for run in PASSES.values():
        program = run(program)
    return program


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
    found = _HoistedValues(program)

    def is_latched(name: str) -> bool | None:
        """Return True for a latched input, None for a fixed constant and False otherwise."""
        return name in latched or (None if name.startswith(CONSTANT_PREFIX) else False)

    def change(expr: Expr) -> Expr:
        """Return the reference to the hoisted value of an expression."""
        return found.ref_to(LATCHED_PREFIX, expr)

    blocks = _replace_hoistable(program, is_latched, change)
    ops = [Assign(name, expr, format_formula(expr)) for name, expr in found.expressions.items()]
    looks, once = _recompute_if_changed(program, ops)
    blocks[LATCH_BLOCK] = (*looks, *blocks[LATCH_BLOCK], *once)
    variables = [Variable(op.target, "real", about=op.key) for op in ops]
    variables += [Variable(op.target, "truth") for op in looks]
    return _replace(program, blocks=blocks, variables=(*program.variables, *variables))


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
        if not any(name.startswith("call ") and name[5:] not in CHEAP_FUNCTIONS for name in read):
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


def fold_parameters(program: Program) -> Program:
    """Return a Program in which expressions of parameters are constants or derived parameters.

        x = constant.p * constant.q * state.y    ->    x = constant.p_q * state.y
        x = calibration.p * constant.q           ->    x = derived.p_q    (block `derive`)
        x = state.y / constant.p                 ->    x = state.y * constant.per_p

    Only real operations on real parameters that are no tables are folded, in all blocks but
    EXCLUDED_BLOCKS. A value that is not finite is not folded, and a reciprocal below
    SMALLEST_NORMAL or not finite is not used.
    """
    number = program.number_type
    values: dict[str, Scalar] = {c.name: c.value for c in program.constants if not c.items}
    real = {c.name for c in program.constants if c.type == "real" and not c.items}
    found = _HoistedValues(program)

    def is_parameter(name: str) -> bool | None:
        """Return whether a name is a real parameter without a table."""
        return name in real and name.startswith((CONSTANT_PREFIX, *TUNABLE_PREFIXES))

    def change(expr: Expr) -> Expr:
        """Return the reference to the value of an expression; one that is not finite stays."""
        value = float(evaluate(expr, values, number))
        if not math.isfinite(value):
            return expr
        is_fixed = all(name.startswith((CONSTANT_PREFIX, "call ")) for name in expr_names(expr))
        ref = found.ref_to(CONSTANT_PREFIX if is_fixed else "derived.", expr)
        values[ref.name] = value
        return ref

    def reciprocal(divisor: Expr) -> Expr | None:
        """Return the reference to 1/divisor; None if it is not a normal number."""
        inverse = Binary("/", Value(1.0), divisor)
        size = abs(float(evaluate(inverse, values, number)))
        is_normal = SMALLEST_NORMAL[number] <= size < math.inf
        return change(inverse) if is_normal else None

    blocks = _replace_hoistable(program, is_parameter, change, reciprocal)
    constants, derived = [], []
    for name, expr in found.expressions.items():
        is_fixed, text = name.startswith(CONSTANT_PREFIX), format_formula(expr)
        kind: Literal["fixed", "derived"] = "fixed" if is_fixed else "derived"
        constants.append(Constant(name, kind, float(values[name]), unit="", about=text))
        if not is_fixed:
            derived.append(Assign(name, expr, text))
    if derived:
        blocks["derive"] = (*blocks.get("derive", ()), *derived)
    return _replace(program, blocks=blocks, constants=(*program.constants, *constants))


def eliminate_redundancy(program: Program) -> Program:
    """Return a Program without common subexpressions and without unused fixed parameters.

    Unused are constants `constant.<name>` that no block names; tunable and derived ones stay.
    """
    return _remove_unused_constants(eliminate_common_subexpressions(program))


def _remove_unused_constants(program: Program) -> Program:
    """Return the Program without the fixed parameters that no block reads."""
    used = names_used(program.blocks.values())
    constants = tuple(
        c for c in program.constants if c.name in used or not c.name.startswith(CONSTANT_PREFIX)
    )
    return _replace(program, constants=constants)


class _HoistedValues:
    """The names and expressions of hoisted values."""

    def __init__(self, program: Program) -> None:
        names = [v.name for v in program.variables] + [c.name for c in program.constants]
        names += [f"block.{name}" for name in program.blocks]
        self._used_names = {name.partition(".")[2].lower() for name in names}
        self._names: dict[str, str] = {}
        self.expressions: dict[str, Expr] = {}

    def ref_to(self, group: str, expr: Expr) -> Ref:
        """Return a reference to the hoisted value of an expression, with a new name if needed.

        `group` is the prefix of the name. Equal expressions share one name.
        """
        text = format_expr(expr)
        if text not in self._names:
            base = formula_name(expr)
            name, number = base, 1
            while name.lower() in self._used_names:
                number += 1
                name = f"{base}_{number}"
            self._used_names.add(name.lower())
            self._names[text] = group + name
            self.expressions[group + name] = expr
        return Ref(self._names[text])


def _replace_hoistable(
    program: Program,
    is_hoistable_name: Callable[[str], bool | None],
    hoist: Callable[[Expr], Expr],
    reciprocal: Callable[[Expr], Expr | None] = lambda divisor: None,
) -> dict[str, Block]:
    """Return the blocks of a Program with the largest hoistable expressions replaced.

    `is_hoistable_name` returns True if a name is a reason to hoist, None if it permits hoisting,
    False if it prevents it. `hoist` returns the replacement of an expression; `reciprocal` returns
    the inverse of a hoistable divisor or None.
    """

    def visit(expr: Expr) -> tuple[Expr, bool | None]:
        """Return an expression with its parts changed, and whether it can be hoisted itself."""
        match expr:
            case Value():
                return expr, None
            case Ref(name):
                return expr, is_hoistable_name(name)
            case Unary("-") | Binary() | Call():
                inner = [visit(part) for part in operands(expr)]
                kinds = [kind for _, kind in inner]
                if False not in kinds:
                    return expr, True if True in kinds else None
                return _with_changed(expr, inner), False
            case _:
                return map_operands(expr, lambda part: hoist_if_real(*visit(part))), False

    def hoist_if_real(expr: Expr, kind: bool | None) -> Expr:
        """Return the replacement of an expression that can be hoisted and computes a real."""
        return hoist(expr) if kind and _is_real_operation(expr) else expr

    def _with_changed(expr: Expr, inner: list[tuple[Expr, bool | None]]) -> Expr:
        """Return an expression with its hoistable operands replaced, a division by a product."""
        if isinstance(expr, Binary) and expr.operator == "/" and inner[1][1]:
            inverse = reciprocal(inner[1][0])
            if inverse is not None:
                return Binary("*", hoist_if_real(*inner[0]), inverse)
        pending = iter(inner)
        return map_operands(expr, lambda _: hoist_if_real(*next(pending)))

    return {
        name: block
        if name in EXCLUDED_BLOCKS
        else map_expressions(block, lambda e: hoist_if_real(*visit(e)))
        for name, block in program.blocks.items()
    }


def _is_real_operation(expr: Expr) -> bool:
    """Return whether an expression is arithmetic on reals; a sign alone does not count."""
    if isinstance(expr, Unary):
        return expr.operator == "-" and _is_real_operation(expr.operand)
    if isinstance(expr, Binary):
        return expr.operator in "+-*/" and not is_whole(expr)
    return isinstance(expr, Call) and expr.function != "whole"


def _replace(program: Program, **changes: object) -> Program:
    """Return the Program with some fields replaced."""
    return dataclasses.replace(program, **changes)  # type: ignore[arg-type]


PASSES: Mapping[str, Callable[[Program], Program]] = {
    "parameters": fold_parameters,
    "inputs": hoist_inputs,
    "program": eliminate_redundancy,
}
"""The passes in their order, by the names that `modewright explain --pass` accepts."""
