"""Check stateful functions: constant times, bounded delays, arguments known in every mode."""

from __future__ import annotations

from fractions import Fraction

from language.expressions.syntax_tree import (
    DELAY_FUNCTIONS,
    EDGE_FUNCTIONS,
    TIME_FUNCTIONS,
    FunctionCall,
    SyntaxTree,
    names,
    walk,
)
from language.ir.program import MAX_TIMER_TICKS
from language.lowering.constants import evaluate_exactly, wait_seconds
from language.lowering.continuous_delay import tunable_delay_of
from language.lowering.delay_buffers import (
    MAX_DELAY,
    expression_type,
    memory_calls_by_key,
)
from language.lowering.event_tolerance import is_instantaneous
from language.lowering.program_parameters import parameter_kinds
from language.model.automaton import Automaton, Transition
from language.model.declaration import Formula
from language.model.region_queries import equation_names
from language.text.diagnostic import Problems


def check_memory(automaton: Automaton, problems: Problems) -> None:
    """Report invalid uses of functions with memory.

    These are times that are not constant or negative, `delay` of more than MAX_DELAY ticks or major
    steps or (continuous) of less than one major step, `after` or `every` of more than
    MAX_TIMER_TICKS ticks, an `every` of 0 or of no whole number of periods, delayed names without
    an equation in some mode, a delay of a value that is no real or `changed` of a real in a
    continuous automaton, and edges or `every` on transitions with a positive wait.
    """
    for tree in memory_calls_by_key(automaton, DELAY_FUNCTIONS).values():
        _check_known_in_every_mode(automaton, tree, problems)
        if not automaton.is_sampled and expression_type(automaton, tree.arguments[0]) != "real":
            label = "a continuous automaton delays quantities: this is none"
            problems.error("type", tree.arguments[0].span, label)
        if tree.function == "delay":
            _check_time(automaton, tree, tree.arguments[1], MAX_DELAY, problems)
    for tree in memory_calls_by_key(automaton, TIME_FUNCTIONS).values():
        _check_time(automaton, tree, tree.arguments[0], MAX_TIMER_TICKS, problems)
    for tree in memory_calls_by_key(automaton, ("every",)).values():
        with problems.collect_errors():
            _check_period(automaton, tree, problems)
    for tree in memory_calls_by_key(automaton, ("changed",)).values():
        if not automaton.is_sampled and expression_type(automaton, tree.arguments[0]) == "real":
            label = "a quantity of a continuous automaton changes at every time"
            hint = "`changed` is for bool, int and enum; `rising(x > limit)` for a quantity"
            problems.error("type", tree.arguments[0].span, label, hint)
    for mode in automaton.all_modes:
        for transition in mode.transitions:
            _check_edge_has_no_wait(automaton, transition, problems)


def _check_time(
    automaton: Automaton, tree: FunctionCall, time: SyntaxTree, longest: int, problems: Problems
) -> None:
    """Report a time argument that is not constant, negative, or longer than `longest` ticks.

    A tunable `delay` of a continuous automaton is limited by the end of its range instead.
    """
    kinds = parameter_kinds(automaton)
    tuned = tunable_delay_of(automaton, time) if tree.function == "delay" else None
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
    with problems.collect_errors():
        value = evaluate_exactly(Formula(time, ""), automaton)
        if value < 0:
            problems.error("wait", time.span, f"the time of `{tree.function}` is not negative")
        period = automaton.period
        if period is not None and value / period > longest:
            label = f"`{tree.function}` of {-(-value // period)} ticks is longer than {longest}"
            problems.error("wait", time.span, label)
        if period is None and tree.function == "delay":
            _check_continuous_delay(automaton, time, value, problems)


def _check_period(automaton: Automaton, tree: FunctionCall, problems: Problems) -> None:
    """Report a time of `every` that is zero or not a whole number of periods.

    Rounding the time to ticks would let it drift. In a continuous automaton a time within the
    tolerance of rule 10 is reported: the run would stop as Zeno behaviour (rule 12).
    """
    time = tree.arguments[0]
    value = evaluate_exactly(Formula(time, ""), automaton)
    if value == 0:
        problems.error("wait", time.span, "the time of `every` is above zero")
    elif value > 0 and not automaton.period and is_instantaneous(automaton, value):
        label = f"`every` of {float(value):g} s has more than 100 instants in a major step"
        hint = f"a longer time, or a shorter `step` than {float(automaton.step):g} s"
        problems.error("wait", time.span, label, hint)
    elif automaton.period and value > 0 and (value / automaton.period).denominator != 1:
        label = f"`every` of {float(value / automaton.period):g} ticks would drift"
        hint = f"a whole number of periods of {float(automaton.period):g} s"
        problems.error("wait", time.span, label, hint)


def _check_continuous_delay(
    automaton: Automaton, time: SyntaxTree, value: Fraction, problems: Problems
) -> None:
    """Report a delay shorter than one major step or longer than `MAX_DELAY` major steps.

    A stage of a method reads the delayed value, so the value must not lie inside the current step.
    """
    if 0 <= value < automaton.step:
        label = "a delay of a continuous automaton is at least one major step"
        problems.error("wait", time.span, label, f"a `step` of at most {float(value)} s")
    elif value / automaton.step > MAX_DELAY:
        label = f"`delay` of more than {MAX_DELAY} major steps"
        problems.error("wait", time.span, label, "a longer `step`")


def _check_known_in_every_mode(
    automaton: Automaton, tree: FunctionCall, problems: Problems
) -> None:
    """Report names in the argument of a delay that have no equation in some mode."""
    everywhere = {*automaton.parameters, *automaton.inputs, *automaton.state_variables}
    for read in names(tree.arguments[0]):
        modes = automaton.modes.values()
        lacking = [m.name for m in modes if read.path not in equation_names(m)]
        if read.path not in everywhere and "." not in read.path and lacking:
            label = f"`{read.path}` has no value in mode `{lacking[0]}`"
            hint = f"`{tree.function}` keeps it in every mode: give it an equation there"
            problems.error("missing", read.span, label, hint)


def _check_edge_has_no_wait(
    automaton: Automaton, transition: Transition, problems: Problems
) -> None:
    """Report an edge or `every` in the guard of a transition with a positive wait."""
    edges = [
        part
        for part in walk(transition.when.tree)
        if isinstance(part, FunctionCall) and part.function in (*EDGE_FUNCTIONS, "every")
    ]
    if edges and wait_seconds(transition, automaton) > 0:
        label = f"`{edges[0].function}` is true for one instant: it cannot hold for a wait"
        problems.error("wait", edges[0].span, label)
