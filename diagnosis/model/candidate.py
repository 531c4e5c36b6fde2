"""Candidate: a compiled model with placed effects, and the parameters that a fit may change."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from codegen.predictor.predictor import Predictor, build_predictor, columns_of
from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.model.compile_cache import CompiledModel, cache_key, load_or_compile, node_text
from diagnosis.model.parameter import FreeParameter, free_parameters_of
from diagnosis.model.placed_effect import (
    DISTURBANCE_STATE,
    PlacedEffect,
    automaton_with_effects,
    effect_names,
    lower_tunable_program,
    minimum_substeps,
)
from language.expressions.syntax_tree import Arithmetic, Name, names
from language.lowering.delay_buffers import memory_calls_by_key
from language.model.automaton import Automaton
from language.model.declaration import Formula, Parameter, State
from language.overlays.expand_document import Project
from language.overlays.name_types import format_si_unit
from language.text.document import Document

INITIAL_VALUE_NAME = "start_of_{}"
"""Name of the tunable parameter that replaces the initial value of a compared state."""
INITIAL_OFFSET_NAME = "start_offset_of_{}"
"""Name of the tunable parameter that is added to the initial value of a state."""
INITIAL_STD_FRACTION = 0.01
"""Initial standard deviation of a state, as a fraction of its range."""


@dataclass(frozen=True)
class Candidate:
    """A compiled model: the effects placed on the base, its metadata and its predictor.

    `magnitudes` are those of signals [SI] by the powers of their units, for states without a range.
    """

    placed_effects: tuple[PlacedEffect, ...]
    compiled: CompiledModel
    predictor: Predictor
    magnitudes: Mapping[tuple[int, ...], float] = field(default_factory=dict, repr=False)

    @property
    def free_parameters(self) -> tuple[FreeParameter, ...]:
        """The free parameters of a fit."""
        return self.compiled.free_parameters

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the free parameters, in their order."""
        return tuple(one.name for one in self.free_parameters)

    @property
    def disturbance_states(self) -> tuple[str, ...]:
        """The names of the disturbance states, in the order of the disturbances."""
        return self.compiled.disturbance_states

    @cached_property
    def state_ranges(self) -> Reals:
        """The width (high - low, SI) of the range of each state (states,).

        A state without a range has the magnitude of its unit, 1 if that is not known. One that an
        effect adds has 1: a far off initial value could stand for another effect.
        """
        one = self.compiled
        parts = zip(one.state_ranges, one.state_dimensions, one.is_effect_state, strict=True)
        return np.array(
            [
                width or (1.0 if is_added else self.magnitudes.get(powers, 1.0))
                for width, powers, is_added in parts
            ]
        )

    @cached_property
    def is_effect_state(self) -> NDArray[np.bool_]:
        """The mask (states,) of states that placed effects add (not those of disturbances)."""
        return np.array(self.compiled.is_effect_state, dtype=np.bool_)

    @cached_property
    def is_per_recording(self) -> NDArray[np.bool_]:
        """The mask (parameters,) of free parameters with a separate value for each recording."""
        return np.array([one.per_recording for one in self.free_parameters], dtype=np.bool_)

    @cached_property
    def bounds(self) -> Reals:
        """The bounds of the free parameters as coordinates (parameters, 2): lower, upper."""
        ranges = [one.bounds for one in self.free_parameters]
        return np.array(ranges, dtype=np.float64).reshape(-1, 2)

    def calibration_page(self, values: Mapping[str, float], series: SampledRecording) -> Reals:
        """Return the calibration page (tunables,) of `values` [SI] for one recording."""
        page: Reals = self.calibration_pages([values], series.first_measured[np.newaxis])[0]
        return page

    def calibration_pages(
        self, values: Sequence[Mapping[str, float]], first_measured: Reals
    ) -> Reals:
        """Return the calibration pages (recordings, tunables) of values [SI] of recordings.

        Other tunables have their defaults. `first_measured` (recordings, outputs) gives the initial
        values of compared states; a NaN keeps the value of the page.
        """
        is_shared = all(own is values[0] for own in values)
        defaults = self.predictor.page
        pages = np.array(
            [
                list({**defaults, **own}.values())[: len(defaults)]
                for own in (values[:1] if is_shared else values)
            ]
        )
        pages = np.repeat(pages, len(values), axis=0) if is_shared else pages
        columns, places = self._initial_value_columns
        initial_values = first_measured[:, columns]
        pages[:, places] = np.where(np.isfinite(initial_values), initial_values, pages[:, places])
        return pages

    @cached_property
    def _initial_value_columns(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The indices of outputs that are states, and of their initial values in the page."""
        places = {name: place for place, name in enumerate(self.predictor.page)}
        fresh = [INITIAL_VALUE_NAME.format(name) for name in self.predictor.outputs]
        known = [(k, places[name]) for k, name in enumerate(fresh) if name in places]
        columns, starts = np.array(known, dtype=np.intp).reshape(-1, 2).T
        return columns, starts


def compile_candidate(
    document: Document,
    project: Project,
    placed_effects: Sequence[PlacedEffect],
    disturbances: Sequence[PlacedEffect],
    output_names: Sequence[str],
    period: Fraction,
    offset_states: Sequence[str] = (),
    min_substeps: int = 1,
) -> Candidate:
    """Return the base with effects and disturbances, compiled for a sample period [s].

    Initial values of states among `output_names` become tunable. The initial values of
    `offset_states` have an offset for each recording, a free parameter (`INITIAL_OFFSET_NAME`)
    whose prior has a standard deviation of `INITIAL_STD_FRACTION` (1 %) of the range of its state.
    A sample has at least `min_substeps` major steps. Raises SpecError, and
    MissingToolError or BuildError if no C compiler works.
    """
    all_layers = [*placed_effects, *disturbances]
    parts = [
        f"{one.id} {one.suffix} {one.scales} {node_text(one.effect.body)}" for one in all_layers
    ]
    counts = f"{len(placed_effects)} effects, {len(disturbances)} disturbances"
    offsets = [INITIAL_OFFSET_NAME.format(name) for name in offset_states]
    key = cache_key(node_text(document.root), counts, *parts, *output_names, str(period), *offsets)
    if min_substeps > 1:
        key = cache_key(key, str(min_substeps))

    def make() -> tuple[CompiledModel, bytes]:
        made = automaton_with_effects(document, project, all_layers)
        return _compile(
            made, placed_effects, disturbances, output_names, period, offset_states, min_substeps
        )

    recipe, library = load_or_compile(key, make)
    return Candidate(tuple(placed_effects), recipe, Predictor(recipe.columns, library))


def _compile(
    automaton: Automaton,
    placed_effects: Sequence[PlacedEffect],
    disturbances: Sequence[PlacedEffect],
    output_names: Sequence[str],
    period: Fraction,
    offset_states: Sequence[str],
    min_substeps: int,
) -> tuple[CompiledModel, bytes]:
    """Return the metadata and the shared library of an automaton with its effects, built now."""
    effect_parameters = [name for one in placed_effects for name in effect_names(one)]
    uncertain = free_parameters_of(automaton, effect_parameters)
    uncertain += tuple(_offset_parameter(automaton.states[name]) for name in offset_states)
    with_initial_values = _with_tunable_initial_values(automaton, output_names)
    with_initial_values = _with_initial_offsets(with_initial_values, offset_states)
    added = [name for name in with_initial_values.parameters if name not in automaton.parameters]
    names = list(dict.fromkeys([*(one.name for one in uncertain), *added]))
    min_count = minimum_substeps(automaton, placed_effects, output_names, period)
    min_count = max(min_count, min_substeps)
    program, substeps = lower_tunable_program(
        with_initial_values, names, effect_parameters, period, min_count
    )
    columns = columns_of(program, output_names)
    ranges = [automaton.states[name].range for name in columns.states]
    recipe = CompiledModel(
        columns,
        substeps,
        tuple(float(r[1] - r[0]) if r else 0.0 for r in ranges),
        uncertain,
        tuple(one.qualified_name(DISTURBANCE_STATE) for one in disturbances),
        tuple(
            float(automaton.parameters[one.qualified_name("memory")].value or 1)
            for one in disturbances
        ),
        _delay_parameters(automaton),
        tuple(name in effect_parameters for name in columns.states),
        tuple(automaton.states[name].unit.dimension.powers for name in columns.states),
    )
    with build_predictor(program, columns) as library:
        return recipe, library.read_bytes()


def _offset_parameter(state: State) -> FreeParameter:
    """Return the free parameter of the initial offset of a state, with a value per recording."""
    width = float(state.range[1] - state.range[0]) if state.range else 1.0
    name, unit = INITIAL_OFFSET_NAME.format(state.name), format_si_unit(state.unit.dimension)
    std = INITIAL_STD_FRACTION * width
    return FreeParameter(name, 0.0, -width, width, std, False, per_recording=True, unit=unit)


def _with_initial_offsets(automaton: Automaton, offset_states: Sequence[str]) -> Automaton:
    """Return an automaton in which a new parameter is added to the initial value of some states."""
    parameters, states = dict(automaton.parameters), dict(automaton.states)
    for name in offset_states:
        state = states[name]
        offset, span = INITIAL_OFFSET_NAME.format(name), state.span
        parameters[offset] = Parameter(
            offset, "fixed", state.unit, Fraction(0), None, None, f"parameters.{offset}", span
        )
        total = Arithmetic("+", state.initial.tree, Name(offset, span), span)
        states[name] = dataclasses.replace(state, initial=Formula(total, state.initial.key))
    return dataclasses.replace(automaton, parameters=parameters, states=states)


def _delay_parameters(automaton: Automaton) -> tuple[str, ...]:
    """Return the parameters that occur in the time of a `delay`, in the automaton's order."""
    times = [tree.arguments[1] for tree in memory_calls_by_key(automaton, ("delay",)).values()]
    read = {part.path for time in times for part in names(time)}
    return tuple(name for name in automaton.parameters if name in read)


def _with_tunable_initial_values(automaton: Automaton, output_names: Sequence[str]) -> Automaton:
    """Return an automaton in which initial values of compared states are parameters.

    This includes outputs that an effect alters: the state still starts near the measured value.
    """
    parameters, states = dict(automaton.parameters), dict(automaton.states)
    for output in output_names:
        state = states.get(output)
        if state is not None:
            fresh = INITIAL_VALUE_NAME.format(output)
            key, span = f"parameters.{fresh}", state.span
            parameters[fresh] = Parameter(
                fresh, "fixed", state.unit, Fraction(0), None, None, key, span
            )
            formula = Formula(Name(fresh, span), state.initial.key)
            states[output] = dataclasses.replace(state, initial=formula)
    return dataclasses.replace(automaton, parameters=parameters, states=states)
