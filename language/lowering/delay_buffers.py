"""Memory of a sampled automaton: `previous` and `delay` as operations.

A delay of N ticks is a ring of N values; the oldest is overwritten once a tick, when the equations
of the resulting mode hold and before the updates. Until it was written once, a delayed value is
the value of now. What guards remember of an activation is in language/activation.py.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from language.expressions.syntax_tree import (
    DELAY_FUNCTIONS,
    MEMORY_FUNCTIONS,
    FunctionCall,
    SyntaxTree,
    memory_key,
    walk,
)
from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Compare,
    Expr,
    Item,
    Loop,
    Op,
    Ref,
    Select,
    Store,
    Value,
    add,
    integer,
)
from language.ir.program import ValueType, Variable
from language.lowering.constants import evaluate_exactly
from language.lowering.expressions import NameBindings, lower_expression
from language.model.analysis_cache import cache_on_owner
from language.model.automaton import Automaton, Mode
from language.model.declaration import Formula
from language.model.truth_table import truth_table_formulas
from language.text.diagnostic import Problems
from language.typecheck.environment import NameEnvironment
from language.typecheck.infer import TypeChecker
from language.typecheck.types import EnumType, IntType

MAX_DELAY = 4096
"""Longest delay in values kept: 32 kB of an instance."""

MAX_REWIND = 64
"""Longest rewind in ticks kept."""

IS_DELAY_FILLED = Ref("memory.kept")


@dataclass(frozen=True)
class SampledDelay:
    """A value as it was some ticks ago (`ticks` 1: `previous`)."""

    number: int
    call: FunctionCall
    ticks: int
    type: ValueType

    @property
    def variable_name(self) -> str:
        """The variable that holds the values: a scalar where there is one, else a ring."""
        return f"memory.delay_{self.number}"

    @property
    def oldest_index(self) -> str:
        """The variable that says which value of the ring is the oldest."""
        return f"memory.oldest_{self.number}"


def mode_formulas(mode: Mode) -> Iterator[Formula]:
    """Yield the equations, updates, entries, exits, noises, guards and resets of a mode."""
    yield from mode.equations.values()
    yield from action_formulas(mode)


def action_formulas(mode: Mode) -> Iterator[Formula]:
    """Yield the formulas of a mode that are no equations."""
    for stage in (mode.update, mode.entry, mode.exit):
        yield from stage.values()
    if mode.observer:
        yield from mode.observer.process_noise.values()
    for transition in mode.transitions:
        yield transition.when
        yield from transition.reset.values()
        if transition.rewind:
            yield transition.rewind.until


def memory_calls_by_key(
    automaton: Automaton, functions: tuple[str, ...]
) -> dict[str, FunctionCall]:
    """Return each different use of some functions, by key; what is inside comes first."""
    found: dict[str, FunctionCall] = {}
    for part in memory_calls(automaton):
        if part.function in functions:
            found.setdefault(memory_key(part), part)
    return found


@cache_on_owner
def memory_calls(automaton: Automaton) -> tuple[FunctionCall, ...]:
    """Return every use of a function with memory; what is inside of one comes before it."""
    found: list[FunctionCall] = []
    for tree in _evaluated_trees(automaton):
        found += reversed(
            [
                p
                for p in walk(tree)
                if isinstance(p, FunctionCall) and p.function in MEMORY_FUNCTIONS
            ]
        )
    return tuple(found)


def uses_function(automaton: Automaton, function: str) -> bool:
    """Tell whether a function is used anywhere, with memory or without."""
    parts = (part for tree in _evaluated_trees(automaton) for part in walk(tree))
    return any(isinstance(part, FunctionCall) and part.function == function for part in parts)


def _evaluated_trees(automaton: Automaton) -> list[SyntaxTree]:
    """Return every expression that is evaluated in a mode or in a decision."""
    trees = [formula.tree for formula in truth_table_formulas(automaton.tables)]
    for mode in automaton.all_modes:
        trees += [formula.tree for formula in mode_formulas(mode)]
        trees += [balance.right for balance in mode.flow.values()]
    return trees


def evaluate_ticks(automaton: Automaton, time: SyntaxTree) -> int:
    """Return a time of fixed values in ticks, rounded up, exactly (rule 4). Raises SpecError."""
    assert automaton.period is not None
    return math.ceil(evaluate_exactly(Formula(time, ""), automaton) / automaton.period)


def sampled_delays_of(automaton: Automaton) -> tuple[SampledDelay, ...]:
    """Return what a sampled automaton remembers of its values."""
    found: list[SampledDelay] = []
    for tree in memory_calls_by_key(automaton, DELAY_FUNCTIONS).values():
        ticks = evaluate_ticks(automaton, tree.arguments[1]) if tree.function == "delay" else 1
        kind = expression_type(automaton, tree.arguments[0])
        found.append(SampledDelay(len(found) + 1, tree, ticks, kind))
    return tuple(found)


def expression_type(automaton: Automaton, tree: SyntaxTree) -> ValueType:
    """Return the type of a checked expression: as the check of dimensions sees it."""
    scope = NameEnvironment(automaton.name_types, memory_functions=frozenset(MEMORY_FUNCTIONS))
    kind = TypeChecker(scope, Problems()).infer_type(tree)
    if kind == "truth":
        return "truth"
    return "whole" if isinstance(kind, IntType | EnumType) else "real"


def add_delay_bindings(delays: tuple[SampledDelay, ...], known: NameBindings) -> dict[str, Expr]:
    """Return what names are, and what each delayed value is."""
    found = dict(known)
    for delay in delays:
        now = lower_expression(delay.call.arguments[0], found)
        whole = delay.type == "whole"
        old: Expr = Ref(delay.variable_name, whole)
        if delay.ticks > 1:
            old = Item(delay.variable_name, Ref(delay.oldest_index), whole)
        key = memory_key(delay.call)
        found[key] = Select(IS_DELAY_FILLED, old, now) if delay.ticks else now
    return found


def record_delays_block(
    automaton: Automaton, delays: tuple[SampledDelay, ...], known: NameBindings
) -> Block:
    """Return what a tick keeps, once its equations hold: all read the values of before it."""
    values: list[Op] = []
    fill: list[Op] = []
    replace: list[Op] = []
    commit: list[Op] = []
    for delay in delays:
        kept = Ref(f"work.keep_{delay.number}")
        if delay.ticks:
            values.append(Assign(kept.name, lower_expression(delay.call.arguments[0], known)))
        if delay.ticks == 1:
            commit.append(Assign(delay.variable_name, kept))
        if delay.ticks > 1:
            slot, oldest = Ref("work.slot"), Ref(delay.oldest_index)
            fill.append(Loop(delay.ticks, slot.name, (Store(delay.variable_name, slot, kept),)))
            last = Compare("==", oldest, integer(delay.ticks - 1))
            replace.append(Store(delay.variable_name, oldest, kept))
            replace.append(Assign(oldest.name, Select(last, integer(0), add(oldest, integer(1)))))
    ring: Block = (Branch(IS_DELAY_FILLED, tuple(replace), tuple(fill)),) if fill else ()
    done: Block = (Assign(IS_DELAY_FILLED.name, Value(True)),) if values else ()
    return (*values, *ring, *commit, *done)


def sampled_delay_variables(
    automaton: Automaton, delays: tuple[SampledDelay, ...]
) -> list[Variable]:
    """Return the variables of delays; `finished` leaves out what is not used."""
    found = [
        Variable("memory.kept", "truth", about="delayed values are kept"),
        Variable("work.slot", "whole"),
    ]
    for delay in delays:
        size = delay.ticks if delay.ticks > 1 else 0
        found.append(
            Variable(delay.variable_name, delay.type, size=size, about=_describe_delay(delay))
        )
        found.append(Variable(delay.oldest_index, "whole", about="which of them is the oldest"))
        found.append(Variable(f"work.keep_{delay.number}", delay.type))
    return found


def _describe_delay(delay: SampledDelay) -> str:
    return "value of the tick before" if delay.ticks == 1 else f"values of {delay.ticks} ticks"


def find_memory_call(automaton: Automaton) -> FunctionCall | None:
    """Return a use of a function with memory, None where there is none."""
    for mode in automaton.all_modes:
        trees = [formula.tree for formula in mode_formulas(mode)]
        trees += [balance.right for balance in mode.flow.values()]
        for tree in trees:
            for part in walk(tree):
                if isinstance(part, FunctionCall) and part.function in MEMORY_FUNCTIONS:
                    return part
    return None
