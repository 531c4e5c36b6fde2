"""Memory of a sampled automaton: `previous` and `delay` as buffers of past values.

A delay of N ticks is a ring buffer of N values. A tick overwrites the oldest value after the
equations of the resulting mode are evaluated and before the updates. Until the first write, a
delayed value equals the present value. `language/lowering/edge_detection.py` holds the memory of
guards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from language.expressions.syntax_tree import (
    DELAY_FUNCTIONS,
    MEMORY_FUNCTIONS,
    FunctionCall,
    SyntaxTree,
    memory_key,
    walk,
)
from language.ir.analysis_cache import cache_on_owner
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
from language.model.automaton import Automaton
from language.model.declaration import Formula
from language.model.truth_table import truth_table_formulas
from language.model.used_names import mode_formulas
from language.text.diagnostic import Problems
from language.typecheck.infer import TypeChecker
from language.typecheck.name_environment import NameEnvironment
from language.typecheck.types import EnumType, IntType

MAX_DELAY = 4096
"""The longest delay in values: 32 kB of an instance."""

MAX_REWIND = 64
"""The longest rewind in ticks."""

IS_DELAY_FILLED = Ref("memory.kept")
"""The variable that the delay buffers hold values."""


@dataclass(frozen=True)
class SampledDelay:
    """The value of a call some ticks ago.

    `previous` has 1 tick; a delay of 0 ticks has no buffer.
    """

    number: int
    call: FunctionCall
    ticks: int
    type: ValueType

    @property
    def variable_name(self) -> str:
        """The variable `memory.delay_<number>`: a scalar for one tick, else a ring buffer."""
        return f"memory.delay_{self.number}"

    @property
    def oldest_index(self) -> str:
        """The variable `memory.oldest_<number>`: the index of the oldest value in the buffer."""
        return f"memory.oldest_{self.number}"


def memory_calls_by_key(
    automaton: Automaton, functions: tuple[str, ...]
) -> dict[str, FunctionCall]:
    """Return the different calls of some functions by memory key; inner calls come first.

    Of calls with the same key the first one is returned.
    """
    found: dict[str, FunctionCall] = {}
    for part in memory_calls(automaton):
        if part.function in functions:
            found.setdefault(memory_key(part), part)
    return found


@cache_on_owner
def memory_calls(automaton: Automaton) -> tuple[FunctionCall, ...]:
    """Return all calls of functions with memory, with repetitions; inner calls come first.

    The functions are MEMORY_FUNCTIONS. Searched are truth tables, then the modes with equations,
    actions, guards and the right sides of balances.
    """
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
    """Return whether an expression of an automaton calls a function, with memory or without.

    Searched are the same expressions as by `memory_calls`.
    """
    parts = (part for tree in _evaluated_trees(automaton) for part in walk(tree))
    return any(isinstance(part, FunctionCall) and part.function == function for part in parts)


def _evaluated_trees(automaton: Automaton) -> list[SyntaxTree]:
    """Return every expression of truth tables and modes that is evaluated, flows included."""
    trees = [formula.tree for formula in truth_table_formulas(automaton.tables)]
    for mode in automaton.all_modes:
        trees += [formula.tree for formula in mode_formulas(mode)]
        trees += [balance.right for balance in mode.flow.values()]
    return trees


def evaluate_ticks(automaton: Automaton, time: SyntaxTree) -> int:
    """Return ceil(time / period) of a constant time [s], computed exactly (rule 4a).

    Raises SpecError if the time is not made of numbers and parameters.
    """
    assert automaton.period is not None
    return math.ceil(evaluate_exactly(Formula(time, ""), automaton) / automaton.period)


def sampled_delays_of(automaton: Automaton) -> tuple[SampledDelay, ...]:
    """Return the different `previous` and `delay` calls of an automaton, numbered from 1.

    A call inside another one comes first; equal calls share one delay. Raises SpecError if a time
    is not made of numbers and parameters.
    """
    found: list[SampledDelay] = []
    for tree in memory_calls_by_key(automaton, DELAY_FUNCTIONS).values():
        ticks = evaluate_ticks(automaton, tree.arguments[1]) if tree.function == "delay" else 1
        kind = expression_type(automaton, tree.arguments[0])
        found.append(SampledDelay(len(found) + 1, tree, ticks, kind))
    return tuple(found)


def expression_type(automaton: Automaton, tree: SyntaxTree) -> ValueType:
    """Return the value type of an expression that has passed the type check.

    It is `truth` for a bool, `whole` for an int or an enumeration, else `real`.
    """
    scope = NameEnvironment(automaton.name_types, memory_functions=frozenset(MEMORY_FUNCTIONS))
    kind = TypeChecker(scope, Problems()).infer_type(tree)
    if kind == "truth":
        return "truth"
    return "whole" if isinstance(kind, IntType | EnumType) else "real"


def add_delay_bindings(delays: tuple[SampledDelay, ...], known: NameBindings) -> dict[str, Expr]:
    """Return `known` with the value of each delayed call added under its memory key.

    The value is the buffered one, or the present value until the buffers hold values. A delay of 0
    ticks is the present value. `known` is not changed.
    """
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


def record_delays_block(delays: tuple[SampledDelay, ...], known: NameBindings) -> Block:
    """Return the operations that record the delayed values of a tick.

    All values are evaluated before the first one is stored. The first record fills a ring buffer;
    later ones replace its oldest value. At the end `memory.kept` becomes true. Without a delay of
    at least one tick there are no operations.
    """
    values: list[Op] = []
    fill: list[Op] = []
    replace: list[Op] = []
    commit: list[Op] = []
    for delay in delays:
        value = Ref(f"work.keep_{delay.number}")
        if delay.ticks:
            values.append(Assign(value.name, lower_expression(delay.call.arguments[0], known)))
        if delay.ticks == 1:
            commit.append(Assign(delay.variable_name, value))
        if delay.ticks > 1:
            slot, oldest = Ref("work.slot"), Ref(delay.oldest_index)
            fill.append(Loop(delay.ticks, slot.name, (Store(delay.variable_name, slot, value),)))
            last = Compare("==", oldest, integer(delay.ticks - 1))
            replace.append(Store(delay.variable_name, oldest, value))
            replace.append(Assign(oldest.name, Select(last, integer(0), add(oldest, integer(1)))))
    ring: Block = (Branch(IS_DELAY_FILLED, tuple(replace), tuple(fill)),) if fill else ()
    done: Block = (Assign(IS_DELAY_FILLED.name, Value(True)),) if values else ()
    return (*values, *ring, *commit, *done)


def sampled_delay_variables(delays: tuple[SampledDelay, ...]) -> list[Variable]:
    """Return the variables of delays; `finalise_program` removes the unused ones.

    They are `memory.kept`, `work.slot` and, for each delay, its values, `memory.oldest_<n>` and
    `work.keep_<n>`. A ring buffer has one place for each tick.
    """
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
    """Return the comment of the variable of a delay."""
    return "value of the tick before" if delay.ticks == 1 else f"values of {delay.ticks} ticks"


def find_memory_call(automaton: Automaton) -> FunctionCall | None:
    """Return the first call of a function with memory in the modes of an automaton, or None.

    Truth tables are not searched; an outer call comes before its arguments.
    """
    for mode in automaton.all_modes:
        trees = [formula.tree for formula in mode_formulas(mode)]
        trees += [balance.right for balance in mode.flow.values()]
        for tree in trees:
            for part in walk(tree):
                if isinstance(part, FunctionCall) and part.function in MEMORY_FUNCTIONS:
                    return part
    return None
