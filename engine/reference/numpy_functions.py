"""Numpy functions: the elementary functions of a reference simulation, of numpy's library.

A reference that used the operation lists of the engine could not show their errors.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from language.ir.number_type import NumberType

UFUNCS: Mapping[str, np.ufunc] = {
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "exp": np.exp,
    "log": np.log,
    "tanh": np.tanh,
    "atan2": np.arctan2,
    "pow": np.power,
}
"""The numpy function of each function of `language/numerics/function_table.py`."""


def numpy_functions(number_type: NumberType) -> Mapping[str, Callable[..., Any]]:
    """Return the elementary functions by name, of numbers as a frame of the type stores them.

    Outside their domains they give what numpy gives, NaN or an infinity, without a warning.
    """
    real: Callable[[Any], Any] = float if number_type == "float64" else np.float32

    def call_with(ufunc: np.ufunc) -> Callable[..., Any]:
        def call(*arguments: Any) -> Any:
            with np.errstate(all="ignore"):
                return real(ufunc(*(real(argument) for argument in arguments)))

        return call

    return {name: call_with(ufunc) for name, ufunc in UFUNCS.items()}
