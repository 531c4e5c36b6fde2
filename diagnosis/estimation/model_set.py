"""Model set: the base, the recordings and the effects from which candidates are compiled."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

import numpy as np

from diagnosis.data.sampled_recording import SampledRecording
from diagnosis.estimation.checkpoint import NO_CACHE, FitCache
from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.signal_magnitude import balance_coefficient, signal_magnitudes
from diagnosis.model.candidate import Candidate, compile_candidate
from diagnosis.model.placed_effect import (
    PlacedEffect,
    disturbance_effect,
    find_placements,
    place_path,
)
from language.expressions.units import parse_unit
from language.model.automaton import Automaton
from language.overlays.effect_reader import Effect
from language.overlays.expand_document import Project
from language.text.diagnostic import SpecError
from language.text.document import Document

FitFunction = Callable[[], Estimate]
NO_STORAGE = (parse_unit("1").dimension.powers, parse_unit("s").dimension.powers)
"""Dimensions of the coefficient of der(x) without a storage: a position, the filter of a sensor."""
EXCLUDED_EFFECTS = ("unknown_input", "sensor_quantisation")
"""Effects that are no candidates: one is detected as a disturbance, one only adds noise."""


@dataclass(frozen=True)
class ModelSet:
    """A base automaton, recordings with a common period, and the effects that may be placed on it.

    `disturbances` are the disturbances that every candidate has by default. `scales` are the
    magnitudes [SI] of places by their paths; without them effects have those of SI units.
    """

    document: Document
    project: Project
    automaton: Automaton
    effects: tuple[Effect, ...]
    series: tuple[SampledRecording, ...]
    output_names: tuple[str, ...]
    disturbances: tuple[PlacedEffect, ...]
    fit_cache: FitCache = NO_CACHE
    scales: Mapping[str, Mapping[str, Fraction]] = field(default_factory=dict, repr=False)
    _compiled: dict[tuple[str, ...], Candidate] = field(default_factory=dict, repr=False)

    def load_or_fit(
        self, label: str, candidate: Candidate, dependencies: Sequence[object], fit: FitFunction
    ) -> Estimate:
        """Return a fit to the recordings of the model set, from its fit cache or computed by `fit`.

        `label`, the candidate, the recordings and `dependencies` determine the key; see
        `FitCache.load_or_fit`.
        """
        return self.fit_cache.load_or_fit(label, candidate, self.series, dependencies, fit)

    @property
    def period(self) -> Fraction:
        """The time [s] between samples of the first recording, which all recordings have."""
        return self.series[0].period

    @cached_property
    def magnitudes(self) -> dict[tuple[int, ...], float]:
        """The magnitudes [SI] of signals by the powers of their units (`signal_magnitudes`)."""
        return signal_magnitudes(self.document, self.automaton, self.series, self.output_names)

    def compile_candidate(
        self,
        placed_effects: Sequence[PlacedEffect],
        disturbances: Sequence[PlacedEffect] | None = None,
    ) -> Candidate:
        """Return the base with effects and disturbances, compiled once per combination and order.

        Without `disturbances` those of the model set are used; an empty sequence means none. Raises
        SpecError if they cannot be combined.
        """
        disturbances = self.disturbances if disturbances is None else disturbances
        key = tuple(
            f"{one.id} {sorted(one.scales.items())}" for one in (*placed_effects, *disturbances)
        )
        if key not in self._compiled:
            candidate = compile_candidate(
                self.document,
                self.project,
                placed_effects,
                disturbances,
                self.output_names,
                self.period,
            )
            self._compiled[key] = dataclasses.replace(candidate, magnitudes=self.magnitudes)
        return self._compiled[key]

    def applicable_effects(self) -> Iterator[PlacedEffect]:
        """Yield every effect at every place where the recordings could show it.

        `EXCLUDED_EFFECTS` are left out, as are inputs that are constant in every recording, outputs
        that are not compared, and balances of no storage. The order is that
        of `effects`, then of the places. Whether the model compiles with an effect is not checked.
        """
        candidates = (one for one in self.effects if one.name not in EXCLUDED_EFFECTS)
        for effect in candidates:
            for placed_effect in find_placements(self.document, effect):
                if self._is_applicable(placed_effect):
                    scales = self.scales.get(place_path(placed_effect), {})
                    yield dataclasses.replace(placed_effect, scales=scales)

    def scale_disturbance(self, disturbance: PlacedEffect) -> PlacedEffect:
        """Return a disturbance with the median reference time of the recordings as magnitude of its
        place, rounded to one digit.
        """
        middle = float(np.median([one.reference_time for one in self.series]))
        return dataclasses.replace(disturbance, scales={"time": Fraction(f"{middle:.0e}")})

    def try_compile(self, placed_effects: Sequence[PlacedEffect]) -> Candidate | None:
        """Return the base with effects, or None if they cannot be combined (SpecError).

        The disturbances are those of the model set. Other errors are raised.
        """
        try:
            return self.compile_candidate(placed_effects)
        except SpecError:
            return None

    def try_compile_all(
        self, combinations: Sequence[Sequence[PlacedEffect]]
    ) -> list[Candidate | None]:
        """Return `try_compile` of each combination in their order, compiled in parallel threads.

        A combination that cannot be compiled is None.
        """
        with ThreadPoolExecutor(os.cpu_count()) as compilers:
            return list(compilers.map(self.try_compile, combinations))

    def _is_applicable(self, placed_effect: PlacedEffect) -> bool:
        """Return whether recordings can show an effect at its place.

        An input must vary in a recording, an output must be compared, and a balance must be that of
        a storage, such as a mass or a heat capacity.
        """
        name = placed_effect.place
        if name in self.automaton.inputs:
            column = list(self.automaton.inputs).index(name)
            return any(float(one.inputs[:, column].std()) > 0.0 for one in self.series)
        if (
            name in self.automaton.states
            and placed_effect.effect.place_patterns[0].kind == "balance"
        ):
            return _is_storage_balance(self.document, name)
        if placed_effect.effect.place_patterns[0].kind == "output":
            return name in self.output_names
        return True


def balance_disturbances(document: Document, automaton: Automaton) -> tuple[PlacedEffect, ...]:
    """Return a disturbance for each state with the balance of a storage, in their order."""
    return tuple(
        disturbance_effect("balance", name)
        for name in automaton.states
        if _is_storage_balance(document, name)
    )


def _is_storage_balance(document: Document, name: str) -> bool:
    """Return whether the state `name` has a balance in which der(x) has a coefficient with a unit:
    a mass, an inertia, a heat capacity, an inductance, but not a time.
    """
    coefficient = balance_coefficient(document, name)
    return coefficient is not None and coefficient[1] not in NO_STORAGE
