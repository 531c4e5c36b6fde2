"""Check of functions with memory: fixed times, bounded delays, arguments that every mode has."""

from __future__ import annotations

from fractions import Fraction

from language.constants import exact_value
from language.declaration import Formula
from language.history import tunable_time
from language.memory import MAX_DELAY, applications, formulas, type_of
from language.model import Automaton, Transition
from language.parameter import parameter_kinds
from language.problem import Problems
from language.region import equation_names
from language.syntax import EDGES, KEPT, MEMORY, TIMES, Application, Tree, names, walk

MAX_AFTER = 65535
"""Longest `after` in ticks: its counter is a uint16."""


def check_memory(automaton: Automaton, problems: Problems) -> None:
    """Report what `previous`, `delay`, `rising`, `falling` and `after` cannot do."""
    for tree in applications(automaton, KEPT).values():
        _known_in_every_mode(automaton, tree, problems)
        if not automaton.is_sampled and type_of(automaton, tree.arguments[0]) != "real":
            label = "a continuous automaton delays quantities: this is none"
            problems.error("type", tree.arguments[0].span, label)
        if tree.function == "delay":
            _time(automaton, tree, tree.arguments[1], MAX_DELAY, problems)
    for tree in applications(automaton, TIMES).values():
        _time(automaton, tree, tree.arguments[0], MAX_AFTER, problems)
    for tree in applications(automaton, ("every",)).values():
        with problems.collecting():
            _beat(automaton, tree, problems)
    for tree in applications(automaton, ("changed",)).values():
        if not automaton.is_sampled and type_of(automaton, tree.arguments[0]) == "real":
            label = "a quantity of a continuous automaton changes at every time"
            hint = "`changed` is for bool, int and enum; `rising(x > limit)` for a quantity"
            problems.error("type", tree.arguments[0].span, label, hint)
    for mode in automaton.all_modes:
        for transition in mode.transitions:
            _no_edge_that_waits(automaton, transition, problems)


def uses_memory(automaton: Automaton) -> Application | None:
    """Return a use of a function with memory, None where there is none."""
    for mode in automaton.all_modes:
        trees = [formula.tree for formula in formulas(mode)]
        trees += [balance.right for balance in mode.flow.values()]
        for tree in trees:
            for part in walk(tree):
                if isinstance(part, Application) and part.function in MEMORY:
                    return part
    return None


def _time(
    automaton: Automaton, tree: Application, time: Tree, longest: int, problems: Problems
) -> None:
    kinds = parameter_kinds(automaton)
    tuned = tunable_time(automaton, time) if tree.function == "delay" else None
    if tuned and not automaton.is_sampled:
        if tuned[1] / automaton.step > MAX_DELAY:
            label = f"`delay` of more than {MAX_DELAY} major steps at the end of its range"
            problems.error("wait", time.span, label, "a longer `step`")
        return
    for read in names(time):
        if kinds.get(read.path, "fixed") != "fixed":
            label = f"`{read.path}` is {kinds[read.path]}: a time is made of fixed values"
            problems.error("wait", read.span, label)
            return
    with problems.collecting():
        value = exact_value(Formula(time, ""), automaton)
        if value < 0:
            problems.error("wait", time.span, f"the time of `{tree.function}` is not negative")
        period = automaton.period
        if period is not None and value / period > longest:
            label = f"`{tree.function}` of {-(-value // period)} ticks is longer than {longest}"
            problems.error("wait", time.span, label)
        if period is None and tree.function == "delay":
            _spans_a_step(automaton, time, value, problems)


def _beat(automaton: Automaton, tree: Application, problems: Problems) -> None:
    """What comes again and again is not rounded: it would drift."""
    time = tree.arguments[0]
    value = exact_value(Formula(time, ""), automaton)
    if value == 0:
        problems.error("wait", time.span, "the time of `every` is above zero")
    elif automaton.period and value > 0 and (value / automaton.period).denominator != 1:
        label = f"`every` of {float(value / automaton.period):g} ticks would drift"
        hint = f"a whole number of periods of {float(automaton.period):g} s"
        problems.error("wait", time.span, label, hint)


def _spans_a_step(automaton: Automaton, time: Tree, value: Fraction, problems: Problems) -> None:
    """The value of a stage is looked up, so it must not lie inside the step that is taken."""
    if 0 <= value < automaton.step:
        label = "a delay of a continuous automaton is at least one major step"
        problems.error("wait", time.span, label, f"a `step` of at most {float(value)} s")
    elif value / automaton.step > MAX_DELAY:
        label = f"`delay` of more than {MAX_DELAY} major steps"
        problems.error("wait", time.span, label, "a longer `step`")


def _known_in_every_mode(automaton: Automaton, tree: Application, problems: Problems) -> None:
    everywhere = {*automaton.parameters, *automaton.inputs, *automaton.carried}
    for read in names(tree.arguments[0]):
        modes = automaton.modes.values()
        lacking = [m.name for m in modes if read.path not in equation_names(m)]
        if read.path not in everywhere and "." not in read.path and lacking:
            label = f"`{read.path}` has no value in mode `{lacking[0]}`"
            hint = f"`{tree.function}` keeps it in every mode: give it an equation there"
            problems.error("missing", read.span, label, hint)


def _no_edge_that_waits(automaton: Automaton, transition: Transition, problems: Problems) -> None:
    edges = [
        part
        for part in walk(transition.when.tree)
        if isinstance(part, Application) and part.function in (*EDGES, "every")
    ]
    if edges and transition.wait and exact_value(transition.wait, automaton) > 0:
        label = f"`{edges[0].function}` is true for one instant: it cannot hold for a wait"
        problems.error("wait", edges[0].span, label)
