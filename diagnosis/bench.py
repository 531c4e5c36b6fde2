"""Bench: the base, the recordings and the effects at hand, from which candidates are made."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from fractions import Fraction

from diagnosis.candidate import Candidate, candidate
from diagnosis.estimate import Estimate
from diagnosis.layers import Layer, drift, fitting
from diagnosis.series import Series
from diagnosis.shelf import NOWHERE, Shelf
from language.document import Document, Table
from language.effect import Effect
from language.model import Automaton
from language.place import Misfit, place_of
from language.problem import SpecError
from language.project import Project
from language.units import parse_unit

Fit = Callable[[], Estimate]
FORCES = (parse_unit("N*m").dimension.powers, parse_unit("N").dimension.powers)
"""What a balance of forces or torques is in: drifts act there, a sensor's filter is none."""
NOT_CANDIDATES = ("unknown_input", "sensor_quantisation")
"""Effects that no parameter is fitted of: one is found as a drift, one only adds noise."""


@dataclass(frozen=True)
class Bench:
    """A base automaton, with recordings of the same period, and effects to lay over it."""

    document: Document
    project: Project
    automaton: Automaton
    effects: tuple[Effect, ...]
    series: tuple[Series, ...]
    seen: tuple[str, ...]
    drifts: tuple[Layer, ...]
    shelf: Shelf = NOWHERE
    _made: dict[tuple[str, ...], Candidate] = field(default_factory=dict, repr=False)

    def kept(
        self, words: str, candidate: Candidate, given: Sequence[object], make: Fit
    ) -> Estimate:
        """Return a fit to the recordings, as it was kept or made now; it follows from `given`."""
        return self.shelf.kept(words, candidate, self.series, given, make)

    @property
    def period(self) -> Fraction:
        """The time [s] between samples."""
        return self.series[0].period

    def candidate(
        self, layers: Sequence[Layer], drifts: Sequence[Layer] | None = None
    ) -> Candidate:
        """Return the base with layers, compiled; made once. Raises SpecError."""
        drifts = self.drifts if drifts is None else drifts
        key = (*(layer.id for layer in layers), *(layer.id for layer in drifts))
        if key not in self._made:
            self._made[key] = candidate(
                self.document, self.project, layers, drifts, self.seen, self.period
            )
        return self._made[key]

    def layers(self) -> Iterator[Layer]:
        """Yield every effect at every place where these recordings could tell it."""
        candidates = (one for one in self.effects if one.name not in NOT_CANDIDATES)
        for effect in candidates:
            for layer in fitting(self.document, effect):
                if self._can_tell(layer):
                    yield layer

    def possible(self, layers: Sequence[Layer]) -> Candidate | None:
        """Return the base with layers, None where they do not go together."""
        try:
            return self.candidate(layers)
        except SpecError:
            return None

    def all_possible(self, many: Sequence[Sequence[Layer]]) -> list[Candidate | None]:
        """Return `possible` for each; those that are new are compiled side by side."""
        with ThreadPoolExecutor(os.cpu_count()) as compilers:
            return list(compilers.map(self.possible, many))

    def _can_tell(self, layer: Layer) -> bool:
        """An input must move, an output be compared, a balance be one of forces."""
        name = layer.place
        if name in self.automaton.inputs:
            column = list(self.automaton.inputs).index(name)
            return any(float(one.inputs[:, column].std()) > 0.0 for one in self.series)
        if name in self.automaton.states and layer.effect.fits[0].kind == "balance":
            return _is_balance_of_forces(self.document, self.automaton, name)
        if layer.effect.fits[0].kind == "output":
            return name in self.seen
        return True


def balance_drifts(document: Document, automaton: Automaton) -> tuple[Layer, ...]:
    """Return a drift for each balance of forces or torques."""
    return tuple(
        drift("balance", name)
        for name in automaton.states
        if _is_balance_of_forces(document, automaton, name)
    )


def _is_balance_of_forces(document: Document, automaton: Automaton, name: str) -> bool:
    place = place_of(document.root, drift("balance", name).effect, name)
    flow = document.root.get("flow")
    if isinstance(place, Misfit) or not isinstance(flow, Table):
        return False
    return parse_unit(str(place.holes["force"])).dimension.powers in FORCES
