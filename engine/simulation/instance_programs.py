"""Starting: the Program of each instance of a system, with the start values of a scenario."""

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
    """Return the Program of each instance, with the start values of a resolved scenario."""
    automata = automata_of(system, scenario)
    return {name: program_of(*each) for name, each in automata.items()}


def automata_of(system: System, scenario: Scenario) -> dict[str, tuple[Automaton, list[str]]]:
    """Return the automaton of each instance with its start values, and its inputs that vary.

    Inputs of continuous automata that change between instants are parabolas inside a step.
    """
    found = {}
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
        found[name] = _with_start_values(instance.automaton, start), varying
    return found


def _varies(system: System, scenario: Scenario, signal: str) -> bool:
    source = system.delayed_signals[signal].source if signal in system.delayed_signals else signal
    return source in scenario.inputs and scenario.inputs[source].varies


def _with_start_values(automaton: Automaton, start: Mapping[str, Fraction]) -> Automaton:
    states = dict(automaton.states)
    nowhere = Span(Source("scenario"), 1, 1)
    for name, value in start.items():
        formula = Formula(NumberLiteral(value, NO_UNIT, nowhere), f"states.{name}.initial")
        states[name] = dataclasses.replace(states[name], initial=formula)
    return dataclasses.replace(automaton, states=states)
