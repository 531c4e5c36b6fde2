"""Longest: the bound of a step's work, by hand."""

from __future__ import annotations

from language.ir.operation_count import max_operations
from language.ir.ops import Assign, Branch, Compare, Loop, Ref, RunBlock, Switch, add, real

X = Ref("state.x")
ONE = Assign("state.x", add(X, real(1.0)))  # an addition and a store: 2


def test_the_side_with_more_counts_and_loops_run_to_their_end() -> None:
    is_low = Compare("<", X, real(0.0))
    blocks = {
        "step": (ONE, Branch(is_low, (ONE, ONE), (RunBlock("twice"),)), Switch("memory.mode", ())),
        "twice": (Loop(3, "work.k", (ONE, Switch("memory.mode", ((0, (ONE,)), (1, (ONE, ONE)))))),),
    }
    twice = 3 * (2 + 2 + 1 + 4)
    assert max_operations(blocks, "twice") == twice
    assert max_operations(blocks, "step") == 2 + 1 + 1 + twice + 1
