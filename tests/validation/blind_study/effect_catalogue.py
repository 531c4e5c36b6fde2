"""Catalogue: the effects of a generator with their places, and which of them do not go together."""

from __future__ import annotations

from importlib import import_module


def places_of(generator: str) -> dict[str, str]:
    """Return the place of each effect that a generator can conceal, by name."""
    if generator == "tests.generators.open_cases":
        library = import_module(f"{generator}.library").LIBRARY
        return {effect.name: effect.place for effect in library.values()}
    known = import_module(f"{generator}.catalogue").CATALOGUE
    return {effect.id: effect.place for effect in known.values()}


def pairs_of(generator: str) -> list[tuple[str, str]]:
    """Return all pairs of effects at places of their own that a generator can conceal together."""
    places = places_of(generator)
    every = [
        (first, second)
        for first in sorted(places)
        for second in sorted(places)
        if first < second and places[first] != places[second]
    ]
    if generator == "tests.generators.open_cases":
        return every
    conflict = import_module(f"{generator}.catalogue").conflict
    return [pair for pair in every if not conflict(pair)]
