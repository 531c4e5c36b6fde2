"""Active bounds: parameters of a single balance that a fit has moved to the end of their range.

A friction that absorbs an offset, or a drag that absorbs a grade, has an active bound; the effect
that it replaces then has a small screening gain.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping

import numpy as np

from diagnosis.estimation.estimate import Estimate
from diagnosis.model.parameter_vector import ParameterVector, bounds_of, vector_of
from diagnosis.model.placed_effect import PlacedEffect, effect_names, place_path
from language.expressions.syntax_tree import SyntaxTree, names
from language.model.automaton import Automaton, Mode

MIN_CORRELATION = 0.2
"""Correlation of what two parameters change from which on they do alike."""


def active_bound_locations(model: Estimate, automaton: Automaton) -> frozenset[str]:
    """Return the balances with parameters at a bound that act there alone,
    and the inputs of these.
    """
    where = _single_balances(automaton)
    ends = {where[name] for name in _active_bounds(model) if name in where}
    return frozenset(ends | {name for name in automaton.inputs if where.get(name) in ends})


def release_active_bounds(model: Estimate, automaton: Automaton) -> ParameterVector:
    """Return the point of a model with parameters at a bound moved to their declared values.

    Only parameters that act in a single balance move.
    """
    where = _single_balances(automaton)
    candidate, point = model.candidate, model.point
    start = vector_of(candidate, len(point.per_recording), {})
    back = [candidate.names.index(name) for name in _active_bounds(model) if name in where]
    shared, own = point.shared.copy(), point.per_recording.copy()
    shared[back], own[:, back] = start.shared[back], start.per_recording[:, back]
    return ParameterVector(shared, own)


def has_opposing_active_bound(
    model: Estimate, placed_effect: PlacedEffect, automaton: Automaton
) -> bool:
    """Return whether a parameter at a bound counteracts an effect in the same balance.

    An example is dry friction at 0 beside an effect that decreases with the speed. The test is the
    correlation of Jacobian columns.
    """
    where, columns = _single_balances(automaton), model.jacobian
    brought = [name for name in model.candidate.names if name in effect_names(placed_effect)]
    if not brought or not columns or place_path(placed_effect) != f"flow.{placed_effect.place}":
        return False
    sizes = {name: float(np.linalg.norm(columns[name])) for name in brought}
    adds = columns[max(brought, key=lambda name: sizes[name])]
    for name in _active_bounds(model):
        k = model.candidate.names.index(name)
        takes = columns[name] if model.point.shared[k] < 0.0 else -columns[name]
        both = np.linalg.norm(adds) * np.linalg.norm(takes)
        if (
            where.get(name) == placed_effect.place
            and float(np.sum(adds * takes)) > MIN_CORRELATION * both
        ):
            return True
    return False


def _active_bounds(model: Estimate) -> list[str]:
    low, high = bounds_of(model.candidate).T
    at_end = (model.point.shared <= low) | (model.point.shared >= high)
    return [model.candidate.names[k] for k in np.flatnonzero(at_end)]


def _single_balances(automaton: Automaton) -> Mapping[str, str]:
    """Return the balance of each parameter and input that acts in one alone."""
    found: dict[str, set[str]] = defaultdict(set)
    for mode in automaton.modes.values():
        for state, balance in mode.flow.items():
            for name in _names_used(mode, (balance.left, balance.right)):
                found[name].add(state)
    known = (*automaton.parameters, *automaton.inputs)
    return {name: min(found[name]) for name in known if len(found[name]) == 1}


def _names_used(mode: Mode, trees: tuple[SyntaxTree, ...]) -> set[str]:
    """Return what some trees read, through the equations of a mode."""
    left = {one.path for tree in trees for one in names(tree)}
    done: set[str] = set()
    while left:
        name = left.pop()
        done.add(name)
        if name in mode.equations:
            left |= set(mode.equations[name].reads) - done
    return done
