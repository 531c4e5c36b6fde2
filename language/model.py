"""Model: one checked thing of the language - an automaton, a system, a scenario or a map."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Literal

from language.kind import Kind as ValueKind, Type
from language.number import NumberType
from language.problem import Span
from language.signal import Line, RecordingUse, Sensor, Stimulus
from language.syntax import Tree, names
from language.units import Dimension, Unit

Range = tuple[Fraction, Fraction]
Kind = Literal["fixed", "tunable", "derived"]
CHART = "chart"
"""The region of the modes at the root."""


@dataclass(frozen=True)
class Formula:
    """An expression and the key path that it stands under; `whole`: its value is whole."""

    tree: Tree
    key: str
    whole: bool = False

    @cached_property
    def reads(self) -> tuple[str, ...]:
        """The names that the expression reads, from left to right."""
        return tuple(name.path for name in names(self.tree))

    @property
    def span(self) -> Span:
        """The place of the expression."""
        return self.tree.span


@dataclass(frozen=True)
class Fitting:
    """What a fit needs to know of a parameter (SI).

    `neutral` is the value at which the effect that brought it vanishes, `absent` where there is
    none; `starts` are values to start from; `per` is `recording` for one value each.
    """

    neutral: Fraction | Literal["absent"] | None = None
    starts: tuple[Fraction, ...] = ()
    per: Literal["model", "recording"] = "model"
    form: Literal["constant", "constant_or_random_walk"] = "constant"


@dataclass(frozen=True)
class Axis:
    """An axis of a table: its strictly ascending points in SI, exact."""

    name: str
    unit: Unit
    points: tuple[Fraction, ...]


@dataclass(frozen=True)
class LookupTable:
    """Values over one or two axes in SI, exact; the last axis varies fastest."""

    axes: tuple[Axis, ...]
    unit: Unit
    values: tuple[Fraction, ...]


@dataclass(frozen=True)
class Parameter:
    """A value in SI (exact) or, if derived, an expression of other parameters.

    The value of a `bool` is 0 or 1, that of an `enum` the place in `values`.
    """

    name: str
    kind: Kind
    unit: Unit
    value: Fraction | None
    derived: Formula | None
    range: Range | None
    key: str
    span: Span
    fitting: Fitting = Fitting()
    type: Type = "real"
    values: tuple[str, ...] = ()
    table: LookupTable | None = None
    about: str = ""


@dataclass(frozen=True)
class Limits:
    """What becomes of a value outside its range (rule 18), and the fault bit that it sets.

    `fallback` (a value in SI, or `hold`) is for a value that is not finite.
    """

    on_range: Literal["saturate", "hold", "fault"] = "saturate"
    fallback: Fraction | Literal["hold"] | None = None
    fault: str | None = None


@dataclass(frozen=True)
class Input:
    """A value from outside; `values` are those of an `enum`."""

    name: str
    unit: Unit
    type: Type
    default: Fraction | None
    range: Range | None
    key: str
    span: Span
    values: tuple[str, ...] = ()
    limits: Limits = Limits()
    about: str = ""

    @property
    def truth(self) -> bool:
        """Tell whether it is true or false."""
        return self.type == "bool"


@dataclass(frozen=True)
class State:
    """A continuous variable, or what a sampled automaton carries from tick to tick."""

    name: str
    unit: Unit
    initial: Formula
    range: Range | None
    key: str
    span: Span
    type: Type = "real"
    values: tuple[str, ...] = ()
    limits: Limits = Limits()
    about: str = ""


@dataclass(frozen=True)
class Balance:
    """`left = right`, where left is a coefficient times der(state)."""

    state: str
    left: Tree
    right: Tree
    key: str


@dataclass(frozen=True)
class Invariant:
    """An assertion about a mode: what holds in it, and what is told where it does not."""

    that: Formula
    message: str


@dataclass(frozen=True)
class Transition:
    """From its mode to `target` when the guard held for `wait`, with resets."""

    name: str
    source: str
    target: str
    when: Formula
    wait: Formula | None
    priority: int | None
    reset: Mapping[str, Formula]
    key: str
    span: Span
    region: str = CHART
    memory: Literal["reset", "continue"] = "reset"


@dataclass(frozen=True)
class Observer:
    """A Kalman filter: dx/dt = A x + B u + f, y = C x + g, by row and column name.

    `of` is the mode of the model that A, B, f, C and g are taken from, at the point `at`; f and g
    read `constants` by their names. Where it `runs`, the run of its mode predicts the states.
    `limits` are those of the variances; `correct` is an input: whether a tick has measurements.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    measures: Mapping[str, str]
    a: Mapping[str, Mapping[str, Formula]]
    b: Mapping[str, Mapping[str, Formula]]
    c: Mapping[str, Mapping[str, Formula]]
    f: Mapping[str, Formula]
    process_noise: Mapping[str, Formula]
    measurement_noise: Mapping[str, Formula]
    key: str
    span: Span
    of: str | None = None
    at: Mapping[str, Formula] = field(default_factory=dict)
    g: Mapping[str, Formula] = field(default_factory=dict)
    constants: Mapping[str, Formula] = field(default_factory=dict)
    runs: bool = False
    gain: str = "steady"
    covariance: str = "steady"
    correct: str | None = None
    limits: Mapping[str, tuple[Formula, Formula]] = field(default_factory=dict)


@dataclass(frozen=True)
class Run:
    """A mode of the model run inside the tick, following the model's own transitions.

    Where it does not follow them it keeps the one flow. `linearise` is the point at which the
    flows are replaced by their tangents, None where they are not.
    """

    mode: str
    method: str
    substeps: int
    events: int
    key: str
    span: Span
    follow: bool = True
    linearise: Mapping[str, Formula] | None = None
    method_span: Span | None = None


@dataclass(frozen=True)
class Mode:
    """A discrete state: what holds and what happens in it.

    `beside` are the regions that run parallel to a mode of the chart; others have none.
    """

    name: str
    number: int
    equations: Mapping[str, Formula]
    flow: Mapping[str, Balance]
    update: Mapping[str, Formula]
    observer: Observer | None
    run: Run | None
    transitions: tuple[Transition, ...]
    key: str
    span: Span
    region: str = CHART
    beside: tuple[Region, ...] = ()
    entry: Mapping[str, Formula] = field(default_factory=dict)
    exit: Mapping[str, Formula] = field(default_factory=dict)
    invariants: Mapping[str, Invariant] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """The name of the mode, with that of its region if that is not the chart."""
        return self.name if self.region == CHART else f"{self.region}_{self.name}"


@dataclass(frozen=True)
class Region:
    """A parallel region: one of its modes is active at any time (rule 14)."""

    name: str
    modes: Mapping[str, Mode]
    initial: str
    span: Span

    @property
    def widest(self) -> int:
        """The largest number of transitions that leave one mode."""
        return max(len(mode.transitions) for mode in self.modes.values())


@dataclass(frozen=True)
class Element:
    """A part of the physics on which effects may be laid; `far` are what acts at its far end."""

    name: str
    kind: Literal["elastic", "inertia"]
    parts: Mapping[str, Formula]
    far: Mapping[str, Span]
    key: str
    span: Span


@dataclass(frozen=True)
class Automaton:
    """A hybrid automaton: sampled if it has a period, continuous otherwise.

    `modes` and `initial` are those of the chart; `regions` run parallel to it.
    """

    name: str
    period: Fraction | None
    step: Fraction
    model: Automaton | None
    parameters: Mapping[str, Parameter]
    inputs: Mapping[str, Input]
    states: Mapping[str, State]
    modes: Mapping[str, Mode]
    initial: str
    outputs: Mapping[str, Span]
    span: Span
    method: str = "rk4"
    dimensions: Mapping[str, Dimension] = field(default_factory=dict, repr=False)
    discrete: Mapping[str, State] = field(default_factory=dict)
    faults: Mapping[str, bool] = field(default_factory=dict)
    fault_mode: str | None = None
    kinds: Mapping[str, ValueKind] = field(default_factory=dict, repr=False)
    sources: Mapping[str, str] = field(default_factory=dict)
    elements: Mapping[str, Element] = field(default_factory=dict)
    places: Mapping[str, Mapping[str, Formula]] = field(default_factory=dict)
    regions: tuple[Region, ...] = ()
    numbers: NumberType = "float64"

    def source_of(self, output: str) -> str:
        """Return the state or equation that an output reads: its own name unless it says more."""
        return self.sources.get(output, output)

    @property
    def is_sampled(self) -> bool:
        """Tell whether the automaton ticks."""
        return self.period is not None

    @property
    def chart(self) -> Region:
        """The modes at the root, as a region."""
        return Region(CHART, self.modes, self.initial, self.span)

    @property
    def all_regions(self) -> tuple[Region, ...]:
        """The chart, then the regions beside it."""
        return (self.chart, *self.regions)

    @property
    def all_modes(self) -> tuple[Mode, ...]:
        """The modes of all regions, those of the chart first."""
        return tuple(mode for region in self.all_regions for mode in region.modes.values())

    def region(self, name: str) -> Region:
        """Return the region of a name."""
        return next(region for region in self.all_regions if region.name == name)

    def source(self, transition: Transition) -> Mode:
        """Return the mode that a transition leaves."""
        return self.region(transition.region).modes[transition.source]

    def target(self, transition: Transition) -> Mode:
        """Return the mode that a transition enters."""
        return self.region(transition.region).modes[transition.target]

    @property
    def carried(self) -> Mapping[str, State]:
        """The states and discrete variables: all that assignments may write."""
        return {**self.states, **self.discrete}

    @property
    def literals(self) -> Mapping[str, int]:
        """The names of enumerations with their numbers, those of the model too."""
        lists = [thing.values for thing in self.parameters.values()]
        lists += [thing.values for thing in self.inputs.values()]
        lists += [thing.values for thing in self.discrete.values()]
        own = {name: place for values in lists for place, name in enumerate(values)}
        return {**(self.model.literals if self.model else {}), **own}


@dataclass(frozen=True)
class Instance:
    """A named use of an automaton in a system."""

    name: str
    automaton: Automaton
    offset: Fraction
    key: str
    span: Span


@dataclass(frozen=True)
class SystemInput:
    """An input of a system."""

    name: str
    unit: Unit
    default: Fraction | None
    span: Span
    type: Type = "real"
    values: tuple[str, ...] = ()

    @property
    def truth(self) -> bool:
        """Tell whether it is true or false."""
        return self.type == "bool"


@dataclass(frozen=True)
class Connection:
    """What an input of an instance reads: a signal by name, a constant (SI) or an expression.

    Signals are inputs of the system, its sensors and lines, and outputs `instance.output`.
    """

    target: tuple[str, str]
    source: str | Fraction | Formula
    span: Span

    @property
    def reads(self) -> tuple[str, ...]:
        """The signals that are read."""
        if isinstance(self.source, Formula):
            return tuple(dict.fromkeys(name.path for name in names(self.source.tree)))
        return (self.source,) if isinstance(self.source, str) else ()


@dataclass(frozen=True)
class System:
    """Instances, how they are connected; `order`: how they and sensors run.

    `dimensions` are those of the outputs that are expressions with a real value.

    `alone` is the name of the one instance where the system was made around an automaton.
    """

    name: str
    inputs: Mapping[str, SystemInput]
    instances: Mapping[str, Instance]
    connections: Mapping[tuple[str, str], Connection]
    outputs: Mapping[str, str | Formula]
    order: tuple[str, ...]
    span: Span
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    lines: Mapping[str, Line] = field(default_factory=dict)
    dimensions: Mapping[str, Dimension] = field(default_factory=dict)
    alone: str | None = None

    @property
    def signals(self) -> tuple[str, ...]:
        """What can be recorded: inputs, outputs of instances, sensors, outputs of the system."""
        parts = [
            f"{i.name}.{name}" for i in self.instances.values() for name in i.automaton.outputs
        ]
        return tuple(dict.fromkeys([*self.inputs, *parts, *self.sensors, *self.outputs]))


@dataclass(frozen=True)
class Page:
    """A calibration from a time on: values [SI] of tunable parameters by instance and name."""

    time: Fraction
    values: Mapping[tuple[str, str], Fraction]


@dataclass(frozen=True)
class Scenario:
    """Inputs, initial values, horizon of a system and what is recorded of it.

    `horizon` is None where it is that of the recording; an initial value given as a text is the
    first value of that column; `signals` is empty where everything is recorded.
    """

    name: str
    of: str
    horizon: Fraction | None
    initial: Mapping[str, Fraction | str]
    inputs: Mapping[str, Stimulus]
    every: Fraction
    span: Span
    seed: int = 0
    signals: tuple[str, ...] = ()
    recording: RecordingUse | None = None
    pages: tuple[Page, ...] = ()


@dataclass(frozen=True)
class Column:
    """One signal of a recording: its columns (mean of them), target, unit and form."""

    name: str
    columns: tuple[str, ...]
    to: str | None
    compare: str | None
    unit: Unit
    scale: tuple[Fraction, Dimension]
    sign: int
    delay: Fraction
    blank: Literal["refuse", "skip"]
    time: str | None
    span: Span
    hold: Literal["previous", "linear"] = "previous"


@dataclass(frozen=True)
class RecordingMap:
    """How the columns of a recording become signals."""

    name: str
    time: str
    time_unit: Unit
    columns: Mapping[str, Column]
    constants: Mapping[str, tuple[Fraction, Dimension]]
    span: Span
