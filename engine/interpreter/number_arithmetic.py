"""Number arithmetic: representation and operations of reals of each number type (rule 17a).

A float64 is a Python float. A float32 is a numpy.float32, whose `+ - * /` and comparisons are those
of the processor. The two are never mixed, and no numpy scalar leaves the interpreter.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

import numpy as np

from language.ir.number_type import NumberType
from language.numerics.evaluate import ELEMENTARY_BY_TYPE, divide


@dataclass(frozen=True)
class Arithmetic:
    """Operations of one number type.

    `real` rounds a number to the type. `divide` and `elementary` are its division and functions.
    `suppress_warnings` is the context in which blocks run. `to_python` converts a value of a frame
    to a Python number.
    """

    real: Callable[[Any], Any]
    divide: Callable[[Any, Any], Any]
    elementary: Mapping[str, Callable[..., Any]]
    suppress_warnings: Callable[[], AbstractContextManager[None]]
    to_python: Callable[[Any], Any]

    def to_frame_value(self, value: float | int | bool) -> Any:
        """Return a value as a frame stores it: floats rounded to the type, int and bool as is."""
        return self.real(value) if isinstance(value, float) else value


def _round_to_single(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return an operation on doubles with its result rounded to float32.

    It equals the float32 operation if the result is exact or rounded once.
    """
    return lambda *arguments: np.float32(function(*arguments))


ARITHMETIC_OF_TYPE: Mapping[NumberType, Arithmetic] = {
    "float64": Arithmetic(
        float, divide, ELEMENTARY_BY_TYPE["float64"], nullcontext, lambda value: value
    ),
    "float32": Arithmetic(
        np.float32,
        lambda a, b: a / b,
        {
            name: function if name == "whole" else _round_to_single(function)
            for name, function in ELEMENTARY_BY_TYPE["float32"].items()
        },
        lambda: np.errstate(all="ignore"),  # overflow and NaN are values (rule C7)
        lambda value: value.item() if isinstance(value, np.generic) else value,
    ),
}
"""Arithmetic of each number type."""
