"""Sampled variable: what a ticking automaton carries, and what it computes with."""

from __future__ import annotations

from language.action import (
    action_variables,
    discrete_variables,
)
from language.activation import activation_variables
from language.covariance import covariance_variables
from language.decision import truth_table_variables
from language.instant import input_change_variables
from language.invariant import invariant_variables
from language.kalman import observer_variables
from language.limit import (
    saturation_variables,
)
from language.memory import SampledDelay, sampled_delay_variables
from language.model import Automaton
from language.program import (
    TransitionInfo,
    Variable,
)
from language.rewind import rollback_variables
from language.wiring import (
    input_variables,
    region_variables,
    state_variables,
)


def sampled_variables(
    automaton: Automaton,
    transitions: tuple[TransitionInfo, ...],
    delays: tuple[SampledDelay, ...],
    chart_variables: list[Variable],
) -> list[Variable]:
    """Return the variables of a sampled automaton; `finished` leaves out what is not used."""
    found = input_variables(automaton, "input")
    measured = [m.observer.measures for m in automaton.modes.values() if m.observer]
    for name in dict.fromkeys(name for measures in measured for name in measures):
        about = f"{name} is a new value in this tick"
        found.append(Variable(f"is_new.{name}", "truth", about=about))
    found += state_variables(automaton)
    found += discrete_variables(automaton)
    found += input_variables(automaton, "before")
    for info in transitions:
        if info.timer:
            about = f"ticks that the guard has been true, at most {info.timer_limit}"
            found.append(Variable(info.timer, "whole", about=about))
    found += observer_variables(automaton)
    found += covariance_variables(automaton)
    found += input_change_variables(automaton)
    found += sampled_delay_variables(automaton, delays)
    found += activation_variables(automaton)
    found += rollback_variables(automaton)
    found += region_variables(automaton, "tick")
    found += chart_variables
    found.append(Variable("memory.started", "truth", about="the first tick is done"))
    found.append(Variable("memory.faults", "whole", about="latched fault bits"))
    found += action_variables(automaton)
    found += truth_table_variables(automaton)
    found += saturation_variables(automaton)
    found += invariant_variables(automaton)
    return list({variable.name: variable for variable in found}.values())
