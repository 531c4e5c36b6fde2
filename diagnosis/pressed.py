"""Pressed: where a parameter that acts in one balance alone was led to the end of its range.

A friction that takes up an offset, or a drag that takes up a grade, stands there; beside it what it
takes up promises little.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping

import numpy as np

from diagnosis.estimate import Estimate
from diagnosis.layers import Layer
from diagnosis.naming import brought_by, place_path
from diagnosis.point import Point, bounds_of, point_of
from language.model import Automaton, Mode
from language.syntax import Tree, names

ALIKE = 0.2
"""Correlation of what two parameters change from which on they do alike."""


def pressed_places(model: Estimate, automaton: Automaton) -> frozenset[str]:
    """Return the balances in which parameters that act there alone stand at ends of their ranges,
    and the inputs that act there alone.
    """
    where = _balances(automaton)
    ends = {where[name] for name in _at_ends(model) if name in where}
    return frozenset(ends | {name for name in automaton.inputs if where.get(name) in ends})


def eased(model: Estimate, automaton: Automaton) -> Point:
    """Return a model's point with the parameters that are pressed where they are declared."""
    where = _balances(automaton)
    candidate, point = model.candidate, model.point
    start = point_of(candidate, len(point.own), {})
    back = [candidate.names.index(name) for name in _at_ends(model) if name in where]
    shared, own = point.shared.copy(), point.own.copy()
    shared[back], own[:, back] = start.shared[back], start.own[:, back]
    return Point(shared, own)


def is_opposed(model: Estimate, layer: Layer, automaton: Automaton) -> bool:
    """Tell whether a parameter of the balance in which an effect was laid is at the end of its
    range where it takes away what the effect adds: dry friction for one that falls with the speed.
    """
    where, columns = _balances(automaton), model.columns
    brought = [name for name in model.candidate.names if name in brought_by(layer)]
    if not brought or not columns or place_path(layer) != f"flow.{layer.place}":
        return False
    sizes = {name: float(np.linalg.norm(columns[name])) for name in brought}
    adds = columns[max(brought, key=lambda name: sizes[name])]
    for name in _at_ends(model):
        k = model.candidate.names.index(name)
        takes = columns[name] if model.point.shared[k] < 0.0 else -columns[name]
        both = np.linalg.norm(adds) * np.linalg.norm(takes)
        if where.get(name) == layer.place and float(np.sum(adds * takes)) > ALIKE * both:
            return True
    return False


def _at_ends(model: Estimate) -> list[str]:
    low, high = bounds_of(model.candidate).T
    at_end = (model.point.shared <= low) | (model.point.shared >= high)
    return [model.candidate.names[k] for k in np.flatnonzero(at_end)]


def _balances(automaton: Automaton) -> Mapping[str, str]:
    """Return the balance of each parameter and input that acts in one alone."""
    found: dict[str, set[str]] = defaultdict(set)
    for mode in automaton.modes.values():
        for state, balance in mode.flow.items():
            for name in _read(mode, (balance.left, balance.right)):
                found[name].add(state)
    known = (*automaton.parameters, *automaton.inputs)
    return {name: min(found[name]) for name in known if len(found[name]) == 1}


def _read(mode: Mode, trees: tuple[Tree, ...]) -> set[str]:
    """Return what some trees read, through the equations of a mode."""
    left = {one.path for tree in trees for one in names(tree)}
    done: set[str] = set()
    while left:
        name = left.pop()
        done.add(name)
        if name in mode.equations:
            left |= set(mode.equations[name].reads) - done
    return done
