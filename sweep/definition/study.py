"""Study model: variables, targets, sampling, measures and the size of a study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Literal

from language.expressions.units import Unit
from language.model.declaration import Formula
from language.model.system import Scenario, System
from language.text.diagnostic import Span
from language.text.document import Document
from sweep.definition.description import Description
from sweep.definition.measure import Measure

SamplingMethod = Literal["random", "latin_hypercube", "sobol", "saltelli", "morris"]
TargetKind = Literal["parameter", "initial", "input", "sensor", "clock"]
Shape = Literal["uniform", "log_uniform", "normal", "lognormal", "choice"]


TIME_DECIMALS = 9
"""Decimals of a drawn time [s] in an input, so that all times of a run are whole nanoseconds."""


@dataclass(frozen=True)
class Target:
    """The place to which a value is assigned.

    It is a parameter, an initial value, a part of an input, a stage of a sensor or a clock. `path`
    is (instance, parameter), (instance, state), (input, part ...), (sensor, field) or (instance,
    period | step | offset).
    """

    kind: TargetKind
    path: tuple[str, ...]

    @property
    def is_input_time(self) -> bool:
        """Tell whether the target is a time in an input: of a step or point, or `from` or `to`.

        Drawn times are rounded to nanoseconds.
        """
        is_time = "times" in self.path[1:2] or self.path[-1] in ("from", "to")
        return self.kind == "input" and is_time


@dataclass(frozen=True)
class Axis:
    """The values [SI] of a grid axis in their order."""

    values: tuple[float, ...]


@dataclass(frozen=True)
class Distribution:
    """A probability distribution with parameters in SI.

    `numbers` are low and high, mean and standard deviation, median and sigma of the logarithm, or
    the values of a choice. `within` truncates the distribution; `weights` are the weights of the
    choices.
    """

    shape: Shape
    numbers: tuple[float, ...]
    within: tuple[float, float] | None = None
    weights: tuple[float, ...] = ()


@dataclass(frozen=True)
class SweepVariable:
    """A variable of a study with its values or its distribution [SI].

    `targets` is empty for a name to which only `set` refers. `words` are the values of an
    enumeration. `unit` is the unit in the study file, in which values are also displayed.
    """

    name: str
    distribution: Axis | Distribution
    targets: tuple[Target, ...]
    unit: Unit
    span: Span
    words: tuple[str, ...] = ()

    @property
    def is_random(self) -> bool:
        """Tell whether the values are drawn from a distribution, not listed by an axis."""
        return isinstance(self.distribution, Distribution)


@dataclass(frozen=True)
class Setting:
    """An assignment of the section `set`: an expression [SI] of variables and parameters."""

    name: str
    targets: tuple[Target, ...]
    formula: Formula
    unit: str


@dataclass(frozen=True)
class Sampling:
    """The number of drawn points, the method and the seed; 0 points mean a grid only.

    The count of a design (`saltelli`, `morris`) is the number of all its points, several for each
    block or path. With `one_at_a_time` each axis value is one variant and the other variables keep
    their nominal values.
    """

    method: SamplingMethod = "random"
    count: int = 0
    seed: int = 0
    one_at_a_time: bool = False


@dataclass(frozen=True)
class ScenarioBinding:
    """A scenario that is read for one system; `document` is present if parts of inputs vary."""

    scenario: Scenario
    document: Document | None = None


@dataclass(frozen=True)
class SystemVariant:
    """A named variant of the system with the scenarios of the study bound to it."""

    name: str
    system: System
    scenario_bindings: Mapping[str, ScenarioBinding] = field(repr=False)


MIN_CONFIDENCE, MAX_CONFIDENCE = 0.5, 0.999999
"""Limits of the confidence of an interval."""
MORRIS_LEVELS = 4
"""Number of levels of a variable in a Morris path: the centres of as many equal intervals."""


@dataclass(frozen=True)
class Presentation:
    """Grouping, confidence and plots (options by name); they do not influence the results."""

    by: tuple[str, ...] = ()
    confidence: float = 0.95
    plots: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class Study:
    """A checked study with everything that a worker needs; no files are read later.

    `every` [s] is the distance of recorded rows, None for that of the scenarios. `identity` holds
    digests of the parts on which the results depend. `description` holds the sections as text.
    """

    name: str
    system_variants: tuple[SystemVariant, ...]
    scenarios: tuple[str, ...]
    variables: tuple[SweepVariable, ...]
    settings: tuple[Setting, ...]
    sampling: Sampling
    replicates: int
    measures: tuple[Measure, ...]
    every: Fraction | None
    presentation: Presentation
    identity: Mapping[str, str]
    span: Span
    description: Description = field(default_factory=dict)

    @property
    def grid_variables(self) -> tuple[SweepVariable, ...]:
        """The variables with a list of values, in their order."""
        return tuple(varied for varied in self.variables if not varied.is_random)

    @property
    def random_variables(self) -> tuple[SweepVariable, ...]:
        """The variables with a distribution, in their order."""
        return tuple(varied for varied in self.variables if varied.is_random)

    @property
    def grid_count(self) -> int:
        """The number of grid points; 1 without axes.

        It is the product of the sizes of the axes, or 1 + their sum for one-at-a-time sampling.
        """
        sizes = [
            len(v.distribution.values)
            for v in self.grid_variables
            if isinstance(v.distribution, Axis)
        ]
        if self.sampling.one_at_a_time:
            return 1 + sum(sizes)
        total = 1
        for size in sizes:
            total *= size
        return total

    @property
    def count(self) -> int:
        """The number of variants.

        It is the product of the numbers of system variants, scenarios, grid points, samples (at
        least 1) and replicates.
        """
        samples = max(1, self.sampling.count)
        shared = self.grid_count * samples * self.replicates
        return len(self.system_variants) * len(self.scenarios) * shared


def design_group_size(method: str, dimensions: int) -> int:
    """Return the number of points of a block (saltelli: d + 2) or path (morris: d + 1).

    `dimensions` is the number d of random variables. Returns 1 for any other method.
    """
    return {"saltelli": dimensions + 2, "morris": dimensions + 1}.get(method, 1)
