"""Parameter folding: the pass that computes expressions of parameters beforehand (decision 0001).

before                                      after
x := (constant.p * constant.q * state.y)    x := (constant.p_q * state.y)
y := (calibration.p * constant.q)           y := derived.p_q, and in the block derive
                                            derived.p_q := (calibration.p * constant.q)
z := (state.y / constant.p)                 z := (state.y * constant.per_p)

A value of fixed parameters becomes a constant. A value of tunable ones becomes a derived parameter,
which is computed again when the calibration changes. Both back ends run the resulting Program, so
both have its bits.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Literal

from language.ir.formula_name import format_formula
from language.ir.number_type import NumberType
from language.ir.ops import Assign, Binary, Expr, Value
from language.ir.program import Constant, Program
from language.ir.traversal import expr_names
from language.numerics.evaluate import Scalar, evaluate
from language.passes.hoisting import CONSTANT_PREFIX, HoistedValues, replace_hoistable

SMALLEST_NORMAL: Mapping[NumberType, float] = {"float64": 2.0**-1022, "float32": 2.0**-126}
"""The smallest normal number; a smaller reciprocal has lost digits and is not used."""
TUNABLE_PREFIXES = ("calibration.", "derived.")
"""Prefixes of the names of parameters that may change after code generation."""


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
    found = HoistedValues(program)

    def is_parameter(name: str) -> bool | None:
        """Return whether a name is a real parameter without a table."""
        return name in real and name.startswith((CONSTANT_PREFIX, *TUNABLE_PREFIXES))

    def change(expr: Expr) -> Expr:
        """Return the reference to the value of an expression; one that is not finite stays."""
        value = float(evaluate(expr, values, number))
        if not math.isfinite(value):
            return expr
        is_fixed = all(name.startswith(CONSTANT_PREFIX) for name in expr_names(expr))
        ref = found.ref_to(CONSTANT_PREFIX if is_fixed else "derived.", expr)
        values[ref.name] = value
        return ref

    def reciprocal(divisor: Expr) -> Expr | None:
        """Return the reference to 1/divisor; None if it is not a normal number."""
        inverse = Binary("/", Value(1.0), divisor)
        size = abs(float(evaluate(inverse, values, number)))
        is_normal = SMALLEST_NORMAL[number] <= size < math.inf
        return change(inverse) if is_normal else None

    blocks = replace_hoistable(program, is_parameter, change, reciprocal)
    constants, derived = [], []
    for name, expr in found.expressions.items():
        is_fixed, text = name.startswith(CONSTANT_PREFIX), format_formula(expr)
        kind: Literal["fixed", "derived"] = "fixed" if is_fixed else "derived"
        constants.append(Constant(name, kind, float(values[name]), unit="", about=text))
        if not is_fixed:
            derived.append(Assign(name, expr, text))
    if derived:
        blocks["derive"] = (*blocks.get("derive", ()), *derived)
    return dataclasses.replace(program, blocks=blocks, constants=(*program.constants, *constants))
