"""Function table: the elementary functions that are operation lists, by number type and name.

The list is that of rule C5.
"""

from __future__ import annotations

from collections.abc import Mapping

from language.ir.number_type import NumberType
from language.ir.program import Function
from language.numerics import float32_constants
from language.numerics.exp import build_exp
from language.numerics.log import build_log
from language.numerics.pow import build_pow
from language.numerics.sin_cos_tanh import build_cos, build_sin, build_tanh
from language.numerics.tan_atan2 import build_atan2, build_tan

FLOAT64_FUNCTIONS = (
    build_sin(),
    build_cos(),
    build_exp(),
    build_tanh(),
    build_tan(),
    build_atan2(),
    build_log(),
    build_pow(),
)
FLOAT32_FUNCTIONS = (
    build_sin(float32_constants.TRIG_FLOAT32),
    build_cos(float32_constants.TRIG_FLOAT32),
    build_exp(float32_constants.EXP_FLOAT32),
    build_tanh(float32_constants.TANH_FLOAT32),
    build_tan(float32_constants.TRIG_FLOAT32),
    build_atan2(float32_constants.ATAN2_FLOAT32),
    build_log(float32_constants.LOG_FLOAT32),
    build_pow(float32_constants.POW_FLOAT32),
)
FUNCTIONS: Mapping[str, Function] = {function.name: function for function in FLOAT64_FUNCTIONS}
"""Functions in float64; a function stands after those that it calls (tanh calls exp)."""
FUNCTIONS_BY_TYPE: Mapping[NumberType, Mapping[str, Function]] = {
    "float64": FUNCTIONS,
    "float32": {function.name: function for function in FLOAT32_FUNCTIONS},
}
