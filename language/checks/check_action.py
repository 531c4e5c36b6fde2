"""Check of actions and transitions: assignments, targets, guards, waits and resets."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from language.checks.check_rewind import check_rewind
from language.checks.check_single_writer import check_memory_continue
from language.expressions.name_rules import NAME_PATTERN
from language.expressions.syntax_tree import EDGE_FUNCTIONS, MEMORY_FUNCTIONS, TIME_FUNCTIONS, names
from language.expressions.units import SECOND
from language.lowering.program_parameters import parameter_kinds
from language.lowering.wait_ticks import tunable_wait
from language.model.automaton import Automaton, Mode, Transition
from language.model.declaration import Formula
from language.text.diagnostic import Problems, suggest_name
from language.typecheck.infer import TypeChecker


def check_assignments(
    automaton: Automaton,
    formulas: Mapping[str, Formula],
    check: TypeChecker,
    problems: Problems,
) -> None:
    """Report assigned names that are no states or discrete variables, and values of a wrong type.

    `formulas` are the assigned values by name, `check` knows the names that they may read. The hint
    tells that a name is an event, input or parameter, else it is a similar name. Names of a wrong
    form are skipped because the reader has reported them.
    """
    for name, formula in formulas.items():
        kind = check.environment.types.get(name)
        if not NAME_PATTERN.fullmatch(name):
            continue  # the reader has reported it
        if name not in automaton.state_variables:
            hint = _assignment_hint(automaton, name) or suggest_name(
                name, automaton.state_variables
            )
            label = f"`{name}` is not a state or discrete variable"
            problems.error("name", formula.span, label, hint)
        elif kind is not None:
            check.check_assignment(formula.tree, kind, name)


def _assignment_hint(automaton: Automaton, name: str) -> str:
    """Return a hint for an assigned event, input or parameter; an empty text for other names."""
    if automaton.statechart and name in automaton.statechart.events:
        return f"it is an event: a transition raises it, `raise: {name}`"
    if name in automaton.inputs:
        return "it is an input, which is only read: `discrete` declares what is written"
    if name in automaton.parameters:
        return "it is a parameter, which stays: `discrete` declares what is written"
    return ""


def check_mode_transitions(
    automaton: Automaton,
    mode: Mode,
    check: TypeChecker,
    parameter_check: TypeChecker,
    problems: Problems,
) -> None:
    """Report mistakes in the transitions and invariants of a mode.

    These are unknown targets (not in a chart), guards, `until` and invariants that are no
    conditions, waits and `within` that are no fixed times (a tunable wait is allowed), wrong
    resets, and what `check_rewind` and, outside of charts, `check_memory_continue` report.

    `check` knows all names of the mode. `parameter_check` knows parameters only and checks times.
    """
    memory_functions = frozenset(
        MEMORY_FUNCTIONS if automaton.is_sampled else ("delay", *EDGE_FUNCTIONS, *TIME_FUNCTIONS)
    )
    guards = dataclasses.replace(check.environment, memory_functions=memory_functions)
    guard = TypeChecker(guards, problems)
    for transition in mode.transitions:
        _check_target(automaton, transition, problems)
        guard.check_condition(transition.when.tree, "when")
        if transition.wait:
            parameter_check.check_quantity(transition.wait.tree, SECOND, "wait")
            if tunable_wait(automaton, transition.wait) is None:
                _check_fixed_time(automaton, transition.wait, problems)
        check_assignments(automaton, transition.reset, check, problems)
        if transition.rewind:
            check.check_condition(transition.rewind.until.tree, "until")
            parameter_check.check_quantity(transition.rewind.within.tree, SECOND, "within")
            _check_fixed_time(automaton, transition.rewind.within, problems)
            check_rewind(automaton, transition, problems)
        if transition.memory == "continue" and automaton.statechart is None:
            check_memory_continue(automaton, transition, problems)
    for invariant in mode.invariants.values():
        check.check_condition(invariant.condition.tree, "that")


def _check_target(automaton: Automaton, transition: Transition, problems: Problems) -> None:
    """Report a target that is not a mode of the region; charts are checked elsewhere."""
    region = automaton.region(transition.region)
    if automaton.statechart is None and transition.target not in region.modes:
        label = f"there is no mode `{transition.target}`"
        if automaton.regions:
            label += f" in region `{region.name}`"
        hint = suggest_name(transition.target, region.modes)
        problems.error("name", transition.span, label, hint)


def _check_fixed_time(automaton: Automaton, time: Formula, problems: Problems) -> None:
    """Report parameters in a time that are not fixed."""
    for read in names(time.tree):
        parameter = automaton.parameters.get(read.path)
        if parameter and parameter_kinds(automaton)[read.path] != "fixed":
            label = f"`{read.path}` is {parameter.kind}: a wait is made of fixed values"
            problems.error("wait", read.span, label)
