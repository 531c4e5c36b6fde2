"""Functions: the elementary functions that are operation lists, by number type and name."""

from __future__ import annotations

from collections.abc import Mapping

from language.ir.number_type import NumberType
from language.ir.program import Function
from language.numerics import float32_constants as of_single
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
    build_sin(of_single.TRIG_FLOAT32),
    build_cos(of_single.TRIG_FLOAT32),
    build_exp(of_single.EXP_FLOAT32),
    build_tanh(of_single.TANH_FLOAT32),
    build_tan(of_single.TRIG_FLOAT32),
    build_atan2(of_single.ATAN2_FLOAT32),
    build_log(of_single.LOG_FLOAT32),
    build_pow(of_single.POW_FLOAT32),
)
FUNCTIONS: Mapping[str, Function] = {function.name: function for function in FLOAT64_FUNCTIONS}
"""In float64; a function that calls another one (tanh calls exp) comes after it."""
FUNCTIONS_BY_TYPE: Mapping[NumberType, Mapping[str, Function]] = {
    "float64": FUNCTIONS,
    "float32": {function.name: function for function in FLOAT32_FUNCTIONS},
}
