"""Computing: the elementary functions as Python, their errors in ULP, arguments with a story."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Callable

import mpmath

from language.ir.ops import Assign, Binary, Call, Compare, Expr, Ref, Select, Unary, Value
from language.ir.program import Function, unqualified_name
from language.numerics.function_table import FUNCTIONS
from language.numerics.payne_hanek import reduction_operations

Real = Callable[..., float]

EXACT = {name: getattr(mpmath, "power" if name == "pow" else name) for name in FUNCTIONS}


def pow2(k: float) -> float:
    assert k == int(k)  # raises for NaN
    assert -1022 <= k <= 1023
    return math.ldexp(1.0, int(k))


def text(expr: Expr) -> str:
    """Return an expression as Python; other kinds than these have no place in a function."""
    match expr:
        case Value(value):
            return repr(value)
        case Ref(name):
            return unqualified_name(name)
        case Unary("-", operand):
            return f"(-{text(operand)})"
        case Binary(operator, left, right) | Compare(operator, left, right):
            return f"({text(left)} {operator} {text(right)})"
        case Select(condition, then, other):
            return f"({text(then)} if {text(condition)} else {text(other)})"
        case Call(name, (argument,)):
            return f"{name}({text(argument)})"
    raise AssertionError(expr)


def compiled() -> dict[str, Real]:
    """Return the functions as Python functions."""
    space: dict[str, Real] = {"abs": abs, "pow2": pow2, **reduction_operations("float64")}
    for function in FUNCTIONS.values():
        lines = [f"def {function.name}({', '.join(function.parameters)}):"]
        for op in function.body:
            assert isinstance(op, Assign)
            lines.append(f"    {unqualified_name(op.target)} = {text(op.value)}")
        exec("\n".join([*lines, "    return y"]), space)
    return {name: space[name] for name in FUNCTIONS}


PYTHON = compiled()


def stated_error(function: Function) -> float:
    found = re.fullmatch(r".*; error < ([0-9.]+) ULP", function.about)
    assert found
    return float(found[1])


def ulp_error(name: str, *x: float) -> float:
    """Return the error at x in ULP of the exact result."""
    exact = EXACT[name](*(mpmath.mpf(value) for value in x))
    result = PYTHON[name](*x)
    if exact == 0:
        return 0.0 if result == 0.0 else math.inf
    unit = max(int(mpmath.frexp(abs(exact))[1]) - 53, -1074)
    return float(abs(mpmath.ldexp(mpmath.mpf(result) - exact, -unit)))


def bits(x: float) -> bytes:
    return struct.pack("<d", x)


def neighbours_of(x: float, steps: int = 2) -> list[float]:
    """Return x and its neighbours on both sides, ascending."""
    low, high = [x], [x]
    for _ in range(steps):
        low.append(math.nextafter(low[-1], -math.inf))
        high.append(math.nextafter(high[-1], math.inf))
    return [*reversed(low[1:]), *high]


def polynomial(coefficients: tuple[float, ...], x: mpmath.mpf) -> mpmath.mpf:
    return sum(c * x**power for power, c in enumerate(coefficients))
