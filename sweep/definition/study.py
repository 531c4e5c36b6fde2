"""Study: what varies, in which systems and scenarios, and what is measured of each variant."""

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
"""Decimals of a drawn time [s] in an input: so all times of a run are multiples of one tick."""


@dataclass(frozen=True)
class Target:
    """A place where a value goes: a parameter of an instance, a start value, a part of an input.

    `path` is (instance, parameter), (instance, state), (input, part ...), (sensor, field) or
    (instance, period | step | offset).
    """

    kind: TargetKind
    path: tuple[str, ...]

    @property
    def is_input_time(self) -> bool:
        """Tell whether it is a time in an input; these are rounded to nanoseconds."""
        is_time = "times" in self.path[1:2] or self.path[-1] in ("from", "to")
        return self.kind == "input" and is_time


@dataclass(frozen=True)
class Axis:
    """Values [SI] that are taken one after the other: an axis of the grid."""

    values: tuple[float, ...]


@dataclass(frozen=True)
class Distribution:
    """What is drawn from, in SI; `within` truncates it, `weights` are those of the choices.

    `numbers` are low and high, mean and sd, median and sigma of the logarithm, or the choices.
    """

    shape: Shape
    numbers: tuple[float, ...]
    within: tuple[float, float] | None = None
    weights: tuple[float, ...] = ()


@dataclass(frozen=True)
class SweepVariable:
    """Something that varies: `targets` is empty for a name that only `set` reads.

    `words` are the values of an enumeration; values are in SI, `unit` is the one they are written
    and shown in.
    """

    name: str
    distribution: Axis | Distribution
    targets: tuple[Target, ...]
    unit: Unit
    span: Span
    words: tuple[str, ...] = ()

    @property
    def is_random(self) -> bool:
        """Tell whether values are drawn, not taken from a list."""
        return isinstance(self.distribution, Distribution)


@dataclass(frozen=True)
class Setting:
    """A value that follows from what varies and from parameters: an expression in SI."""

    name: str
    targets: tuple[Target, ...]
    formula: Formula
    unit: str


@dataclass(frozen=True)
class Sampling:
    """How many points are drawn, how, and from which seed; 0 points: nothing is drawn.

    Of a design (`saltelli`, `morris`) `count` are all its points, several a block or path.

    `one_at_a_time`: instead of the product of the axes, each value with all others left alone.
    """

    method: SamplingMethod = "random"
    count: int = 0
    seed: int = 0
    one_at_a_time: bool = False


@dataclass(frozen=True)
class ScenarioBinding:
    """A scenario as one system reads it; `document` is there where parts of inputs vary."""

    scenario: Scenario
    document: Document | None = None


@dataclass(frozen=True)
class SystemVariant:
    """One of the variants of a study: a system with the study's scenarios for it."""

    name: str
    system: System
    scenario_bindings: Mapping[str, ScenarioBinding] = field(repr=False)


MIN_CONFIDENCE, MAX_CONFIDENCE = 0.5, 0.999999
"""Shares that a confidence is between: of less an interval is empty, of more without end."""
MORRIS_LEVELS = 4
"""Of each thing that varies in a path of Morris: the middles of so many equal shares."""


@dataclass(frozen=True)
class Presentation:
    """How results are shown: no influence on them. `plots` are options by name."""

    by: tuple[str, ...] = ()
    confidence: float = 0.95
    plots: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class Study:
    """A checked study: everything that a worker needs, without its files.

    `every` [s] is the distance of rows, None for that of the scenarios; `identity` are digests of
    what the results depend on, by part; `description` are its sections as they are written.
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
        """What takes its values from a list."""
        return tuple(varied for varied in self.variables if not varied.is_random)

    @property
    def random_variables(self) -> tuple[SweepVariable, ...]:
        """What is drawn."""
        return tuple(varied for varied in self.variables if varied.is_random)

    @property
    def grid_count(self) -> int:
        """The number of points of the grid, 1 where there are no axes."""
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
        """The number of variants."""
        samples = max(1, self.sampling.count)
        shared = self.grid_count * samples * self.replicates
        return len(self.system_variants) * len(self.scenarios) * shared


def design_group_size(method: str, dimensions: int) -> int:
    """Return how many points belong together: those of a block or a path; else each is alone."""
    return {"saltelli": dimensions + 2, "morris": dimensions + 1}.get(method, 1)
