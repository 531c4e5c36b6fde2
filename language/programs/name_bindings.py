"""Variables and name bindings of a sampled automaton."""

from __future__ import annotations

from collections.abc import Iterable

from language.charts.chart_context import ChartContext
from language.ir.ops import Compare, Expr, Ref, integer
from language.ir.program import TransitionInfo, Variable
from language.lowering.action_stages import action_variables, discrete_variables
from language.lowering.delay_buffers import (
    SampledDelay,
    add_delay_bindings,
    sampled_delay_variables,
    sampled_delays_of,
)
from language.lowering.edge_detection import activation_variables
from language.lowering.event_queue import queue_capacity
from language.lowering.expressions import equation_bindings, variable_bindings
from language.lowering.fault_mode import FAULT_GUARD
from language.lowering.guard_variable_names import mode_bindings
from language.lowering.invariants import invariant_variables
from language.lowering.program_builder import input_variables, region_variables, state_variables
from language.lowering.program_parameters import constant_bindings
from language.lowering.range_saturation import FAULT_HAPPENED, saturation_variables
from language.lowering.truth_tables import truth_table_variables
from language.model.automaton import Automaton
from language.observers.covariance_update import covariance_variables
from language.observers.input_change import input_change_variables
from language.observers.steady_kalman import observer_variables
from language.programs.rewind import rollback_variables


def sampled_variables(
    automaton: Automaton,
    transitions: tuple[TransitionInfo, ...],
    delays: tuple[SampledDelay, ...],
    chart_variables: list[Variable],
) -> list[Variable]:
    """Return the variables of a sampled automaton, each once; the last of equal names wins.

    They are those of inputs, new measurements, states, timers, observers, delays, edges, rollbacks,
    regions, chart, actions, tables, ranges and invariants. `finalise_program` removes the unused
    ones.
    """
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
            found.append(Variable(info.timer, "whole", about=about, largest=info.timer_limit))
    found += observer_variables(automaton)
    found += covariance_variables(automaton)
    found += input_change_variables(automaton)
    found += sampled_delay_variables(delays)
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


def base_bindings(automaton: Automaton, group: str) -> dict[str, Expr]:
    """Return the expressions of names without equations; `group` of inputs is `input` or `before`.

    They are parameters, inputs, states, discrete variables, conditions on modes and the guard of
    fault transitions. Modes of the model have its name as prefix and are those of the run.
    """
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
    """Return the bindings of a tick with equations and without them, in this order.

    Both contain the delayed values; inputs are the present ones, equations `equation.<name>`.
    """
    names = equation_bindings(automaton, "equation.")
    everywhere = add_delay_bindings(
        sampled_delays_of(automaton), {**base_bindings(automaton, "input"), **names}
    )
    return everywhere, {name: value for name, value in everywhere.items() if name not in names}


def chart_context_of(
    automaton: Automaton, transitions: Iterable[TransitionInfo]
) -> ChartContext | None:
    """Return the context of the lowering of the automaton's chart; None without nested modes.

    `transitions` are the data of all its transitions.
    """
    if automaton.statechart is None:
        return None
    infos = {info.key.partition(" ")[2]: info for info in transitions}
    everywhere, now = current_bindings(automaton)
    size = queue_capacity(automaton.statechart, automaton.all_transitions)
    return ChartContext(automaton, automaton.statechart, infos, now, everywhere, size)
