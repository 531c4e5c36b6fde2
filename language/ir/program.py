"""Program: ordered scalar operations, the one thing that the engine runs and codegen prints.

Names are `group.name`; the group says what a variable is and where a back end keeps it:

    constant  a fixed parameter          calibration  a tunable parameter
    derived   follows from calibrations  solved       computed at check time, carries stamps
    input     of this tick               before       the inputs of the tick before
    state     carried over               equation     evaluated each tick
    discrete  carried over, frozen while the states flow
    latched   inputs of this tick within their ranges
    check     whether an invariant holds; for the engine alone
    memory    mode, fired, counters ...  work         lives within one call only
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from language.ir.number_type import NumberType
from language.ir.ops import Block
from language.ir.regions import CHART

MODE_VARIABLE = "memory.mode"
"""The variable of the chart's mode; a run keeps its own."""
LOG_VARIABLE = "memory.log"
LOG_COUNT_VARIABLE = "memory.count_of_log"
"""The transitions of a tick with several micro-steps, a 0 after each step, and how many entries."""
ValueType = Literal["real", "truth", "whole"]
TICK_UNIT = "tick"
"""The unit of a tunable wait on a calibration page."""
MAX_TIMER_TICKS = 65535
"""What a counter of ticks goes up to (rule 4)."""


@dataclass(frozen=True)
class Variable:
    """A variable with its type; `size` is the length of an array, 0 for a scalar.

    `values` are the names of the numbers 0, 1, ... of a whole one that is an enumeration; `range`
    is what an engine reports the leaving of (SI).
    """

    name: str
    type: ValueType
    unit: str = "1"
    size: int = 0
    about: str = ""
    values: tuple[str, ...] = ()
    range: tuple[float, float] | None = None


@dataclass(frozen=True)
class Constant:
    """A value that no operation writes; solved ones list the tunables that they came from.

    `items` are the values of an array, empty for a scalar.
    """

    name: str
    kind: Literal["fixed", "tunable", "derived", "solved"]
    value: float
    unit: str = "1"
    key: str = ""
    depends_on: tuple[str, ...] = ()
    range: tuple[float, float] | None = None
    type: ValueType = "real"
    values: tuple[str, ...] = ()
    items: tuple[float, ...] = ()
    about: str = ""


@dataclass(frozen=True)
class ModeInfo:
    """A mode and its number."""

    name: str
    number: int


@dataclass(frozen=True)
class RegionInfo:
    """A region beside the chart with its modes."""

    name: str
    modes: tuple[ModeInfo, ...]


@dataclass(frozen=True)
class TransitionInfo:
    """A transition: number (from 1), modes, wait in seconds (exact) and in ticks.

    `slot` is the ending of the variables of its guard, see language/model/region_queries.py; `rewind` are the
    ticks that it looks back; `between` are the paths of source and target in a chart, "" for none.
    `tunable` is the constant that holds the ticks of a tunable wait.
    """

    number: int
    name: str
    source: int
    target: int
    wait: Fraction
    ticks: int
    timer: str | None
    key: str
    region: str = CHART
    slot: str = "0"
    rewind_ticks: int = 0
    chart_endpoints: tuple[str, str] | None = None
    tunable_wait: str | None = None

    @property
    def timer_limit(self) -> int:
        """What the timer counts to: one more than the wait, or than the longest tunable one."""
        return MAX_TIMER_TICKS if self.tunable_wait else self.ticks + 1


@dataclass(frozen=True)
class Alarm:
    """A time [s] after the entry of a mode at which a variable becomes true (rule 8).

    Where it `repeats` the variable is true for that instant, and again each time [s] after it.
    """

    variable: str
    region: str
    mode: int
    time: Fraction
    repeats: bool = False


@dataclass(frozen=True)
class Function:
    """An elementary function as operations: parameters `work.x` ..., result in `work.y`."""

    name: str
    body: Block
    locals: tuple[str, ...]
    about: str
    parameters: tuple[str, ...] = ("x",)


@dataclass(frozen=True)
class OutputWire:
    """An output: its name and the variable that holds it."""

    name: str
    source: str
    type: ValueType
    unit: str


@dataclass(frozen=True)
class ObserverInfo:
    """Numbers from which an observer's solved constants came (for reference back ends)."""

    mode: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    measures: tuple[str, ...]
    a: tuple[tuple[float, ...], ...]
    b: tuple[tuple[float, ...], ...]
    c: tuple[tuple[float, ...], ...]
    process_noise: tuple[tuple[float, ...], ...]
    measurement_noise: tuple[tuple[float, ...], ...]
    period: float
    solved: Mapping[str, str]
    gain: str = "steady"


@dataclass(frozen=True)
class StabilityLimit:
    """The largest stable step [s] of a mode, and the eigenvalue [1/s] and term that set it."""

    mode: str
    step: float
    eigenvalue: complex
    term: str
    state: str


@dataclass(frozen=True)
class IntegrationInfo:
    """How states move: method, step [s], terms of its polynomial, |A h| and limits by mode."""

    method: str
    step: float
    series_terms: int
    norms: Mapping[str, float]
    stability_limits: tuple[StabilityLimit, ...]
    state_count: int
    max_events: int = 0


@dataclass(frozen=True)
class InvariantInfo:
    """An assertion about a mode: the variable that says whether it holds, and what is told."""

    name: str
    mode: int
    region: str
    variable: str
    message: str


@dataclass(frozen=True)
class Program:
    """A checked automaton as operations. `blocks` are named; the order is that of printing.

    A sampled program is entered at `init` and `step`; a continuous one at `init`, `equations`,
    `watch`, `jump` and `flow` (see language/programs/continuous_program.py).
    """

    name: str
    number_type: NumberType
    period: Fraction | None
    major_step: Fraction
    constants: tuple[Constant, ...]
    variables: tuple[Variable, ...]
    outputs: tuple[OutputWire, ...]
    modes: tuple[ModeInfo, ...]
    transitions: tuple[TransitionInfo, ...]
    faults: tuple[str, ...]
    functions: tuple[Function, ...]
    blocks: Mapping[str, Block]
    run_modes: tuple[ModeInfo, ...] = ()
    observers: tuple[ObserverInfo, ...] = ()
    integration: IntegrationInfo | None = None
    defaults: Mapping[str, float | bool] = field(default_factory=dict)
    regions: tuple[RegionInfo, ...] = ()
    invariants: tuple[InvariantInfo, ...] = ()
    alarms: tuple[Alarm, ...] = ()

    @property
    def inputs(self) -> tuple[Variable, ...]:
        """The variables that come from outside."""
        return tuple(v for v in self.variables if v.name.startswith("input."))

    def modes_of(self, region: str) -> tuple[ModeInfo, ...]:
        """Return the modes of a region."""
        if region == CHART:
            return self.modes
        return next(info.modes for info in self.regions if info.name == region)

    def mode_name(self, number: int, region: str = CHART) -> str:
        """Return the name of the mode of a region with a number."""
        return next(mode.name for mode in self.modes_of(region) if mode.number == number)

    @property
    def has_log(self) -> bool:
        """Tell whether a tick may have several micro-steps, so that it keeps their transitions."""
        return any(variable.name == LOG_VARIABLE for variable in self.variables)

    def endpoint_names(self, info: TransitionInfo) -> tuple[str, str]:
        """Return the names of source and target of a transition: paths in a chart, "" for none."""
        return info.chart_endpoints or (
            self.mode_name(info.source, info.region),
            self.mode_name(info.target, info.region),
        )

    def mode_variables(self) -> dict[str, str]:
        """Return the variable that holds the mode of each region, the chart first."""
        names = (CHART, *(region.name for region in self.regions))
        return {name: mode_variable(MODE_VARIABLE, name) for name in names}

    def fired_variables(self) -> tuple[str, ...]:
        """Return the variables that hold the transition of each region, the chart first."""
        return tuple(fired_variable(region) for region in self.mode_variables())


def mode_variable(base: str, region: str) -> str:
    """Return the variable that holds a region's mode; `base` is that of the chart."""
    return base if region == CHART else f"{base}_{region.replace('.', '_')}"


def fired_variable(region: str) -> str:
    """Return the variable that holds the transition of a region in a micro-step, 0 for none."""
    return mode_variable("memory.fired", region)


def value_type(type_name: str) -> ValueType:
    """Return what a declared type (real, int, bool, enum) is in a Program."""
    types: dict[str, ValueType] = {"real": "real", "bool": "truth"}
    return types.get(type_name, "whole")


def unqualified_name(name: str) -> str:
    """Return a variable's name without its group."""
    return name.partition(".")[2]
