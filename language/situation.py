"""Situation: what each name of a sampled automaton is in its Program, and its chart there."""

from __future__ import annotations

from collections.abc import Iterable

from language.charting import Charting
from language.event import capacity
from language.fault import FAULT_GUARD
from language.limit import HAPPENED
from language.lower import equation_names, variable_names
from language.memory import delays_of, with_delays
from language.model import Automaton
from language.operation import Compare, Expr, Ref, whole
from language.parameter import constant_names
from language.program import TransitionInfo
from language.region import in_modes


def names_of(automaton: Automaton, group: str) -> dict[str, Expr]:
    """Return what names without equations are, inputs in a group: `input` or `before`."""
    known = dict(constant_names(automaton))
    known.update(variable_names(automaton, group))
    known.update(in_modes(automaton, "memory.mode"))
    known[FAULT_GUARD] = Ref(HAPPENED)
    if automaton.model:
        known.update(in_modes(automaton.model, "memory.run_mode", f"{automaton.model.name}."))
        for mode in automaton.model.modes.values():
            is_in = Compare("==", Ref("memory.run_mode"), whole(mode.number))
            known[f"in {automaton.model.name}.{mode.name}"] = is_in
    return known


def names_now(automaton: Automaton) -> tuple[dict[str, Expr], dict[str, Expr]]:
    """Return what all names are, and what those without equations are."""
    names = equation_names(automaton, "equation.")
    everywhere = with_delays(delays_of(automaton), {**names_of(automaton, "input"), **names})
    return everywhere, {name: value for name, value in everywhere.items() if name not in names}


def charting_of(automaton: Automaton, transitions: Iterable[TransitionInfo]) -> Charting | None:
    """Return the chart of an automaton as it is lowered; None where it has none."""
    if automaton.tree is None:
        return None
    infos = {info.key.partition(" ")[2]: info for info in transitions}
    ways = [way for mode in automaton.all_modes for way in mode.transitions]
    everywhere, now = names_now(automaton)
    size = capacity(automaton.tree, ways)
    return Charting(automaton, automaton.tree, infos, now, everywhere, size)
