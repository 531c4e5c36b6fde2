"""Candidate invariants: facts that may hold of variables at a cutpoint.

Facts are proposed from the operations of a Program and from the initial values of a loop. Those
that are not inductive are removed by `houdini.py`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from codegen.proofs.infeasible.cutpoints import Cutpoint, blocks_of
from codegen.proofs.infeasible.float_terms import Limits, Range
from language.charts.chart_context import NEVER_LEFT
from language.ir.number_type import round_to_type
from language.ir.ops import Assign, Binary, Compare, Count, Expr, Ref, Unary, Value
from language.ir.program import MODE_VARIABLE, Program, mode_variable
from language.ir.rewrite_ops import direct_expressions, walk_post_order
from language.ir.traversal import block_writes, walk_ops
from language.lowering.program_builder import INACTIVE
from language.programs.model_run import RUN_MODE

LEFT = "memory.left_"
"""The prefix of history variables, which hold the mode that was left, or NEVER_LEFT."""
KEPT = "memory."
LARGEST_LIMIT = 64
"""Largest number with which a loop compares a counter that is used as a candidate."""
MOST_FACTOR = 8
"""Largest factor between two counters that is tried."""
MOST_COUNTED = 5
"""Number of upper bounds, from 0 on, that are tried for a counter in a mode."""
Literal = tuple[str, int]
"""A variable and a value: a number, or a truth value as 0 or 1."""


@dataclass(frozen=True)
class Within:
    """A variable is within limits if other variables have the values in `where`."""

    cut: Cutpoint
    name: str
    limits: Limits
    where: tuple[Literal, ...] = ()


@dataclass(frozen=True)
class AtMost:
    """A counter is at most `factor` times the sum of others, plus `more`.

    The bound is one higher if the truth value `going`, which keeps a loop running, is false. The
    fact holds under the condition that other variables have the values in `where`.
    """

    cut: Cutpoint
    name: str
    others: tuple[str, ...]
    factor: int = 1
    more: int = 0
    going: str = ""
    where: tuple[Literal, ...] = ()


@dataclass(frozen=True)
class Same:
    """A comparison of a variable with a number or another variable equals a truth value.

    The truth value is a constant or a variable. The fact holds under the condition that other
    variables have the values in `where`.
    """

    cut: Cutpoint
    name: str
    operator: str
    number: float | int | str
    truth: str | bool
    where: tuple[Literal, ...] = ()


Fact = Within | AtMost | Same


def propose_facts(
    program: Program,
    cuts: Mapping[Cutpoint, Mapping[str, int]],
    ranges: Mapping[str, Range],
) -> Iterator[Fact]:
    """Yield candidate facts at the cutpoints.

    `cuts` gives for each cutpoint the numbers and truth values with which its loop begins. `ranges`
    gives the ranges of variables between two steps.
    """
    number = program.number_type
    for cut, first in cuts.items():
        for name, (low, high) in ranges.items():
            if name in cut.names:
                yield Within(cut, name, (round_to_type(low, number), round_to_type(high, number)))
        limits = _limits(program, cut, first)
        for name, some in limits.items():
            yield from (Within(cut, name, one) for one in some)
        asked = list(asked_of(program, cut))
        for where in _wheres(program, cut, first):
            known = {name for name, _ in where}
            for name, some in limits.items():
                if name not in known:
                    yield from (Within(cut, name, one, where) for one in some)
            for name, operator, end in asked if len(where) > 1 else ():
                yield from (Same(cut, name, operator, end, t, where) for t in (True, False))
        yield from _histories(cut)
        if cut.loop:
            yield from _counts(program, cut, first)


def _limits(program: Program, cut: Cutpoint, first: Mapping[str, int]) -> dict[str, list[Limits]]:
    """Return limits that are tried of variables of a cut: modes, timers, truths, counters."""
    found: dict[str, list[Limits]] = {}
    for name, numbers in modes_of(program).items():
        found[name] = [frozenset(numbers), *(frozenset({n}) for n in numbers)]
        found[name] += [frozenset(numbers) - {n} for n in numbers if len(numbers) > 2]
    for name, limit in _timers(program):
        found.setdefault(name, []).extend([(0, limit - 1), (0, limit), (1, limit)])
    kinds = {v.name: v.type for v in program.variables if not v.size}
    for modes in (modes_of(program), active_modes_of(program)):
        for name, some in _assigned(program, modes).items():
            if name not in modes:
                found.setdefault(name, []).append(frozenset(some))
    for name, kind in kinds.items():
        if kind == "truth" and (name.startswith(KEPT) or name in first):
            found[name] = [frozenset({0}), frozenset({1})]
        elif kind == "whole" and name in first and name not in found:
            found[name] = [(0, most) for most in range(MOST_COUNTED)]
    if cut.loop:
        found[cut.loop.index] = [(0, 0), (1, cut.loop.count), (0, cut.loop.count)]
        for name, number in ends_of(program, cut):
            found.setdefault(name, []).append((0, number))
    return {name: limits for name, limits in found.items() if name in cut.names}


def _wheres(
    program: Program, cut: Cutpoint, first: Mapping[str, int]
) -> Iterator[tuple[Literal, ...]]:
    """Yield the conditions under which something is tried: a mode, how a loop goes on, both."""
    modes = modes_at(program, cut)
    going = going_values(program, first)
    yield from ((one,) for one in (*modes, *going))
    yield from ((mode, one) for mode in modes for one in going)


def modes_at(program: Program, cut: Cutpoint) -> list[Literal]:
    """Return pairs of a mode variable and a mode for all regions that are known at a cutpoint."""
    modes = modes_of(program).items()
    return [(name, number) for name, of in modes for number in of if name in cut.names]


def going_values(program: Program, first: Mapping[str, int]) -> list[Literal]:
    """Return both values of each truth value that is initialised before a loop."""
    return [(name, value) for name in truths_of(program, first) for value in (0, 1)]


def truths_of(program: Program, first: Mapping[str, int]) -> list[str]:
    """Return the truth values that are initialised before a loop."""
    kinds = {v.name: v.type for v in program.variables}
    return [name for name in first if kinds.get(name) == "truth"]


def modes_of(program: Program) -> dict[str, list[int]]:
    """Return the numbers of modes by mode variable."""
    modes = {MODE_VARIABLE: program.modes, RUN_MODE: program.run_modes}
    modes |= {mode_variable(MODE_VARIABLE, region.name): region.modes for region in program.regions}
    return {name: [info.number for info in infos] for name, infos in modes.items() if infos}


def active_modes_of(program: Program) -> dict[str, list[int]]:
    """Return the numbers of modes by mode variable, without the number of an inactive region."""
    inactive = {i.number for r in program.regions for i in r.modes if i.name == INACTIVE}
    modes = modes_of(program)
    return {name: [n for n in numbers if n not in inactive] for name, numbers in modes.items()}


def _assigned(program: Program, modes: Mapping[str, Sequence[int]]) -> dict[str, set[int]]:
    """Return the numbers that whole numbers kept from step to step are given: literals, or what
    others like them have, modes to begin with.
    """
    kept = {v.name for v in program.variables if v.type == "whole" and v.name.startswith(KEPT)}
    found = {name: set(numbers) for name, numbers in modes.items()}
    given: dict[str, list[Expr]] = {}
    for block in program.blocks.values():
        for op in walk_ops(block):
            if isinstance(op, Assign) and op.target in kept - set(found):
                given.setdefault(op.target, []).append(op.value)
    for name, values in given.items():
        numbers = set[int]()
        for value in values:
            match value:
                case Value(int(number)):
                    numbers.add(number)
                case Ref(other) if other in found:
                    numbers |= found[other]
                case _:
                    break
        else:
            found[name] = numbers
    return found


def _timers(program: Program) -> Iterator[tuple[str, int]]:
    for block in program.blocks.values():
        yield from ((op.timer, op.limit) for op in walk_ops(block) if isinstance(op, Count))


def ends_of(program: Program, cut: Cutpoint) -> Iterator[tuple[str, int]]:
    """Yield loop counters with the numbers, up to LARGEST_LIMIT, they are compared with."""
    counters = set(counters_of(program, cut))
    for expr in _expressions(program, cut):
        match expr:
            case Compare(_, Ref(name), Value(int(most))) if (
                name in counters and 0 < most <= LARGEST_LIMIT
            ):
                yield name, most


def compared_in(program: Program, cut: Cutpoint) -> Iterator[tuple[str, str, int]]:
    """Yield the comparisons of whole numbers with literals that are assigned to truth values."""
    wholes = {v.name for v in program.variables if v.type == "whole"} & set(cut.names)
    found = set()
    for block in program.blocks.values():
        for op in walk_ops(block):
            match op:
                case Assign(_, Compare(operator, Ref(name), Value(int(number)))) if name in wholes:
                    found.add((name, operator, number))
    yield from sorted(found)


def asked_of(program: Program, cut: Cutpoint) -> Iterator[tuple[str, str, float | int]]:
    """Yield the comparisons with a number in a loop whose variable the loop does not change."""
    if cut.loop is None:
        return
    written = {n for block in blocks_of(program, cut.loop.body) for n in block_writes(block)}
    found = set()
    for expr in _expressions(program, cut):
        match expr:
            case Compare(operator, Ref(name), Value(number)) if name not in written:
                found.add((name, operator, number))
            case Compare(operator, Ref(name), Unary("-", Value(number))) if name not in written:
                found.add((name, operator, -number))
    for name, operator, number in sorted(one for one in found if one[0] in cut.names):
        is_real = isinstance(number, float)
        yield name, operator, round_to_type(number, program.number_type) if is_real else number


def _histories(cut: Cutpoint) -> Iterator[Fact]:
    left = [name for name in cut.names if name.startswith(LEFT)]
    for one in left:
        where = ((one, NEVER_LEFT),)
        yield from (Within(cut, n, frozenset({NEVER_LEFT}), where) for n in left if n != one)


def _counts(program: Program, cut: Cutpoint, first: Mapping[str, int]) -> Iterator[Fact]:
    """Yield how counters of a loop hang together."""
    assert cut.loop
    counters, index = counters_of(program, cut), cut.loop.index
    truths = truths_of(program, first)
    for name, operator, number in compared_in(program, cut):
        yield from (Same(cut, name, operator, number, truth) for truth in truths)
    for one in counters:
        for other in (name for name in counters if name != one):
            factors = range(1, MOST_FACTOR + 1)
            yield from (AtMost(cut, one, (other,), k, more) for k in factors for more in (0, 1))
            for going in truths if one < other else ():
                yield AtMost(cut, index, (one, other), going=going)
        yield from (AtMost(cut, index, (one,), going=going) for going in truths)


def counters_of(program: Program, cut: Cutpoint) -> list[str]:
    """Return the sorted names of the whole numbers that a loop increments by one."""
    assert cut.loop
    ops = [op for block in blocks_of(program, cut.loop.body) for op in walk_ops(block)]
    assigned = [op for op in ops if isinstance(op, Assign)]
    found = {op.target for op in assigned if _counts_up(op)}
    return sorted(found & set(cut.names))


def _counts_up(op: Assign) -> bool:
    match op.value:
        case Binary("+", Ref(name), Value(1)):
            return name == op.target
    return False


def _expressions(program: Program, cut: Cutpoint) -> Iterator[Expr]:
    assert cut.loop
    for block in blocks_of(program, cut.loop.body):
        for op in walk_ops(block):
            for expr in direct_expressions(op):
                yield from walk_post_order(expr)
