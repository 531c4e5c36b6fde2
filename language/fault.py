"""Fault: the transitions into the declared fault mode (rules 13 and 18)."""

from __future__ import annotations

import dataclasses

from language.declaration import Formula
from language.model import Automaton, Mode, Transition
from language.region import with_regions
from language.syntax import Name

FAULT_GUARD = "fault happened"
"""The name under which the guard of these transitions is known; no spec can write it."""
FIRST = -1
"""Their priority: before all that a spec can write."""


def with_fault_transitions(automaton: Automaton) -> Automaton:
    """Return an automaton that enters its fault mode, from every other mode, when a fault asks."""
    if automaton.fault_mode is None:
        return automaton
    modes = {name: _with_way_out(automaton, mode) for name, mode in automaton.modes.items()}
    return dataclasses.replace(automaton, modes=with_regions(modes, automaton.regions))


def _with_way_out(automaton: Automaton, mode: Mode) -> Mode:
    if mode.name == automaton.fault_mode:
        return mode
    assert automaton.fault_mode is not None
    key = f"{mode.key}.fault_mode"
    way = Transition(
        name="fault_mode",
        source=mode.name,
        target=automaton.fault_mode,
        when=Formula(Name(FAULT_GUARD, mode.span), key),
        wait=None,
        priority=FIRST,
        reset={},
        key=key,
        span=mode.span,
    )
    return dataclasses.replace(mode, transitions=(*mode.transitions, way))
