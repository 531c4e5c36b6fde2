"""Contracts of blocks: the groups of variables that each kind of block may write.

The engine evaluates guards and rates at trial points, the fast path and the search of crossings
repeat them, and a checker of contracts of C reads what a function writes. All of them are right
only as long as these blocks write work variables only.
"""

from __future__ import annotations

from collections.abc import Mapping

from language.ir.program import ENGINE_BLOCKS, ENTRY_BLOCKS

ENTRIES = frozenset((*ENTRY_BLOCKS, *ENGINE_BLOCKS, "compare_stamps"))
"""Blocks that back ends run from outside."""
WORK_ONLY = frozenset({"work"})
CONTRACTS: Mapping[str, frozenset[str]] = {
    "choose_": WORK_ONLY,
    "compare_stamps": frozenset({"memory"}),
    "cubic": WORK_ONLY,
    "dense": WORK_ONLY,
    "dense_guards_": WORK_ONLY,
    "derive": frozenset({"derived", "work"}),
    "equations": frozenset({"equation", "work"}),
    "equations_": frozenset({"equation", "work"}),
    "evaluate_tables": frozenset({"discrete", "memory", "work"}),
    "guards_": WORK_ONLY,
    "half_": WORK_ONLY,
    "invariants": frozenset({"check", "work"}),
    "limit": WORK_ONLY,
    "locate_": WORK_ONLY,
    "point": WORK_ONLY,
    "rates_": WORK_ONLY,
    "remainder_": WORK_ONLY,
    "resolve_": WORK_ONLY,
    "restart_waits": frozenset({"timer"}),
    "retain_inputs": frozenset({"before"}),
    "rows_": WORK_ONLY,
    "series_": WORK_ONLY,
    "stage_": WORK_ONLY,
    "step_": WORK_ONLY,
    "whole_": WORK_ONLY,
}
"""Groups that a block may write, by its name; a key that ends with `_` is a prefix of names."""


def written_groups(block: str) -> frozenset[str] | None:
    """Return the groups that a block may write; None for a block without a contract."""
    if block in CONTRACTS:
        return CONTRACTS[block]
    prefixes = [key for key in CONTRACTS if key.endswith("_") and block.startswith(key)]
    return CONTRACTS[max(prefixes, key=len)] if prefixes else None
