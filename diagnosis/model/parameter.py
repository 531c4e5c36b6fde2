"""Free parameters: parameters with a range, as coordinates with a standard normal prior.

A parameter with a `range` is free. z = 0 is its declared value, and z = 1 is one standard deviation
of its prior away: a fraction of a positive value (in its logarithm), else a fraction of the range.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

from language.expressions.parser import parse_expression
from language.lowering.constants import evaluate_exactly
from language.model.automaton import Automaton
from language.model.declaration import Formula, Parameter
from language.overlays.name_types import format_si_unit
from language.text.diagnostic import SpecError
from language.text.document import ScalarNode

PRIOR_STD = 0.15
"""Prior standard deviation of a base parameter: of its logarithm, or as a fraction of its range."""
NEUTRAL_OFFSET = 0.02
"""The first start of an effect parameter lies at this fraction of the way from neutral to the next.
"""
EFFECT_PRIOR_STD = 0.5
"""Prior standard deviation of an effect parameter, as a fraction of its range."""


@dataclass(frozen=True)
class FreeParameter:
    """A parameter [SI] with a coordinate z: value = start exp(sd z) if `is_log`, else start + sd z.

    sd is `prior_std`. `low` and `high` are its range, `starts` the values from which fits begin.
    With `per_recording` each recording has a value of its own. `is_order` marks a number of periods
    over the path of an effect.
    """

    name: str
    start: float
    low: float
    high: float
    prior_std: float
    is_log: bool
    per_recording: bool = False
    starts: tuple[float, ...] = ()
    unit: str = "1"
    is_order: bool = False

    def value(self, z: float) -> float:
        """Return the value [SI] at a coordinate; it may be outside the range."""
        if self.is_log:
            return self.start * math.exp(self.prior_std * z)
        return self.start + self.prior_std * z

    def coordinate(self, value: float) -> float:
        """Return the coordinate of a value [SI], 0 for `start`; it may be outside the bounds.

        Raises ValueError for a value that is not positive if `is_log` (and the start is positive).
        """
        if self.is_log:
            return math.log(value / self.start) / self.prior_std
        return (value - self.start) / self.prior_std

    @property
    def bounds(self) -> tuple[float, float]:
        """The coordinates of the lower and upper bound of the range."""
        return self.coordinate(self.low), self.coordinate(self.high)


def free_parameters_of(
    automaton: Automaton, effects: Sequence[str] = ()
) -> tuple[FreeParameter, ...]:
    """Return the real scalar parameters of an automaton with a range and a value, in its order.

    `effects` names the parameters that effects add. Their prior is `EFFECT_PRIOR_STD` of the range,
    and they have start values; that of others is `PRIOR_STD`. A coordinate is logarithmic if value
    and range are positive; a lower bound of 0 of a positive base parameter becomes 0.1 % of its
    value.
    """
    found = []
    for name, parameter in automaton.parameters.items():
        is_number = parameter.type == "real" and parameter.table is None
        if is_number and parameter.range and parameter.value is not None:
            found.append(
                _effect_parameter(parameter) if name in effects else _base_parameter(parameter)
            )
    return tuple(found)


def _base_parameter(parameter: Parameter) -> FreeParameter:
    """Return a base parameter as a free one: logarithmic if its range and value are positive.

    A lower bound of 0 of a positive parameter becomes 0.1 % of its value.
    """
    assert parameter.range and parameter.value is not None
    low, high = (float(end) for end in parameter.range)
    value, unit = float(parameter.value), si_unit(parameter)
    if low >= 0.0 and value > 0.0:
        low = low if low > 0.0 else 1e-3 * value
        return FreeParameter(parameter.name, value, low, high, PRIOR_STD, True, unit=unit)
    return FreeParameter(
        parameter.name, value, low, high, PRIOR_STD * (high - low), False, unit=unit
    )


def _effect_parameter(parameter: Parameter) -> FreeParameter:
    """Return an effect parameter as a free one: logarithmic if its range and value are positive."""
    assert parameter.range and parameter.value is not None
    low, high = (float(end) for end in parameter.range)
    fitting = parameter.fitting
    value = float(parameter.value)
    starts = _start_values(parameter, value)
    each = fitting.per == "recording"
    place = (parameter.name, value, low, high)
    unit = si_unit(parameter)
    if low > 0.0 and value > 0.0:
        sd = EFFECT_PRIOR_STD * math.log(high / low)
        return FreeParameter(*place, sd, True, each, starts, unit, fitting.form == "order")
    return FreeParameter(*place, EFFECT_PRIOR_STD * (high - low), False, each, starts, unit)


def _start_values(parameter: Parameter, value: float) -> tuple[float, ...]:
    """Return the values from which fits of an effect parameter start.

    These are the declared starts; else, with a neutral value, one point near it and one at a tenth
    of the way to the upper bound; else the declared value.
    """
    fitting = parameter.fitting
    if fitting.starts:
        return tuple(float(start) for start in fitting.starts)
    neutral = fitting.neutral
    if neutral is None or neutral == "absent" or not parameter.range:
        return (value,)
    far = 0.1 * float(parameter.range[1] - neutral)
    return (float(neutral) + NEUTRAL_OFFSET * far, float(neutral) + far)


def si_unit(parameter: Parameter) -> str:
    """Return the SI unit of a parameter's value: its own text if that is SI, else the SI form."""
    unit = parameter.unit
    is_si = unit.factor == 1 and unit.offset == 0
    return unit.text if is_si else format_si_unit(unit.dimension)


def with_range_prior(one: FreeParameter) -> FreeParameter:
    """Return a free parameter whose prior has the standard deviation of its range.

    This is the one of a uniform distribution over the range, or over its logarithm. A parameter
    with a range of no width is returned unchanged.
    """
    low, high = one.bounds
    width = (high - low) * one.prior_std
    return dataclasses.replace(one, prior_std=width / math.sqrt(12.0)) if width > 0.0 else one


def declared_value(automaton: Automaton, text: str) -> float | None:
    """Return the value [SI] of a formula of numbers and parameters, as they are declared.

    None for an empty text and for another formula.
    """
    if not text:
        return None
    scalar = ScalarNode(text, automaton.span)
    try:
        return float(evaluate_exactly(Formula(parse_expression(scalar), text), automaton))
    except SpecError:
        return None
