"""Chart entry terms: the modes that a transition enters, as terms of a contract.

They are read from the operations of `lower_entry_set`, which assign the modes. A history that the
operations test becomes a test of the terms.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

from codegen.proofs.acsl.chart_predicates import Configuration
from codegen.proofs.acsl.symbolic_summary import Fork, Found
from language.charts.entry_blocks import lower_entry_set
from language.ir.ops import Assign, Block, Branch, Compare, Ref, Switch, Value
from language.ir.traversal import block_writes
from language.model.automaton import Transition
from language.model.statechart import ChartTransition

Modes: TypeAlias = dict[str, Found]
"""The number of the active mode by mode variable; None if no history remembers it."""


def modes_after(words: Configuration, transition: Transition, way: ChartTransition) -> Modes:
    """Return the modes of all regions that a transition changes, after the transition.

    They are by the mode variable of the region.
    """
    regions = words.charting.chart.regions
    variables = frozenset(words.mode(region.region) for region in regions)
    return _assigned(words, lower_entry_set(words.charting, transition, way), {}, variables)


def _assigned(words: Configuration, block: Block, modes: Modes, variables: frozenset[str]) -> Modes:
    """Return `modes` after the operations of an entry set."""
    for op in block:
        match op:
            case Assign(target, Value(number)) if target in variables:
                modes = {**modes, target: str(number)}
            case Branch(Compare("==", Ref(name), Value(number)), then, other):
                test = f"{words.now(name)} == {number}"
                inner = (_assigned(words, part, modes, variables) for part in (then, other))
                modes = _either(test, *inner)
            case Switch(name, cases):
                found: Modes = {
                    **modes,
                    **dict.fromkeys(variables.intersection(block_writes((op,)))),
                }
                for number, part in cases:
                    test = f"{words.now(name)} == {number}"
                    found = _either(test, _assigned(words, part, modes, variables), found)
                modes = found
    return modes


def _either(test: str, then: Modes, other: Modes) -> Modes:
    """Return the modes by a predicate."""
    found: Modes = {}
    for name in {**then, **other}:
        one, two = then.get(name), other.get(name)
        found[name] = one if one == two else Fork(test, one, two)
    return found


def outcomes(found: Found) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the path conditions and values of a nested choice, one after the other."""
    match found:
        case Fork(test, then, other):
            yield from (((test, *tests), mode) for tests, mode in outcomes(then))
            yield from (((f"!({test})", *tests), mode) for tests, mode in outcomes(other))
        case str():
            yield (), found
