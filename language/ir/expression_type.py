"""Expression types: the type of each expression of a Program, and the signatures of its functions.

This is the only place where a type is inferred; passes, printers and proofs use it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from language.ir.ops import Binary, Call, Compare, Expr, Item, Ref, Select, Unary, Value
from language.ir.program import ValueType

ParameterType = Literal["real", "truth", "whole", "table"]
"""The type of an argument; a `table` is the name of an array constant of reals."""


@dataclass(frozen=True)
class Signature:
    """The types of the arguments of a function, and the type of its result."""

    parameters: tuple[ParameterType, ...]
    result: ValueType = "real"


ELEMENTARY_SIGNATURES: Mapping[str, Signature] = {
    "abs": Signature(("real",)),
    "sqrt": Signature(("real",)),
    "floor": Signature(("real",)),
    "sign": Signature(("real",)),
    "pow2": Signature(("real",)),
    "min": Signature(("real", "real")),
    "max": Signature(("real", "real")),
    "clip": Signature(("real", "real", "real")),
    "within": Signature(("real", "real", "real"), "truth"),
    "real": Signature(("whole",)),
    "whole": Signature(("real",), "whole"),
    "lookup": Signature(("table", "whole", "table", "real")),
    "lookup2": Signature(("table", "table", "whole", "whole", "table", "real", "real")),
    "reduced_quadrant": Signature(("real",)),
    "reduced_head": Signature(("real",)),
    "reduced_tail": Signature(("real",)),
}
"""The elementary operations; `within` exists in C only, `reduced_*` in bodies of functions only.

A function of a Program takes reals and gives a real.
"""


def real_function(count: int) -> Signature:
    """Return the signature of a function of `count` reals."""
    parameters: tuple[ParameterType, ...] = ("real",)
    return Signature(parameters * count)


def expression_type(expr: Expr, types: Mapping[str, ValueType]) -> ValueType:
    """Return the type of an expression, which is taken to be well-typed.

    `types` are the types of names; a name that it lacks is whole if its reference is marked so,
    else real. The first operand decides the type of arithmetic, the then-value that of a choice.
    """
    while True:
        match expr:
            case Value(value):
                if isinstance(value, bool):
                    return "truth"
                return "real" if isinstance(value, float) else "whole"
            case Ref(name, is_whole) | Item(name, _, is_whole):
                return "whole" if is_whole else types.get(name, "real")
            case Unary("-", operand) | Select(_, operand, _):
                expr = operand
            case Unary() | Compare() | Binary("and" | "or", _, _):
                return "truth"
            case Binary("/", _, _):
                return "real"
            case Binary(_, left, _):
                expr = left
            case Call(function, _):
                known = ELEMENTARY_SIGNATURES.get(function)
                return known.result if known else "real"


NO_TYPES: Mapping[str, ValueType] = {}


def is_whole(expr: Expr) -> bool:
    """Return whether the value of an expression is a whole number; values of enumerations are.

    References must be marked (`annotate_types`), because no declarations are looked up.
    """
    return expression_type(expr, NO_TYPES) == "whole"
