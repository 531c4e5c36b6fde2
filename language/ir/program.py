"""Program: named blocks of scalar operations that the engine interprets and the generator prints.

A variable is called `group.name`. The group gives its meaning and its storage:

    constant  a fixed parameter            calibration  a tunable parameter
    derived   computed from calibrations   solved       computed at check time, with stamps
    input     input of this tick           before       input of the tick before
    state     retained between steps       equation     evaluated in each tick
    discrete  retained; constant while the states flow
    latched   input of this tick, saturated to its range
    check     truth of an invariant, for the engine only
    memory    mode, fired transition, counters and other retained variables
    timer     counter or remaining time of a wait
    axis      points of an axis of a table
    innovation  measurement minus its prediction, of an observer
    is_new    whether a measurement is new in this tick
    signal    value that a connection or a sensor of a system reads
    work      local variable of one call
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Literal

from language.ir.number_type import NumberType
from language.ir.ops import Block
from language.ir.root_region import CHART

ENTRY_BLOCKS = ("init", "derive", "step")
"""The blocks at which generated C enters a Program."""
ENGINE_BLOCKS = (
    "latch",
    "start",
    "equations",
    "evaluate_guards",
    "jump",
    "limit",
    "flow",
    "advance_time",
    "dense",
    "peek",
    "record",
    "invariants",
)
"""The blocks that an engine runs one by one.

A Program with varying inputs has no `step`.
"""
STEP_INTERFACE = ("work.h", "work.left", "work.merge", "work.elapsed", "work.crossed", "work.event")
"""The variables that an engine writes before it runs blocks of a step, or reads afterwards."""
MODE_VARIABLE = "memory.mode"
"""Variable of the chart's mode; a run of a model has its own."""
LOG_VARIABLE = "memory.log"
LOG_COUNT_VARIABLE = "memory.count_of_log"
"""Number of entries of LOG_VARIABLE, the array of the transitions fired in a tick.

The array exists if a tick may have several micro-steps; a 0 ends each micro-step.
"""
ValueType = Literal["real", "truth", "whole"]
InlineMark = Literal["rarely", "not-inlined"]
"""Mark of a block that is not inlined in C, with the reason."""
TICK_UNIT = "tick"
"""Unit of a tunable wait on a calibration page."""
MAX_TIMER_TICKS = 2**31 - 1
"""Largest value of a tick counter (rule 4): 24.8 days of ticks of 1 ms.

A whole number of the language holds it too.
"""
SHORT_TIMER_TICKS = 2**16 - 1
"""Largest value of a tick counter of 16 bits in C."""


@dataclass(frozen=True)
class Variable:
    """A variable with its type and unit; `size` is the length of an array, 0 for a scalar.

    `values` are the names of the numbers 0, 1, ... of an enumeration. `range` is the declared range
    [SI] whose violation the engine reports. `largest` is the value at which a tick counter stops.
    """

    name: str
    type: ValueType
    unit: str = "1"
    size: int = 0
    about: str = ""
    values: tuple[str, ...] = ()
    range: tuple[float, float] | None = None
    largest: int = SHORT_TIMER_TICKS


@dataclass(frozen=True)
class Constant:
    """A value that no operation writes; `items` are the values of an array, empty for a scalar.

    `depends_on` lists the tunable parameters from which a solved number was computed.
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
    """A mode: its name and its number."""

    name: str
    number: int


@dataclass(frozen=True)
class RegionInfo:
    """A region beside the root chart, with its modes."""

    name: str
    modes: tuple[ModeInfo, ...]


@dataclass(frozen=True)
class TransitionInfo:
    """A transition: number (from 1), source and target modes, wait in seconds (exact) and in ticks.

    `slot` is the suffix of the variables of its guard (language/model/region_queries.py).
    `rewind_ticks` is the largest number of ticks that the transition goes back. `chart_endpoints`
    are the paths of source and target in a chart, "" for none. `tunable_wait` is the constant that
    holds a tunable wait in ticks, and `max_ticks` the end of its range; 0 for a fixed wait.
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
    max_ticks: int = 0

    @property
    def guard_key(self) -> str:
        """The key path of the operation that evaluates the guard for a variable or a counter.

        The guard of a sampled transition without a wait is instead the condition of the branch
        that holds the operation with `key`.
        """
        return f"{self.key}.when"

    @property
    def timer_limit(self) -> int:
        """The value at which the wait counter saturates.

        It is `ticks` + 1; for a tunable wait the largest value of a counter that can count more
        than `max_ticks`.
        """
        if self.tunable_wait is None:
            return self.ticks + 1
        return SHORT_TIMER_TICKS if self.max_ticks < SHORT_TIMER_TICKS else MAX_TIMER_TICKS


@dataclass(frozen=True)
class Alarm:
    """A time [s] after the entry of a mode at which a variable becomes true (rule 8).

    If `repeats` is set, the variable is true at that instant only, and again after each further
    period of `time`.
    """

    variable: str
    region: str
    mode: int
    time: Fraction
    repeats: bool = False


@dataclass(frozen=True)
class Function:
    """An elementary function as a list of operations.

    Parameters are `work.<name>`, the result is `work.y`.
    """

    name: str
    body: Block
    locals: tuple[str, ...]
    about: str
    parameters: tuple[str, ...] = ("x",)


@dataclass(frozen=True)
class OutputWire:
    """An output of the automaton: its name, the variable with its value, its type and its unit."""

    name: str
    source: str
    type: ValueType
    unit: str


@dataclass(frozen=True)
class ObserverInfo:
    """The matrices from which the solved constants of an observer come, for reference solvers.

    `a` (n, n), `b` (n, inputs), `c` (m, n), `process_noise` (n, n), `measurement_noise` (m, m);
    `period` in s.
    """

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
    """The largest stable step [s] of a mode.

    `eigenvalue` [1/s], `term` and `state` say which part of the flow sets the limit.
    """

    mode: str
    step: float
    eigenvalue: complex
    term: str
    state: str


@dataclass(frozen=True)
class IntegrationInfo:
    """The integration of the states: method, step [s] and number of terms of its series.

    `norms` (|A h|) and `stability_limits` are given by mode.
    """

    method: str
    step: float
    series_terms: int
    norms: Mapping[str, float]
    stability_limits: tuple[StabilityLimit, ...]
    state_count: int
    max_events: int = 0


@dataclass(frozen=True)
class InvariantInfo:
    """An assertion about a mode: the variable with its truth, and the message on its violation."""

    name: str
    mode: int
    region: str
    variable: str
    message: str


@dataclass(frozen=True)
class Program:
    """A checked automaton as named blocks of operations.

    The order of the blocks is the order of printing. A sampled Program is entered at `init` and
    `step`; a continuous one at `init` and `step`, or by the engine at its parts (see
    language/programs/continuous_program.py). `inlining` marks blocks for the C generator.
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
    inlining: Mapping[str, InlineMark] = field(default_factory=dict)

    @property
    def inputs(self) -> tuple[Variable, ...]:
        """The variables of the group `input`, in the order of `variables`."""
        return tuple(v for v in self.variables if v.name.startswith("input."))

    def types(self) -> dict[str, ValueType]:
        """Return the types of all variables and constants by name; of an array its elements."""
        variables = {variable.name: variable.type for variable in self.variables}
        return variables | {constant.name: constant.type for constant in self.constants}

    def modes_of(self, region: str) -> tuple[ModeInfo, ...]:
        """Return the modes of a region, the name of one of `regions` or "chart" for the root.

        Raises StopIteration for an unknown region.
        """
        if region == CHART:
            return self.modes
        return next(info.modes for info in self.regions if info.name == region)

    def mode_name(self, number: int, region: str = CHART) -> str:
        """Return the name of the mode with a number in a region.

        Raises StopIteration for an unknown region or number.
        """
        return next(mode.name for mode in self.modes_of(region) if mode.number == number)

    @property
    def has_log(self) -> bool:
        """Return whether there is a variable LOG_VARIABLE: a tick may have several micro-steps."""
        return any(variable.name == LOG_VARIABLE for variable in self.variables)

    def endpoint_names(self, info: TransitionInfo) -> tuple[str, str]:
        """Return the names of source and target of a transition.

        They are its `chart_endpoints` (paths, "" for none) if it has them, else the names of its
        modes in its region.
        """
        return info.chart_endpoints or (
            self.mode_name(info.source, info.region),
            self.mode_name(info.target, info.region),
        )

    def mode_variables(self) -> dict[str, str]:
        """Return the variable with the mode number of each region, keyed by region, chart first.

        The names are those of `mode_variable` with MODE_VARIABLE; the other regions have their
        order.
        """
        names = (CHART, *(region.name for region in self.regions))
        return {name: mode_variable(MODE_VARIABLE, name) for name in names}

    def fired_variables(self) -> tuple[str, ...]:
        """Return the variables with the fired transition of each region, chart first.

        Their names are those of `fired_variable`.
        """
        return tuple(fired_variable(region) for region in self.mode_variables())


def mode_variable(base: str, region: str) -> str:
    """Return the variable of a region: `base` for "chart", else `<base>_<region>`, dots as `_`."""
    return base if region == CHART else f"{base}_{region.replace('.', '_')}"


def fired_variable(region: str) -> str:
    """Return the variable with the number of the transition that a region fires in a micro-step.

    It is `memory.fired` for "chart", else `memory.fired_<region>` with dots as `_`. Its value is 0
    if the region fires none.
    """
    return mode_variable("memory.fired", region)


def value_type(type_name: str) -> ValueType:
    """Return the type in a Program of a declared type.

    "real" gives "real", "bool" gives "truth", any other text ("int", "enum") gives "whole".
    """
    types: dict[str, ValueType] = {"real": "real", "bool": "truth"}
    return types.get(type_name, "whole")


def unqualified_name(name: str) -> str:
    """Return the part of a name behind its first dot (its group); empty if the name has no dot."""
    return name.partition(".")[2]
