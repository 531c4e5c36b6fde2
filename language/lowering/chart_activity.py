"""Conditions that a node of a chart is active or complete, from its regions' mode variables."""

from __future__ import annotations

from language.ir.ops import Binary, Compare, Expr, Ref, Value, integer
from language.ir.program import mode_variable
from language.model.statechart import Chart, ChartNode


def is_active(chart: Chart, node: ChartNode, base: str) -> Expr:
    """Return the condition that a node is active: its region is in one of the node's leaves.

    Leaves with consecutive numbers give one interval `low <= mode and mode <= high`, others a
    disjunction of `mode == number`. `base` is the mode variable of the chart.
    """
    variable = Ref(mode_variable(base, node.region))
    numbers = sorted(leaf.number for leaf in chart.leaves_of(node) if leaf.number is not None)
    others = {leaf.number for leaf in chart.leaves(node.region)} - {*numbers}
    low, high = numbers[0], numbers[-1]
    if low < high and not any(number is not None and low < number < high for number in others):
        above, below = Compare(">=", variable, integer(low)), Compare("<=", variable, integer(high))
        return Binary("and", above, below)
    found: Expr = Compare("==", variable, integer(low))
    for number in numbers[1:]:
        found = Binary("or", found, Compare("==", variable, integer(number)))
    return found


def is_complete(chart: Chart, node: ChartNode, base: str) -> Expr:
    """Return the condition that a node is complete: one of its final child modes is active.

    A parallel node is complete when all of its regions are. An atomic node gives a constant,
    whether it is final, and so does a node without final children (false).
    """
    if node.kind == "parallel":
        return _conjunction(
            [is_complete(chart, region, base) for region in chart.child_regions(node)]
        )
    if node.kind == "atomic":
        return Value(node.is_final)
    ends = [chart.nodes[child] for child in node.children if chart.nodes[child].is_final]
    found: Expr = Value(False)
    for number, end in enumerate(ends):
        here = is_active(chart, end, base)
        found = here if number == 0 else Binary("or", found, here)
    return found


def may_complete(chart: Chart, node: ChartNode) -> bool:
    """Return whether a node can be complete: it has a final child mode.

    A parallel node needs one in each of its regions; an atomic node has to be final itself.
    """
    if node.kind == "parallel":
        return all(may_complete(chart, region) for region in chart.child_regions(node))
    if node.kind == "atomic":
        return node.is_final
    return any(chart.nodes[child].is_final for child in node.children)


def _conjunction(parts: list[Expr]) -> Expr:
    """Return the conjunction of one or more conditions."""
    found = parts[0]
    for part in parts[1:]:
        found = Binary("and", found, part)
    return found
