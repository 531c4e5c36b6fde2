"""Fault bits and the transitions into the fault mode (rules 13 and 18b)."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping

from language.expressions.syntax_tree import Name
from language.ir.ops import Block, FaultBit
from language.ir.root_region import CHART
from language.ir.traversal import walk_ops
from language.lowering.range_saturation import MAX_FAULT_BITS, range_fault_of, saturable_variables
from language.model.automaton import Automaton, Mode, Transition
from language.model.chart_paths import mode_paths
from language.model.declaration import Formula
from language.model.region_queries import attach_regions
from language.model.statechart import Chart, ChartTransition
from language.text.diagnostic import Problems

FAULT_GUARD = "fault happened"
"""The name that the guard of these transitions reads; a spec cannot contain it."""
FAULT_PRIORITY = -1
"""The priority of these transitions, which precedes each priority that a spec can contain."""


def add_fault_transitions(automaton: Automaton) -> Automaton:
    """Return the automaton with a transition `fault_mode` from every mode into its fault mode.

    The fault mode and modes inside it get none. Its guard is FAULT_GUARD, its priority
    FAULT_PRIORITY. Only modes of the chart get one. An automaton without a fault mode is returned
    unchanged.
    """
    if automaton.fault_mode is None:
        return automaton
    modes = {name: _add_fault_transition(automaton, mode) for name, mode in automaton.modes.items()}
    tree = automaton.statechart and _add_chart_transitions(automaton, automaton.statechart)
    modes = attach_regions(modes, automaton.regions)
    return dataclasses.replace(automaton, modes=modes, statechart=tree)


def _add_chart_transitions(automaton: Automaton, chart: Chart) -> Chart:
    """Return the chart with these transitions and the nodes that they leave."""
    target = mode_paths(chart)[automaton.fault_mode or ""]
    transitions = dict(chart.transitions)
    for leaf in chart.leaves(CHART):
        domain = chart.domain(leaf, [target], internal=False)
        transitions[f"{leaf.mode_key}.fault_mode"] = ChartTransition(
            leaf.index, (target.index,), domain
        )
    return dataclasses.replace(chart, transitions=transitions)


def _add_fault_transition(automaton: Automaton, mode: Mode) -> Mode:
    """Return a mode with the transition into the fault mode; modes inside it are unchanged."""
    if f"{mode.name}.".startswith(f"{automaton.fault_mode}."):
        return mode
    assert automaton.fault_mode is not None
    key = f"{mode.key}.fault_mode"
    transition = Transition(
        name="fault_mode",
        source=mode.name,
        target=automaton.fault_mode,
        when=Formula(Name(FAULT_GUARD, mode.span), key),
        wait=None,
        priority=FAULT_PRIORITY,
        reset={},
        key=key,
        span=mode.span,
    )
    return dataclasses.replace(mode, transitions=(*mode.transitions, transition))


def fault_names(
    automaton: Automaton, blocks: Mapping[str, Block], extra: Iterable[str], problems: Problems
) -> tuple[str, ...]:
    """Return the fault bits: declared ones, `extra`, then those of ranges in use, each once.

    A range is in use if an operation of the blocks sets or clears its bit. More than MAX_FAULT_BITS
    are reported, and raise SpecError with all problems reported so far.
    """
    ops = [op for block in blocks.values() for op in walk_ops(block)]
    named = {op.fault for op in ops if isinstance(op, FaultBit)}
    own = [fault for fault in map(range_fault_of, saturable_variables(automaton)) if fault in named]
    found = tuple(dict.fromkeys([*automaton.faults, *extra, *own]))
    if len(found) > MAX_FAULT_BITS:
        label = f"there are {len(found)} fault bits: {MAX_FAULT_BITS} fit into one word"
        hint = "give several ranges one bit: `fault: name` beside them"
        problems.error("faults", automaton.span, label, hint)
        problems.raise_if_errors()
    return found
