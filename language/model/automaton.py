"""Automaton: the data classes of a checked hybrid automaton.

An automaton consists of regions of modes. A mode has balances, equations, transitions, and
optionally an observer or a run of a model. The readers build these classes, the checks examine
them, and the lowering translates them to a Program.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Literal

from language.expressions.syntax_tree import SyntaxTree
from language.expressions.units import Dimension
from language.ir.number_type import NumberType
from language.ir.root_region import CHART
from language.model.declaration import Formula, Input, Parameter, State
from language.model.statechart import Chart, HistoryKind
from language.model.truth_table import TruthTable
from language.text.diagnostic import Span
from language.text.document import ScalarNode
from language.typecheck.types import ExprType as ValueKind


@dataclass(frozen=True)
class Balance:
    """An equation `left = right` in which `left` is a coefficient times `der(state)`."""

    state: str
    left: SyntaxTree
    right: SyntaxTree
    key: str


@dataclass(frozen=True)
class Invariant:
    """An assertion about a mode: its condition, and the message of the event of a violation."""

    condition: Formula
    message: str


@dataclass(frozen=True)
class Rewind:
    """A rollback of a transition to the instant at which `until` became true.

    The instant lies at most `within` [s] in the past (language/programs/rewind.py). If no such
    instant is found, the transition fires without a rollback, and the fault bit `rewind_limit` is
    set if `is_fault`.
    """

    until: Formula
    within: Formula
    span: Span
    is_fault: bool = True


@dataclass(frozen=True)
class Transition:
    """A change from the mode `source` to `target`, enabled when `when` has been true for `wait`.

    `reset` gives the assignments to states and discrete variables. `memory` tells whether the wait
    counters of the target are reset or continue. The remaining fields matter in a chart only.
    `events` are the events that the transition reacts to (empty: any micro-step), `raises` the
    events that it raises. `targets` are its target modes; without any it is taken without a change
    of mode. `history` tells whether a superstate is entered at the modes that were active last. An
    `internal` transition does not leave its source. The guard of a completion transition
    (`is_completion`) is that a final mode is active in the source. `is_table_cell` marks a
    transition of a transition table.
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
    """A Kalman filter dx/dt = A x + B u + f, y = C x + g, with matrices by row and column name.

    If `of` is set, A, B, f, C and g are taken from that mode of the model at the point `at`; f and
    g may read `constants` by name. If `predicts_by_run` is set, the run of the observer's mode
    predicts the states. `variance_limits` are the lower and upper limits of the variances.
    `correct` names an input that tells whether a tick has measurements. `unknown_instant` gives for
    an input the time [s] within which its new value was sampled, at an unknown instant.
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
    """A mode of the model that is integrated inside a tick of a sampled automaton (rule 2c).

    If `follow` is false, the run ignores the transitions of the model and keeps the flow of `mode`.
    `linearise` is the point at which each flow is replaced by its tangent, or None for no
    replacement.
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
    """A discrete state with its equations, flow, actions and transitions.

    `parallel_regions` are the regions that run parallel to a mode of the region `chart`; it is
    empty for other modes.
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
        """The name of the mode as an identifier: underscores replace dots.

        It is prefixed by the name of the region unless that is `chart`.
        """
        name = self.name if self.region == CHART else f"{self.region}_{self.name}"
        return name.replace(".", "_")

    @property
    def has_entry_or_exit(self) -> bool:
        """Whether the mode has entry or exit actions."""
        return bool(self.entry or self.exit)

    @property
    def jump_assignments(self) -> tuple[Mapping[str, Formula], ...]:
        """The resets of its transitions, its entry and its exit, each by variable."""
        return (*(transition.reset for transition in self.transitions), self.entry, self.exit)


@dataclass(frozen=True)
class Region:
    """A set of modes of which one is active at any time (rule 14).

    A region inside a mode is inactive while that mode is left; its mode variable then holds the
    number `inactive`. For a region of the root `inactive` is None.
    """

    name: str
    modes: Mapping[str, Mode]
    initial: str
    span: Span
    inactive: int | None = None

    @cached_property
    def max_transitions(self) -> int:
        """The largest number of transitions of one mode of the region.

        Transitions without a target count too.
        """
        return max(len(mode.transitions) for mode in self.modes.values())


@dataclass(frozen=True)
class Element:
    """A two-terminal part to which effects can be applied.

    `parts` are its quantities by key, such as `twist` and `torque`, and `far` are the names of the
    loads at its far end.
    """

    name: str
    kind: Literal["elastic", "inertia"]
    parts: Mapping[str, Formula]
    far: Mapping[str, Span]
    key: str
    span: Span


@dataclass(frozen=True)
class Automaton:
    """A hybrid automaton: sampled if it has a period [s], continuous otherwise.

    `modes` and `initial` belong to the region `chart`, and `regions` run parallel to it. In a chart
    with nested modes, `modes` holds the innermost modes, `superstates` the others, and `statechart`
    the tree.
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
        """Return the name of the state or equation that an output reads.

        By default it is the name of the output.
        """
        return self.output_sources.get(output, output)

    @property
    def is_sampled(self) -> bool:
        """Whether the automaton executes once a period."""
        return self.period is not None

    @cached_property
    def root_region(self) -> Region:
        """The modes of the root as the region `chart`."""
        return Region(CHART, self.modes, self.initial, self.span)

    @cached_property
    def all_regions(self) -> tuple[Region, ...]:
        """The region `chart`, then the parallel regions in the order of the file."""
        return (self.root_region, *self.regions)

    @cached_property
    def all_modes(self) -> tuple[Mode, ...]:
        """The modes of all regions, those of `chart` first, then the superstates."""
        inner = (mode for region in self.all_regions for mode in region.modes.values())
        return (*inner, *self.superstates)

    @cached_property
    def all_transitions(self) -> tuple[Transition, ...]:
        """The transitions of `all_modes`, mode by mode."""
        return tuple(transition for mode in self.all_modes for transition in mode.transitions)

    @cached_property
    def modes_by_key(self) -> Mapping[str, Mode]:
        """All modes, those of all regions and the superstates, by key path."""
        return {mode.key: mode for mode in self.all_modes}

    @cached_property
    def _regions_by_name(self) -> Mapping[str, Region]:
        """All regions by name; of equal names the first one counts."""
        return {region.name: region for region in reversed(self.all_regions)}

    def region(self, name: str) -> Region:
        """Return the region of a name, "chart" for the root; of equal names the first one counts.

        Raises KeyError for an unknown name.
        """
        return self._regions_by_name[name]

    def source_mode(self, transition: Transition) -> Mode:
        """Return the mode, possibly a superstate, that a transition leaves.

        It is the mode named `source` in the region of the transition, an innermost mode before a
        superstate. Raises KeyError for an unknown region and StopIteration without such a mode.
        """
        innermost = self.region(transition.region).modes.get(transition.source)
        return innermost or next(
            mode
            for mode in self.superstates
            if (mode.region, mode.name) == (transition.region, transition.source)
        )

    def target_mode(self, transition: Transition) -> Mode:
        """Return the innermost mode named `target` in the region of a transition.

        Raises KeyError if the region has no such mode, for example for a superstate.
        """
        return self.region(transition.region).modes[transition.target]

    @cached_property
    def state_variables(self) -> Mapping[str, State]:
        """The states, then the discrete variables, by name: what assignments may write."""
        return {**self.states, **self.discrete}

    @cached_property
    def enum_literals(self) -> Mapping[str, int]:
        """The integer values of all enumeration literals by name, those of the model included.

        A literal's value is its index in the declaration. Of equal names that of a discrete
        variable counts before that of an input, of a parameter and of the model.
        """
        literals = [parameter.values for parameter in self.parameters.values()]
        literals += [variable.values for variable in self.inputs.values()]
        literals += [variable.values for variable in self.discrete.values()]
        own = {name: index for values in literals for index, name in enumerate(values)}
        return {**(self.model.enum_literals if self.model else {}), **own}
