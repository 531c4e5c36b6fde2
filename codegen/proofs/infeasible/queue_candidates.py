"""Queue candidates: candidate invariants on the contents of small arrays inside a loop."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations, permutations

from codegen.proofs.infeasible.candidate_invariants import (
    AtMost,
    Fact,
    Literal,
    Within,
    counters_of,
    going_values,
    modes_of,
    truths_of,
)
from codegen.proofs.infeasible.cutpoints import Cutpoint, items_of
from codegen.proofs.infeasible.loop_candidates import all_of, counts_of, said
from language.ir.ops import Assign, Item, Op, Store, Value
from language.ir.program import Program

Numbers = Mapping[str, frozenset[int]]
"""The numbers that are stored into an array, by its name."""


def queue_candidates(program: Program, cut: Cutpoint, first: Mapping[str, int]) -> Iterator[Fact]:
    """Yield candidates on the elements of small arrays and on values read from them."""
    arrays, ops = items_of(program), all_of(program, _every(program))
    stored = {name: _stored(ops, name) for name in arrays}
    truths = truths_of(program, first)
    ends = [name for name in counters_of(program, cut) if name not in first]
    read = [(target, name) for target, name in _read(ops, stored) if target in cut.names]
    yield from _current_events(program, cut, going_values(program, first), read, stored)
    for name, items in arrays.items():
        yield from (Within(cut, end, (0, len(items))) for end in ends)
        for end, head in permutations(ends, 2):
            yield AtMost(cut, end, (head,), more=1)
            for n in range(1, len(items) + 1):
                where = ((end, n), (head, n - 1))
                yield from _waiting(program, cut, where)
                none = (*truths, *(target for target, _ in read))
                yield from (Within(cut, one, frozenset({0}), where) for one in none)
        for k, item in enumerate(items):
            for some in _parts(stored[name]):
                yield from (Within(cut, item, some, at) for at in _places(ends, k, len(items)))


def _every(program: Program) -> Iterator[Op]:
    return (op for block in program.blocks.values() for op in block)


def _stored(ops: Sequence[Op], array: str) -> frozenset[int]:
    """Return the numbers that are put into an array as they stand."""
    found = set()
    for op in ops:
        match op:
            case Store(name, _, Value(int(number))) if name == array:
                found.add(number)
    return frozenset(found)


def _read(ops: Sequence[Op], stored: Numbers) -> list[tuple[str, str]]:
    """Return what is read from arrays: the variable and the array."""
    found: dict[tuple[str, str], None] = {}
    for op in ops:
        match op:
            case Assign(target, Item(name)) if name in stored:
                found[target, name] = None
    return list(found)


def _current_events(
    program: Program,
    cut: Cutpoint,
    going: Sequence[Literal],
    read: Sequence[tuple[str, str]],
    stored: Numbers,
) -> Iterator[Fact]:
    """Yield what may have been read, and what holds while it is there."""
    pairs = [(one, other) for one, other in combinations(going, 2) if one[0] != other[0]]
    for target, name in read:
        for some in _parts(stored[name]):
            yield from (Within(cut, target, some | {0}, pair) for pair in pairs)
        for number in sorted(stored[name]):
            yield from _waiting(program, cut, ((target, number),))


def _waiting(program: Program, cut: Cutpoint, where: tuple[Literal, ...]) -> Iterator[Fact]:
    """Yield what may hold while something waits: modes, counts, what guards say."""
    for name, numbers in modes_of(program).items():
        if name in cut.names:
            yield from (Within(cut, name, frozenset({n}), where) for n in numbers)
    for name, most in counts_of(program, cut).items():
        yield from (Within(cut, name, (0, k), where) for k in range(most))
    yield from said(program, cut, where)


def _places(ends: Sequence[str], item: int, size: int) -> Iterator[tuple[Literal, ...]]:
    """Yield where counters stand while an item waits: its end, and its head as well."""
    for end in ends:
        for n in range(item + 1, size + 1):
            yield ((end, n),)
            for head in (one for one in ends if one != end):
                yield from (((end, n), (head, at)) for at in range(item + 1))


def _parts(numbers: frozenset[int]) -> Iterator[frozenset[int]]:
    """Yield some numbers, each one alone, and all but each."""
    yield numbers
    if len(numbers) > 1:
        yield from (frozenset({n}) for n in sorted(numbers))
        yield from (numbers - {n} for n in sorted(numbers) if len(numbers) > 2)
