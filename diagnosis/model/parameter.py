"""Uncertain: the parameters that recordings may move, in coordinates with a prior of one.

A parameter with a `range` is uncertain. z = 0 is its value, z = 1 one standard deviation of its
prior away: a part of the value where that is positive, else a part of the range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from language.model.automaton import Automaton
from language.model.declaration import Parameter
from language.overlays.tree_types import format_si_unit

Reals = NDArray[np.float64]
PRIOR_STD = 0.15
"""Standard deviation of a base parameter, as a part of its value (in its logarithm)."""
NEUTRAL_OFFSET = 0.02
"""A start near the neutral value: this part of the way to the next one."""
EFFECT_PRIOR_STD = 0.5
"""Standard deviation of an effect's parameter, as a part of its range."""


@dataclass(frozen=True)
class FreeParameter:
    """A parameter [SI] in its coordinate: value = start exp(sd z), or start + sd z.

    At `plain` the effect that brought it is a plainer one.
    """

    name: str
    start: float
    low: float
    high: float
    sd: float
    is_log: bool
    per_recording: bool = False
    starts: tuple[float, ...] = ()
    unit: str = "1"
    plain: float | None = None

    def value(self, z: float) -> float:
        """Return the value of a coordinate."""
        if self.is_log:
            return self.start * math.exp(self.sd * z)
        return self.start + self.sd * z

    def coordinate(self, value: float) -> float:
        """Return the coordinate of a value."""
        if self.is_log:
            return math.log(value / self.start) / self.sd
        return (value - self.start) / self.sd

    @property
    def bounds(self) -> tuple[float, float]:
        """The coordinates of the ends of the range."""
        return self.coordinate(self.low), self.coordinate(self.high)


def free_parameters_of(
    automaton: Automaton, effects: Sequence[str] = ()
) -> tuple[FreeParameter, ...]:
    """Return the uncertain parameters; `effects` are the names that effects have brought."""
    found = []
    for name, parameter in automaton.parameters.items():
        is_number = parameter.type == "real" and parameter.table is None
        if is_number and parameter.range and parameter.value is not None:
            found.append(
                _effect_parameter(parameter) if name in effects else _base_parameter(parameter)
            )
    return tuple(found)


def _base_parameter(parameter: Parameter) -> FreeParameter:
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
    assert parameter.range and parameter.value is not None
    low, high = (float(end) for end in parameter.range)
    fitting = parameter.fitting
    value = float(parameter.value)
    starts = _start_values(parameter, value)
    each = fitting.per == "recording"
    place = (parameter.name, value, low, high)
    unit = si_unit(parameter)
    plain = None if fitting.plain is None else float(fitting.plain)
    if low > 0.0 and value > 0.0:
        sd = EFFECT_PRIOR_STD * math.log(high / low)
        return FreeParameter(*place, sd, True, each, starts, unit, plain)
    return FreeParameter(*place, EFFECT_PRIOR_STD * (high - low), False, each, starts, unit, plain)


def _start_values(parameter: Parameter, value: float) -> tuple[float, ...]:
    """Return where fits start: at the declared starts, or near the neutral value and away from it,
    or at the value.
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
    """Return the unit of a parameter's value: as it is written where that is SI."""
    unit = parameter.unit
    is_si = unit.factor == 1 and unit.offset == 0
    return unit.text if is_si else format_si_unit(unit.dimension)
