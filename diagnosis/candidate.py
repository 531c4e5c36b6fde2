"""Candidate: a model with layers, compiled, with the parameters that a fit may move."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from codegen.predictor import Predictor, built, columns_of
from diagnosis.layers import DRIFT, Layer, automaton, fewest_steps, stepped
from diagnosis.recipe import Recipe, kept, node_text, recipe_key
from diagnosis.series import Series
from diagnosis.uncertain import Uncertain, uncertain_of
from language.declaration import Formula, Parameter
from language.document import Document
from language.effect import own_names
from language.memory import applications
from language.model import Automaton
from language.project import Project
from language.syntax import Name, names

Reals = NDArray[np.float64]
START = "start_of_{}"
"""The tunable that the start value of a compared state becomes."""


@dataclass(frozen=True)
class Candidate:
    """A compiled model: `layers` over the base, its recipe, and its library.

    `levels` are those of its noises, where a fit may move these beside its parameters.
    """

    layers: tuple[Layer, ...]
    recipe: Recipe
    predictor: Predictor
    levels: tuple[Uncertain, ...] = ()

    @cached_property
    def uncertain(self) -> tuple[Uncertain, ...]:
        """What a fit may move: parameters, behind them levels."""
        return self.recipe.uncertain + self.levels

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the uncertain parameters."""
        return tuple(one.name for one in self.uncertain)

    @property
    def drifts(self) -> tuple[str, ...]:
        """The states that drift."""
        return self.recipe.drifts

    @cached_property
    def spans(self) -> Reals:
        """The width of the range of each state (states,), 1 where it has none."""
        return np.array(self.recipe.spans)

    @cached_property
    def brought(self) -> NDArray[np.bool_]:
        """Which states effects have brought (states,)."""
        return np.array(self.recipe.brought, dtype=np.bool_)

    @cached_property
    def own(self) -> NDArray[np.bool_]:
        """Which parameters each recording has of its own (parameters,)."""
        return np.array([one.per_recording for one in self.uncertain], dtype=np.bool_)

    @cached_property
    def bounds(self) -> Reals:
        """The ranges as coordinates (parameters, 2)."""
        ranges = [one.bounds for one in self.uncertain]
        return np.array(ranges, dtype=np.float64).reshape(-1, 2)

    def page(self, values: Mapping[str, float], series: Series) -> Reals:
        """Return the calibration for one recording: values, and where its states start."""
        return np.asarray(self.pages([values], series.first[np.newaxis])[0], dtype=np.float64)

    def pages(self, values: Sequence[Mapping[str, float]], first: Reals) -> Reals:
        """Return the calibration for each recording (recordings, tunables) from its values.

        `first` (recordings, seen) are the values that its signals start with, NaN if unknown.
        """
        alike = all(own is values[0] for own in values)
        rows = [list({**self._known, **own}.values()) for own in (values[:1] if alike else values)]
        width = len(self._known)
        found = np.array([row[:width] for row in rows])
        found = np.repeat(found, len(values), axis=0) if alike else found
        columns, places = self._starts
        begun = first[:, columns]
        known = np.isfinite(begun)
        found[:, places] = begun if known.all() else np.where(known, begun, found[:, places])
        return found

    @cached_property
    def _known(self) -> dict[str, float]:
        return dict(self.predictor.page)

    @cached_property
    def _starts(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The columns of compared signals, and of the page where each one's state starts."""
        places = {name: place for place, name in enumerate(self.predictor.page)}
        fresh = [(k, START.format(name)) for k, name in enumerate(self.predictor.seen)]
        known = [(k, places[name]) for k, name in fresh if name in places]
        columns, starts = np.array(known, dtype=np.intp).reshape(-1, 2).T
        return columns, starts


def candidate(
    document: Document,
    project: Project,
    layers: Sequence[Layer],
    drifts: Sequence[Layer],
    seen: Sequence[str],
    period: Fraction,
) -> Candidate:
    """Return the base with layers and drifts, compiled for a period [s] between samples.

    Raises SpecError, ToolMissing.
    """
    all_layers = [*layers, *drifts]
    parts = [f"{layer.id} {layer.ending} {node_text(layer.effect.body)}" for layer in all_layers]
    key = recipe_key(node_text(document.root), *parts, *seen, str(period))

    def make() -> tuple[Recipe, bytes]:
        made = automaton(document, project, all_layers)
        return _compiled(made, layers, drifts, seen, period)

    recipe, library = kept(key, make)
    return Candidate(tuple(layers), recipe, Predictor(recipe.columns, library))


def _compiled(
    made: Automaton,
    layers: Sequence[Layer],
    drifts: Sequence[Layer],
    seen: Sequence[str],
    period: Fraction,
) -> tuple[Recipe, bytes]:
    brought = [layer.named(name) for layer in layers for name in own_names(layer.effect.body)]
    uncertain = uncertain_of(made, brought)
    started = _with_starts(made, seen)
    starts = [name for name in started.parameters if name not in made.parameters]
    names = [*(one.name for one in uncertain), *starts]
    fewest = fewest_steps(made, layers, seen, period)
    program, substeps = stepped(started, names, brought, period, fewest)
    columns = columns_of(program, seen)
    ranges = [made.states[name].range for name in columns.states]
    recipe = Recipe(
        columns,
        substeps,
        tuple(float(r[1] - r[0]) if r else 1.0 for r in ranges),
        uncertain,
        tuple(layer.named(DRIFT) for layer in drifts),
        tuple(float(made.parameters[layer.named("memory")].value or 1) for layer in drifts),
        _delays(made),
        tuple(name in brought for name in columns.states),
    )
    with built(program, columns) as library:
        return recipe, library.read_bytes()


def _delays(made: Automaton) -> tuple[str, ...]:
    """Return the uncertain parameters that are the time of a `delay`."""
    times = [tree.arguments[1] for tree in applications(made, ("delay",)).values()]
    read = {part.path for time in times for part in names(time)}
    return tuple(name for name in made.parameters if name in read)


def _with_starts(given: Automaton, seen: Sequence[str]) -> Automaton:
    """Return an automaton in which each compared state starts at a tunable of its own.

    Also where an effect shows something else in its place: it starts near it.
    """
    parameters, states = dict(given.parameters), dict(given.states)
    for output in seen:
        state = states.get(output)
        if state is not None:
            fresh = START.format(output)
            key, span = f"parameters.{fresh}", state.span
            parameters[fresh] = Parameter(
                fresh, "fixed", state.unit, Fraction(0), None, None, key, span
            )
            formula = Formula(Name(fresh, span), state.initial.key)
            states[output] = dataclasses.replace(state, initial=formula)
    return dataclasses.replace(given, parameters=parameters, states=states)
