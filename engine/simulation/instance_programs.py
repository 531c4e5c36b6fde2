"""Instance Programs: lowers each instance of a system with the initial values of a scenario."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from fractions import Fraction

from language.expressions.syntax_tree import NumberLiteral
from language.expressions.units import NO_UNIT
from language.ir.program import Program
from language.loading.load import program_of
from language.model.automaton import Automaton
from language.model.declaration import Formula
from language.model.system import Scenario, System
from language.text.diagnostic import Source, Span


def programs_of(system: System, scenario: Scenario) -> dict[str, Program]:
    """Return the Program of each instance for a resolved scenario, one without a recording.

    The Programs have the initial values of the scenario. Raises SpecError if a check refuses one.
    """
    automata = automata_of(system, scenario)
    return {name: program_of(*each) for name, each in automata.items()}


def automata_of(system: System, scenario: Scenario) -> dict[str, tuple[Automaton, list[str]]]:
    """Return, by instance, its automaton with initial values and the names of its varying inputs.

    The initial values of the scenario replace those of states. A varying input is an input, not of
    type bool, of a continuous automaton that reads a system input, also delayed, whose stimulus
    changes between instants; it is interpolated by a parabola inside a step.
    """
    automata = {}
    for name, instance in system.instances.items():
        start = {
            key.partition(".")[2]: Fraction(value)
            for key, value in scenario.initial.items()
            if key.partition(".")[0] == name
        }
        varying = [
            thing
            for (owner, thing), connection in system.connections.items()
            if owner == name and not instance.automaton.is_sampled
            if not instance.automaton.inputs[thing].is_bool
            if any(_varies(system, scenario, read) for read in connection.reads)
        ]
        automata[name] = _with_start_values(instance.automaton, start), varying
    return automata


def _varies(system: System, scenario: Scenario, signal: str) -> bool:
    """Return whether a signal is an input, or a delayed input, whose stimulus varies."""
    source = system.delayed_signals[signal].source if signal in system.delayed_signals else signal
    return source in scenario.inputs and scenario.inputs[source].varies


def _with_start_values(automaton: Automaton, start: Mapping[str, Fraction]) -> Automaton:
    """Return an automaton with some initial values [SI] replaced."""
    states = dict(automaton.states)
    nowhere = Span(Source("scenario"), 1, 1)
    for name, value in start.items():
        formula = Formula(NumberLiteral(value, NO_UNIT, nowhere), f"states.{name}.initial")
        states[name] = dataclasses.replace(states[name], initial=formula)
    return dataclasses.replace(automaton, states=states)
