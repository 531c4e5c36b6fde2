"""Check for unused names: warns of names that nothing reads and of states that nothing writes.

An event is read by the transitions with `event` and written by those with `raise`.
"""

from __future__ import annotations

from collections.abc import Iterator

from language.model.automaton import Automaton, Mode
from language.model.transition_precedence import possible_events
from language.model.used_names import names_read_by
from language.text.diagnostic import Problems, suggest_name

UNUSED_HINT = "make it an output, or remove it"
"""Hint for a state or equation that nothing reads."""


def check_unused(automaton: Automaton, problems: Problems) -> None:
    """Warn of parameters, inputs, states and equations without reader, and states without writer.

    Events that no transition reacts to, and events that nothing raises, are reported, too. Outputs,
    events of transitions, observers and runs count as readers. Discrete variables are states here;
    an equation is reported once. Parameters that an automaton has from its model are left to the
    check of the model.
    """
    model = automaton.model
    read = {*names_read_by(automaton), *map(automaton.output_source, automaton.outputs)}
    read |= {
        name
        for m in automaton.all_modes
        for transition in m.transitions
        for name in transition.events
    }
    read |= {*_observer_names(automaton), *(_run_names(automaton) if model else ())}
    for name, parameter in automaton.parameters.items():
        if not (model and name in model.parameters) and name not in read:
            hint = suggest_name(name, automaton.parameters.keys() - {name})
            problems.warning("unused", parameter.span, f"parameter `{name}` is read nowhere", hint)
    for name, thing in automaton.inputs.items():
        if name not in read:
            problems.warning("unused", thing.span, f"input `{name}` is read nowhere")
    for name, state in automaton.state_variables.items():
        if name not in read:
            problems.warning("unused", state.span, f"state `{name}` is read nowhere", UNUSED_HINT)
    _check_equations(automaton, read, problems)
    _check_unwritten(automaton, problems)
    _check_events(automaton, problems)


def _check_events(automaton: Automaton, problems: Problems) -> None:
    """Warn of events of a chart that no transition reacts to, and of events that nothing raises.

    An input event is raised by its input; if no transition reacts to it, its input is reported. An
    event that nothing raises is left to the check of dead transitions if a transition reacts to
    such events only.
    """
    possible = possible_events(automaton)
    heard = {name for transition in automaton.all_transitions for name in transition.events}
    dead = [each for each in automaton.all_transitions if not possible & {*each.events}]
    reported = {name for transition in dead for name in transition.events}
    for event in automaton.statechart.events.values() if automaton.statechart else ():
        name = event.name
        if event.is_input or name in (possible & heard) or name in reported:
            continue
        if name in heard:
            hint = f"write `raise: {name}` on a transition, or declare it with `from: input`"
            problems.warning("unwritten", event.span, f"event `{name}` is never raised", hint)
        elif name in possible:
            label = f"event `{name}` is raised, but no transition has `event: {name}`"
            hint = f"write `event: {name}` on a transition, or remove the event"
            problems.warning("unused", event.span, label, hint)
        else:
            label = f"event `{name}` is never raised, and no transition has `event: {name}`"
            problems.warning("unused", event.span, label, "remove the event")


def _check_equations(automaton: Automaton, read: set[str], problems: Problems) -> None:
    """Warn once of each equation that nothing reads."""
    reported = set()
    for mode in automaton.all_modes:
        for name, formula in mode.equations.items():
            if name not in read and name not in reported:
                reported.add(name)
                label = f"equation `{name}` is read nowhere"
                problems.warning("unused", formula.span, label, UNUSED_HINT)


def _check_unwritten(automaton: Automaton, problems: Problems) -> None:
    """Warn of states and discrete variables that nothing writes."""
    written = {name for mode in automaton.all_modes for name in _written_names(automaton, mode)}
    written |= {name for table in automaton.tables for name in table.assigned_names}
    for name, state in automaton.state_variables.items():
        if name not in written:
            label = f"`{name}` is written nowhere: it keeps its start value"
            problems.warning("unwritten", state.span, label, "declare it as a parameter")


def _written_names(automaton: Automaton, mode: Mode) -> Iterator[str]:
    """Yield the names that a mode or its transitions write, observers and runs included."""
    for group in (mode.update, mode.flow, *mode.jump_assignments):
        yield from group
    if mode.observer:
        yield from mode.observer.states
    if mode.run and automaton.model:
        yield from automaton.model.states


def _observer_names(automaton: Automaton) -> Iterator[str]:
    """Yield the inputs and states that observers name outside of their formulas."""
    for mode in automaton.modes.values():
        if mode.observer:
            yield from mode.observer.states
            yield from mode.observer.inputs
            yield from mode.observer.measures
            if mode.observer.of and automaton.model:
                yield from automaton.model.inputs
            yield from (mode.observer.correct,) if mode.observer.correct else ()


def _run_names(automaton: Automaton) -> Iterator[str]:
    """Yield the inputs and states of the model if a mode runs it; a run shares them by name."""
    assert automaton.model
    if any(mode.run for mode in automaton.modes.values()):
        yield from automaton.model.inputs
        yield from automaton.model.states
