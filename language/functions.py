"""Functions: the elementary functions that are operation lists, by name."""

from __future__ import annotations

from collections.abc import Mapping

from language.elementary import cosine, exponential, hyperbolic_tangent, sine
from language.program import Function
from language.tangent import angle_of, tangent

MADE = (sine(), cosine(), exponential(), hyperbolic_tangent(), tangent(), angle_of())
FUNCTIONS: Mapping[str, Function] = {function.name: function for function in MADE}
"""A function that calls another one (tanh calls exp) comes after it."""
