"""Choice of a transition of a mode: guards, waits and priority (rules 3a and 4b)."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from language.ir.ops import Assign, Block, Branch, Compare, Count, Expr, Op, Ref, integer
from language.ir.program import TransitionInfo
from language.lowering.edge_detection import detect_edges, guard_memory_bindings
from language.lowering.expressions import NameBindings, lower_expression
from language.lowering.transition_metadata import wait_ticks
from language.model.automaton import Automaton, Mode, Transition
from language.model.region_queries import transitions_by_priority


def choose_by_priority(
    mode: Mode, enabled: Mapping[int, Expr], effects: Mapping[int, Block]
) -> Block:
    """Return the operations of the enabled transition with the smallest priority (rule 3a).

        if enabled_1: effects_1 else if enabled_2: effects_2 ...    (in the order of priority)

    `enabled` and `effects` map the index of a transition in the mode to its condition and its
    operations. A transition without a condition is taken without a test, and those after it are
    left out. If none is enabled, nothing happens.
    """
    ops: Block = ()
    for k, _ in reversed(transitions_by_priority(mode)):
        ops = (Branch(enabled[k], effects[k], ops),) if k in enabled else effects[k]
    return ops


def without_last_test(mode: Mode, enabled: Mapping[int, Expr]) -> dict[int, Expr]:
    """Return the conditions that need a test, by index, if one of `enabled` is known to hold.

    The last transition in the order of priority is then enabled if no other one is.
    """
    return {k: enabled[k] for k, _ in transitions_by_priority(mode)[:-1]}


@dataclass(frozen=True)
class SampledChoice:
    """The choice of a transition of a mode of a sampled automaton.

    `edges` detect edges and `counts` count the waits in a tick. `restarts` replace `counts` in a
    later micro-step of the tick: a wait that begins there has the count 0. `conditions` are those
    of the transitions by their index in the mode, and `enabled` those with the waits.
    """

    edges: Block
    counts: Block
    restarts: Block
    conditions: Mapping[int, Expr]
    enabled: Mapping[int, Expr]


def lower_sampled_choice(
    automaton: Automaton,
    mode: Mode,
    known: NameBindings,
    infos: Sequence[TransitionInfo],
    condition_of: Callable[[Transition, Expr], Expr] = lambda transition, guard: guard,
) -> SampledChoice:
    """Return the guards and waits of a mode's transitions (rule 4b).

    `known` are the names with equations, `infos` the data of the transitions. `condition_of` gives
    the condition of a transition from its guard. The first tick with a true condition counts 1, so
    a wait of N ticks is over when the counter exceeds N.
    """
    guard_names = ChainMap(guard_memory_bindings(automaton, mode), dict(known))
    counts: list[Op] = []
    restarts: list[Op] = []
    conditions: dict[int, Expr] = {}
    enabled: dict[int, Expr] = {}
    for k, transition in transitions_by_priority(mode):
        info, guard = infos[k], lower_expression(transition.when.tree, guard_names)
        conditions[k] = enabled[k] = condition = condition_of(transition, guard)
        if info.timer:
            timer = Ref(info.timer)
            counts.append(Count(info.timer, condition, info.timer_limit, info.guard_key))
            begin = Branch(Compare("==", timer, integer(0)), (Assign(info.timer, integer(1)),))
            restarts.append(Branch(condition, (begin,), (Assign(info.timer, integer(0)),)))
            enabled[k] = Compare(">", timer, wait_ticks(info))
    edges = tuple(detect_edges(automaton, mode, known))
    return SampledChoice(edges, tuple(counts), tuple(restarts), conditions, enabled)
