"""Check of actions: assignments, and what a transition says - its target, guard, wait, resets."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from language.check_rewind import check_rewind
from language.check_writer import check_continued
from language.declaration import Formula
from language.dimension import DimensionCheck
from language.model import Automaton, Mode, Transition
from language.names import NAME
from language.parameter import parameter_kinds
from language.problem import Problems, nearest
from language.syntax import EDGES, MEMORY, TIMES, names
from language.units import SECOND
from language.wait import tunable_wait


def check_assignments(
    automaton: Automaton,
    formulas: Mapping[str, Formula],
    check: DimensionCheck,
    problems: Problems,
) -> None:
    """Report assignments to what is not carried, and values of another kind."""
    for name, formula in formulas.items():
        kind = check.scope.names.get(name)
        if not NAME.fullmatch(name):
            continue  # told where it was read
        if name not in automaton.carried:
            hint = _instead(automaton, name) or nearest(name, automaton.carried)
            label = f"`{name}` is not a state or discrete variable"
            problems.error("name", formula.span, label, hint)
        elif kind is not None:
            check.assigned(formula.tree, kind, name)


def _instead(automaton: Automaton, name: str) -> str:
    """Return what is done with a known name that is not assigned."""
    if automaton.tree and name in automaton.tree.signals:
        return f"it is an event: a transition raises it, `raise: {name}`"
    if name in automaton.inputs:
        return "it is an input, which is only read: `discrete` declares what is written"
    if name in automaton.parameters:
        return "it is a parameter, which stays: `discrete` declares what is written"
    return ""


def check_ways(
    automaton: Automaton,
    mode: Mode,
    check: DimensionCheck,
    constant: DimensionCheck,
    problems: Problems,
) -> None:
    """Report mistakes in the transitions and invariants of a mode; `constant` knows parameters."""
    remembered = frozenset(MEMORY if automaton.is_sampled else ("delay", *EDGES, *TIMES))
    guards = dataclasses.replace(check.scope, memory=remembered)
    guard = DimensionCheck(guards, problems)
    for transition in mode.transitions:
        _check_target(automaton, transition, problems)
        guard.truth(transition.when.tree, "when")
        if transition.wait:
            constant.quantity(transition.wait.tree, SECOND, "wait")
            if tunable_wait(automaton, transition.wait) is None:
                _check_fixed(automaton, transition.wait, problems)
        check_assignments(automaton, transition.reset, check, problems)
        if transition.rewind:
            check.truth(transition.rewind.until.tree, "until")
            constant.quantity(transition.rewind.within.tree, SECOND, "within")
            _check_fixed(automaton, transition.rewind.within, problems)
            check_rewind(automaton, transition, problems)
        if transition.memory == "continue" and automaton.tree is None:
            check_continued(automaton, transition, problems)
    for invariant in mode.invariants.values():
        check.truth(invariant.that.tree, "that")


def _check_target(automaton: Automaton, transition: Transition, problems: Problems) -> None:
    """In a chart its own check looks targets up."""
    region = automaton.region(transition.region)
    if automaton.tree is None and transition.target not in region.modes:
        label = f"there is no mode `{transition.target}`"
        if automaton.regions:
            label += f" in region `{region.name}`"
        hint = nearest(transition.target, region.modes)
        problems.error("name", transition.span, label, hint)


def _check_fixed(automaton: Automaton, time: Formula, problems: Problems) -> None:
    for read in names(time.tree):
        parameter = automaton.parameters.get(read.path)
        if parameter and parameter_kinds(automaton)[read.path] != "fixed":
            label = f"`{read.path}` is {parameter.kind}: a wait is made of fixed values"
            problems.error("wait", read.span, label)
