"""The filter and the quantisation of sensors as a Program (rule 19c).

Its blocks are one assignment each, so that a driver can also print them as expressions:

    decay       `signal.decay`, the part of a deviation that rests after `signal.elapsed`
    lag         the result, the filtered input
    quantise    the result, the nearest multiple of the resolution
"""

from __future__ import annotations

import sys
from functools import cache

from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Call,
    Compare,
    Expr,
    Ref,
    Select,
    Unary,
    add,
    divide,
    multiply,
    real,
    subtract,
)
from language.ir.program import Program, Variable
from language.lowering.program_builder import FORMULA_RESULT, formula_program

DECAY = "signal.decay"
"""The part of a deviation that rests; the block `decay` sets it."""
INPUT, LAST_INPUT, LAST_OUTPUT = "signal.input", "signal.last_input", "signal.last_output"
"""The input, the input of the last point and the output there [SI]."""
ELAPSED, TIME_CONSTANT, RESOLUTION = "signal.elapsed", "signal.time_constant", "signal.resolution"
"""The time since the last point [s], the time constant of the filter [s] and the resolution."""


@cache
def sensor_program() -> Program:
    """Return the Program of the filter and the quantisation, in float64."""
    blocks: dict[str, Block] = {
        "decay": (Assign(DECAY, _decay()),),
        "lag": (Assign(FORMULA_RESULT, _lagged()),),
        "quantise": (Assign(FORMULA_RESULT, _quantised()),),
    }
    names = (DECAY, INPUT, LAST_INPUT, LAST_OUTPUT, ELAPSED, TIME_CONSTANT, RESOLUTION)
    return formula_program("sensors", [Variable(name, "real") for name in names], blocks)


def _decay() -> Expr:
    """Return e^(-h / L) of the elapsed time h and the time constant L."""
    return Call("exp", (Unary("-", divide(Ref(ELAPSED), Ref(TIME_CONSTANT))),))


def _lagged() -> Expr:
    """Return the output of the first-order lag L y' = u - y.

    It is exact for an input u that is linear since the last point. With u = u0 + r s it is
    y(h) = u(h) - r L + (y0 - u0 + r L) e^(-h / L). The output is the last one if no time has
    elapsed, or one that is too short to divide by it.
    """
    value, last, output = Ref(INPUT), Ref(LAST_INPUT), Ref(LAST_OUTPUT)
    steps = divide(Ref(TIME_CONSTANT), Ref(ELAPSED))
    slope = multiply(subtract(value, last), steps)
    deviation = multiply(add(subtract(output, last), slope), Ref(DECAY))
    has_moved = Binary("and", Compare(">", Ref(ELAPSED), real(0.0)), _is_finite(steps))
    return Select(has_moved, add(subtract(value, slope), deviation), output)


def _quantised() -> Expr:
    """Return floor(x / q + 1/2) * q; an input that is not finite is unchanged."""
    value, resolution = Ref(INPUT), Ref(RESOLUTION)
    steps = Call("floor", (add(divide(value, resolution), real(0.5)),))
    return Select(_is_finite(value), multiply(steps, resolution), value)


def _is_finite(value: Expr) -> Expr:
    """Return the condition that a value is neither an infinity nor a NaN."""
    return Compare("<=", Call("abs", (value,)), real(sys.float_info.max))
