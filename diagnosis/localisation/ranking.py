"""Localisation: places ranked by the log-likelihood gain of a free disturbance there.

One disturbance at a time is free beside the base; the model is deficient where that gains most
(Kristensen, Madsen, Jorgensen 2004). The places of accepted effects come first.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np

from diagnosis.estimation.estimate import Estimate
from diagnosis.estimation.model_set import ModelSet
from diagnosis.localisation.cause import attribute_causes, balance_of, is_inactive
from diagnosis.localisation.disturbance_state_fit import free_disturbance
from diagnosis.localisation.location import Location, location_of, with_smoothed_disturbances
from diagnosis.model.placed_effect import PlacedEffect, disturbance_effect
from language.text.diagnostic import SpecError
from language.text.document import MappingNode


def localise(model_set: ModelSet, base: Estimate) -> tuple[Location, ...]:
    """Return the locations with a finite cost by descending gain, the first one smoothed.

    The gain is relative to a fit with all disturbances small, or else to the largest finite cost.
    Parameters are fitted anew at each place: those of the base are biased by what it lacks.
    """
    free = [
        (section, placed_effect, free_disturbance(model_set, base, placed_effect))
        for section, placed_effect in disturbance_locations(model_set, base)
    ]
    restricted_cost = free_disturbance(model_set, base).cost
    finite = [found for found in free if np.isfinite(found[-1].cost)]
    if not np.isfinite(restricted_cost):
        restricted_cost = max((one.cost for *_, one in finite), default=0.0)
    ranked = []
    for section, placed_effect, one in finite:
        location = location_of(model_set, section, placed_effect, one)
        ranked.append(dataclasses.replace(location, gain=restricted_cost - one.cost))
    ranked.sort(key=lambda location: -location.gain)
    return tuple([with_smoothed_disturbances(model_set, ranked[0]), *ranked[1:]] if ranked else [])


def disturbance_locations(model_set: ModelSet, base: Estimate) -> list[tuple[str, PlacedEffect]]:
    """Return section and disturbance of each place where one is tried beside a base.

    These are balances, elastic elements and compared outputs. A place at which effects leave no
    room for a disturbance, such as an output with a delay, is left out.
    """
    locations = [("flow", placed_effect) for placed_effect in model_set.disturbances]
    elements = model_set.document.root.get("elements")
    for entry in elements if isinstance(elements, MappingNode) else ():
        if model_set.automaton.elements[entry.key].kind == "elastic":
            locations.append(("elements", disturbance_effect("element", entry.key)))
    for name in model_set.output_names:
        locations.append(("outputs", disturbance_effect("output", name)))
    locations = [(section, model_set.scale_disturbance(one)) for section, one in locations]
    effects = base.candidate.placed_effects
    return [
        (section, one)
        for section, one in locations
        if section == "flow" or _can_combine(model_set, effects, one)
    ]


def _can_combine(
    model_set: ModelSet, effects: Sequence[PlacedEffect], disturbance: PlacedEffect
) -> bool:
    """Return whether a model with effects can have an additional disturbance."""
    try:
        model_set.compile_candidate(effects, (*model_set.disturbances, disturbance))
    except SpecError:
        return False
    return True


def rank_accepted_first(
    locations: Sequence[Location], paths: Sequence[str], model_set: ModelSet
) -> tuple[Location, ...]:
    """Return locations with those of accepted effects (`paths`) first, in the order of the paths.

    A path takes over the location with its own path or that of its balance, else it is new.
    """
    by_path = {location.path: location for location in locations}
    first: list[Location] = []
    for path in dict.fromkeys(paths):
        section, _, place = path.partition(".")
        nearest = by_path.get(path) or by_path.get(balance_of(model_set, section, place))
        entry = nearest or Location(section, place, 0.0, 0.0)
        entry = entry if first else with_smoothed_disturbances(model_set, entry)
        first.append(dataclasses.replace(entry, section=section, place=place, is_accepted=True))
    return (*first, *(location for location in locations if location.path not in paths))


def rank_causes_first(
    locations: Sequence[Location], nearest_paths: Iterable[str], model_set: ModelSet
) -> tuple[Location, ...]:
    """Return locations of an unknown cause, led by an input or element of the first balance.

    The cause is the first path of `attribute_causes`, else the first of `nearest_paths` (best
    effects first) that acts in that balance and is not inactive.
    """
    if not locations:
        return ()
    known = (path for path in nearest_paths if not is_inactive(model_set, locations[0], path))
    for path in (*attribute_causes(model_set, locations[0]), *known):
        section, _, place = path.partition(".")
        if balance_of(model_set, section, place) == locations[0].path:
            first = dataclasses.replace(locations[0], section=section, place=place)
            return tuple(locations) if path == locations[0].path else (first, *locations)
    return tuple(locations)
