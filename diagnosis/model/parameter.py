"""Free parameters: parameters with a range, as coordinates with a standard normal prior.

A parameter with a `range` is free. z = 0 is its declared value, and z = 1 is one standard deviation
of its prior away: a fraction of a positive value (in its logarithm), else a fraction of the range.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType

from language.expressions.parser import parse_expression
from language.expressions.syntax_tree import NumberLiteral, SyntaxTree
from language.expressions.units import Unit
from language.lowering.constants import constant_values, parameter_constants
from language.lowering.linearisation import LinearisationPoint, inline_equations
from language.model.automaton import Automaton
from language.model.declaration import Parameter
from language.overlays.name_types import format_si_unit
from language.text.diagnostic import Problems, SpecError
from language.text.document import ScalarNode

PRIOR_STD = 0.15
"""Prior standard deviation of a base parameter: of its logarithm, or as a fraction of its range."""
NEUTRAL_OFFSET = 0.02
"""Distance from neutral to the first start of an effect parameter over that to the next start."""
EFFECT_PRIOR_STD = 0.5
"""Prior standard deviation of an effect parameter, as a fraction of its range."""


@dataclass(frozen=True)
class FreeParameter:
    """A parameter [SI] with a coordinate z: value = start exp(sd z) if `is_log`, else start + sd z.

    sd is `prior_std`; fits begin at `starts`. `is_order` marks a number of periods over a path. At
    `plain` the effect has a simpler form.
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
    plain: float | None = None

    def value(self, z: float) -> float:
        """Return the value [SI] at a coordinate; it may be outside the range."""
        if self.is_log:
            return self.start * math.exp(self.prior_std * z)
        return self.start + self.prior_std * z

    def coordinate(self, value: float) -> float:
        """Return the coordinate of a value [SI]; ValueError for the logarithm of a negative one."""
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

    `effects` names the parameters that effects add, which have a wide prior and start values.
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
    """Return a base parameter as a free one; a lower bound of 0 becomes 0.1 % of its value."""
    assert parameter.range and parameter.value is not None
    low, high = (float(end) for end in parameter.range)
    value, unit = float(parameter.value), si_unit(parameter)
    if low >= 0.0 and value > 0.0:
        low = low if low > 0.0 else 1e-3 * value
        return FreeParameter(parameter.name, value, low, high, PRIOR_STD, True, unit=unit)
    spread = PRIOR_STD * (high - low)
    return FreeParameter(parameter.name, value, low, high, spread, False, unit=unit)


def _effect_parameter(parameter: Parameter) -> FreeParameter:
    """Return an effect parameter as a free one: logarithmic if its range and value are positive."""
    assert parameter.range and parameter.value is not None
    low, high = (float(end) for end in parameter.range)
    fitting, value = parameter.fitting, float(parameter.value)
    is_log = low > 0.0 and value > 0.0
    return FreeParameter(
        parameter.name,
        value,
        low,
        high,
        EFFECT_PRIOR_STD * (math.log(high / low) if is_log else high - low),
        is_log,
        fitting.per == "recording",
        _start_values(parameter, value),
        si_unit(parameter),
        is_log and fitting.form == "order",
        None if fitting.plain is None else float(fitting.plain),
    )


def _start_values(parameter: Parameter, value: float) -> tuple[float, ...]:
    """Return the declared starts; else two points away from the neutral value; else the value."""
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


def declared_value(
    automaton: Automaton, text: str, point: Mapping[str, float] = MappingProxyType({})
) -> float | None:
    """Return the value [SI] of a formula at declared parameters, None if it has none.

    The formula may read equations of the initial mode, and the states and inputs of `point` [SI].
    """
    if not text:
        return None
    here: dict[str, SyntaxTree] = {
        name: NumberLiteral(Fraction(value), declared.unit, declared.span)
        for section in (automaton.states, automaton.inputs)
        for name, declared in section.items()
        if math.isfinite(value := point.get(name, math.nan))
    }
    try:
        tree = parse_expression(ScalarNode(text, automaton.span))
        known = inline_equations(automaton.modes[automaton.initial], here)
        constants = constant_values(parameter_constants(automaton, Problems()))
        return float(LinearisationPoint(automaton, constants, known).evaluator(tree))
    except (SpecError, KeyError, ArithmeticError):
        return None


def format_value(value: float, parameter: Parameter) -> str:
    """Return a value [SI] with six significant digits in the declared unit, as `0.12 kg*m^2`.

    If the rounded value is outside the range of the parameter, the value is clipped to the range
    and written in full. Without a unit the text is the number alone.
    """
    unit = parameter.unit
    text = f"{in_unit(value, unit):.6g}"
    if parameter.range:
        low, high = ((end - unit.offset) / unit.factor for end in parameter.range)
        if not low <= Fraction(text) <= high:
            text = repr(min(max(in_unit(value, unit), float(low)), float(high)))
    return text if unit.text == "1" else f"{text} {unit.text}"


def in_unit(value: float, unit: Unit) -> float:
    """Return a value [SI] in a unit."""
    return (value - float(unit.offset)) / float(unit.factor)
