"""Fault: the names of the bits, and the transitions into the fault mode (rules 13 and 18)."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping

from language.chart import Chart, Way
from language.chart_target import mode_paths
from language.declaration import Formula
from language.limit import MAX_FAULTS, fault_of, limited_things
from language.model import CHART, Automaton, Mode, Transition
from language.operation import Block, FaultBit
from language.problem import Problems
from language.region import with_regions
from language.syntax import Name
from language.traversal import walk

FAULT_GUARD = "fault happened"
"""The name under which the guard of these transitions is known; no spec can write it."""
FIRST = -1
"""Their priority: before all that a spec can write."""


def with_fault_transitions(automaton: Automaton) -> Automaton:
    """Return an automaton that enters its fault mode, from every other mode, when a fault asks."""
    if automaton.fault_mode is None:
        return automaton
    modes = {name: _with_way_out(automaton, mode) for name, mode in automaton.modes.items()}
    tree = automaton.tree and _with_ways(automaton, automaton.tree)
    modes = with_regions(modes, automaton.regions)
    return dataclasses.replace(automaton, modes=modes, tree=tree)


def _with_ways(automaton: Automaton, chart: Chart) -> Chart:
    """Return a chart that knows what these transitions leave."""
    target = mode_paths(chart)[automaton.fault_mode or ""]
    ways = dict(chart.ways)
    for leaf in chart.leaves(CHART):
        domain = chart.domain(leaf, [target], internal=False)
        ways[f"{leaf.mode}.fault_mode"] = Way(leaf.index, (target.index,), domain)
    return dataclasses.replace(chart, ways=ways)


def _with_way_out(automaton: Automaton, mode: Mode) -> Mode:
    if f"{mode.name}.".startswith(f"{automaton.fault_mode}."):
        return mode
    assert automaton.fault_mode is not None
    key = f"{mode.key}.fault_mode"
    way = Transition(
        name="fault_mode",
        source=mode.name,
        target=automaton.fault_mode,
        when=Formula(Name(FAULT_GUARD, mode.span), key),
        wait=None,
        priority=FIRST,
        reset={},
        key=key,
        span=mode.span,
    )
    return dataclasses.replace(mode, transitions=(*mode.transitions, way))


def fault_names(
    automaton: Automaton, blocks: Mapping[str, Block], more: Iterable[str], problems: Problems
) -> tuple[str, ...]:
    """Return the faults that are declared, then `more`, then all others that something sets."""
    ops = [op for block in blocks.values() for op in walk(block)]
    named = {op.fault for op in ops if isinstance(op, FaultBit)}
    own = [fault for fault in map(fault_of, limited_things(automaton)) if fault in named]
    found = tuple(dict.fromkeys([*automaton.faults, *more, *own]))
    if len(found) > MAX_FAULTS:
        label = f"there are {len(found)} fault bits: {MAX_FAULTS} fit into one word"
        hint = "give several ranges one bit: `fault: name` beside them"
        problems.error("faults", automaton.span, label, hint)
        problems.stop_if_any()
    return found
