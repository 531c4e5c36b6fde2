"""Mathematics: ha_math as C99 - functions whose bits do not depend on a library (rule C6)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from codegen.expression import SUFFIX, c_expression, literal
from codegen.names import (
    REAL,
)
from codegen.rendering import render, version
from codegen.statement import INDENT, WIDTH, decided, is_nested, wrapped
from language.functions import FUNCTIONS_OF
from language.number import NumberType
from language.operation import Assign, Select
from language.program import (
    Function,
    short,
)


@dataclass(frozen=True)
class Layout:
    """How IEEE 754 keeps a real: `bits` in all, `digits` after the point, exponents of 2."""

    bits: int
    digits: int
    lowest: int
    highest: int


LAYOUT: Mapping[NumberType, Layout] = {
    "float64": Layout(64, 52, -1022, 1023),
    "float32": Layout(32, 23, -126, 127),
}


def math_files(number: NumberType) -> dict[str, str]:
    """Return ha_math (ha_mathf for float32): functions without a library's bits (rule C6)."""
    suffix = SUFFIX[number]
    context = {
        "functions": [_function(function, number) for function in FUNCTIONS_OF[number].values()],
        "version": version(),
        "real": REAL[number],
        "suffix": suffix,
        "zero": literal(0.0, number),
        "one": literal(1.0, number),
        "layout": LAYOUT[number],
        "lowest": literal(float(LAYOUT[number].lowest), number),
        "highest": literal(float(LAYOUT[number].highest), number),
    }
    return {
        f"ha_math{suffix}.h": render("ha_math.h.jinja", context),
        f"ha_math{suffix}.c": render("ha_math.c.jinja", context),
    }


@dataclass(frozen=True)
class _FunctionNames:
    """Inside a function of ha_math every variable is a local."""

    number: NumberType

    def __call__(self, name: str) -> str:
        return short(name)

    def whole(self, name: str, number: int) -> str:
        return str(number)

    def is_unsigned(self, name: str) -> bool:
        return False


def _function(function: Function, number: NumberType) -> dict[str, Any]:
    place = _FunctionNames(number)
    lines: list[str] = []
    for op in function.body:
        assert isinstance(op, Assign)
        left = "return " if op.target == "work.y" else f"const {REAL[number]} {place(op.target)} = "
        if isinstance(op.value, Select) and is_nested(op.value):
            lines += decided(REAL[number], place(op.target), op.value, place, WIDTH - len(INDENT))
            lines += ["return y;"] if op.target == "work.y" else []
        else:
            lines += wrapped(left, c_expression(op.value, place), "", WIDTH - len(INDENT))
    parameters = ", ".join(f"{REAL[number]} {name}" for name in function.parameters)
    about = function.about
    return {"name": function.name, "parameters": parameters, "about": about, "lines": lines}
