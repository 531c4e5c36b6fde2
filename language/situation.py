"""Situation: what each name of a sampled automaton is in its Program, and its chart there."""

from __future__ import annotations

from collections.abc import Iterable

from language.charting import ChartContext
from language.event import queue_capacity
from language.fault import FAULT_GUARD
from language.limit import FAULT_HAPPENED
from language.lower import equation_bindings, variable_bindings
from language.memory import add_delay_bindings, sampled_delays_of
from language.model import Automaton
from language.operation import Compare, Expr, Ref, integer
from language.parameter import constant_bindings
from language.program import TransitionInfo
from language.region import mode_bindings


def base_bindings(automaton: Automaton, group: str) -> dict[str, Expr]:
    """Return what names without equations are, inputs in a group: `input` or `before`."""
    known = dict(constant_bindings(automaton))
    known.update(variable_bindings(automaton, group))
    known.update(mode_bindings(automaton, "memory.mode"))
    known[FAULT_GUARD] = Ref(FAULT_HAPPENED)
    if automaton.model:
        known.update(mode_bindings(automaton.model, "memory.run_mode", f"{automaton.model.name}."))
        for mode in automaton.model.modes.values():
            is_in = Compare("==", Ref("memory.run_mode"), integer(mode.number))
            known[f"in {automaton.model.name}.{mode.name}"] = is_in
    return known


def current_bindings(automaton: Automaton) -> tuple[dict[str, Expr], dict[str, Expr]]:
    """Return what all names are, and what those without equations are."""
    names = equation_bindings(automaton, "equation.")
    everywhere = add_delay_bindings(
        sampled_delays_of(automaton), {**base_bindings(automaton, "input"), **names}
    )
    return everywhere, {name: value for name, value in everywhere.items() if name not in names}


def chart_context_of(
    automaton: Automaton, transitions: Iterable[TransitionInfo]
) -> ChartContext | None:
    """Return the chart of an automaton as it is lowered; None where it has none."""
    if automaton.statechart is None:
        return None
    infos = {info.key.partition(" ")[2]: info for info in transitions}
    ways = [way for mode in automaton.all_modes for way in mode.transitions]
    everywhere, now = current_bindings(automaton)
    size = queue_capacity(automaton.statechart, ways)
    return ChartContext(automaton, automaton.statechart, infos, now, everywhere, size)
