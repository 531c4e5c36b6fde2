"""Model: a checked automaton - regions of modes with balances, transitions, observers and runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Literal

from language.expressions.syntax_tree import SyntaxTree
from language.expressions.units import Dimension
from language.ir.number_type import NumberType
from language.ir.regions import CHART
from language.model.declaration import Formula, Input, Parameter, State
from language.model.statechart import Chart, HistoryKind
from language.model.truth_table import TruthTable
from language.text.diagnostic import Span
from language.text.document import ScalarNode
from language.typecheck.types import ExprType as ValueKind


@dataclass(frozen=True)
class Balance:
    """`left = right`, where left is a coefficient times der(state)."""

    state: str
    left: SyntaxTree
    right: SyntaxTree
    key: str


@dataclass(frozen=True)
class Invariant:
    """An assertion about a mode: what holds in it, and what is told where it does not."""

    condition: Formula
    message: str


@dataclass(frozen=True)
class Rewind:
    """Back to where `until` turned true, at most `within` [s] ago (language/programs/rewind.py).

    Where that is not found it fires as without it: a fault bit is set if that `is_fault`.
    """

    until: Formula
    within: Formula
    span: Span
    is_fault: bool = True


@dataclass(frozen=True)
class Transition:
    """From its mode to `target` when the guard held for `wait`, with resets.

    In a chart it may wait for one of `events`, raise others, have several `targets` (none: it
    stays), enter what its target was left in (`history`), and not leave its source (`internal`);
    where it `completes` its guard is that its source has come to its end. Of a transition table
    its target is `in_cell`: several may share the guard.
    """

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
    rewind: Rewind | None = None
    targets: tuple[str, ...] = ()
    events: tuple[str, ...] = ()
    raises: tuple[str, ...] = ()
    history: HistoryKind = ""
    internal: bool = False
    is_completion: bool = False
    is_table_cell: bool = False


@dataclass(frozen=True)
class Observer:
    """A Kalman filter: dx/dt = A x + B u + f, y = C x + g, by row and column name.

    `of` is the mode of the model that A, B, f, C and g are taken from, at the point `at`; f and g
    read `constants` by their names. Where it `runs`, the run of its mode predicts the states.
    `limits` are those of the variances; `correct` is an input: whether a tick has measurements.
    A new value of an input in `unknown_instant` was taken at some instant of that time before.
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
    predicts_by_run: bool = False
    gain: str = "steady"
    covariance: str = "steady"
    correct: str | None = None
    variance_limits: Mapping[str, tuple[Formula, Formula]] = field(default_factory=dict)
    unknown_instant: Mapping[str, Formula] = field(default_factory=dict)


@dataclass(frozen=True)
class ModelRun:
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
    run: ModelRun | None
    transitions: tuple[Transition, ...]
    key: str
    span: Span
    region: str = CHART
    parallel_regions: tuple[Region, ...] = ()
    entry: Mapping[str, Formula] = field(default_factory=dict)
    exit: Mapping[str, Formula] = field(default_factory=dict)
    invariants: Mapping[str, Invariant] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """The name of the mode, with that of its region if that is not the chart."""
        name = self.name if self.region == CHART else f"{self.region}_{self.name}"
        return name.replace(".", "_")


@dataclass(frozen=True)
class Region:
    """A parallel region: one of its modes is active at any time (rule 14).

    One that stands inside a mode is in none, and has the number `inactive`, while that is left.
    """

    name: str
    modes: Mapping[str, Mode]
    initial: str
    span: Span
    inactive: int | None = None

    @cached_property
    def max_transitions(self) -> int:
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

    `modes` and `initial` are those of the chart; `regions` run parallel to it. Where modes stand
    inside modes, `modes` are the innermost ones, `superstates` all others; `tree` is their order.
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
    name_types: Mapping[str, ValueKind] = field(default_factory=dict, repr=False)
    output_sources: Mapping[str, str] = field(default_factory=dict)
    elements: Mapping[str, Element] = field(default_factory=dict)
    places: Mapping[str, Mapping[str, Formula]] = field(default_factory=dict)
    regions: tuple[Region, ...] = ()
    numbers: NumberType = "float64"
    recording_map: ScalarNode | None = field(default=None, repr=False)
    tables: tuple[TruthTable, ...] = ()
    superstates: tuple[Mode, ...] = ()
    statechart: Chart | None = None

    def output_source(self, output: str) -> str:
        """Return the state or equation that an output reads: its own name unless it says more."""
        return self.output_sources.get(output, output)

    @property
    def is_sampled(self) -> bool:
        """Tell whether the automaton ticks."""
        return self.period is not None

    @cached_property
    def root_region(self) -> Region:
        """The modes at the root, as a region."""
        return Region(CHART, self.modes, self.initial, self.span)

    @cached_property
    def all_regions(self) -> tuple[Region, ...]:
        """The chart, then the regions beside it."""
        return (self.root_region, *self.regions)

    @cached_property
    def all_modes(self) -> tuple[Mode, ...]:
        """The modes of all regions, those of the chart first; superstates last."""
        inner = (mode for region in self.all_regions for mode in region.modes.values())
        return (*inner, *self.superstates)

    @cached_property
    def modes_by_key(self) -> Mapping[str, Mode]:
        """All modes by their key path."""
        return {mode.key: mode for mode in self.all_modes}

    @cached_property
    def _regions_by_name(self) -> Mapping[str, Region]:
        return {region.name: region for region in reversed(self.all_regions)}

    def region(self, name: str) -> Region:
        """Return the region of a name."""
        return self._regions_by_name[name]

    def source_mode(self, transition: Transition) -> Mode:
        """Return the mode that a transition leaves."""
        found = self.region(transition.region).modes.get(transition.source)
        return found or next(
            mode
            for mode in self.superstates
            if (mode.region, mode.name) == (transition.region, transition.source)
        )

    def target_mode(self, transition: Transition) -> Mode:
        """Return the mode that a transition enters."""
        return self.region(transition.region).modes[transition.target]

    @cached_property
    def state_variables(self) -> Mapping[str, State]:
        """The states and discrete variables: all that assignments may write."""
        return {**self.states, **self.discrete}

    @cached_property
    def enum_literals(self) -> Mapping[str, int]:
        """The names of enumerations with their numbers, those of the model too."""
        lists = [thing.values for thing in self.parameters.values()]
        lists += [thing.values for thing in self.inputs.values()]
        lists += [thing.values for thing in self.discrete.values()]
        own = {name: place for values in lists for place, name in enumerate(values)}
        return {**(self.model.enum_literals if self.model else {}), **own}
