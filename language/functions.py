"""Functions: the elementary functions that are operation lists, by number type and name."""

from __future__ import annotations

from collections.abc import Mapping

from language import elementary_single as of_single
from language.elementary import cosine, hyperbolic_tangent, sine
from language.exponent import exponential
from language.logarithm import logarithm
from language.number import NumberType
from language.power import power_of
from language.program import Function
from language.tangent import angle_of, tangent

MADE = (
    sine(),
    cosine(),
    exponential(),
    hyperbolic_tangent(),
    tangent(),
    angle_of(),
    logarithm(),
    power_of(),
)
MADE_SINGLE = (
    sine(of_single.CIRCLE),
    cosine(of_single.CIRCLE),
    exponential(of_single.POWERS),
    hyperbolic_tangent(of_single.LAMBERT),
    tangent(of_single.CIRCLE),
    angle_of(of_single.ARC),
    logarithm(of_single.BINADES),
    power_of(of_single.POWER),
)
FUNCTIONS: Mapping[str, Function] = {function.name: function for function in MADE}
"""In float64; a function that calls another one (tanh calls exp) comes after it."""
FUNCTIONS_OF: Mapping[NumberType, Mapping[str, Function]] = {
    "float64": FUNCTIONS,
    "float32": {function.name: function for function in MADE_SINGLE},
}
