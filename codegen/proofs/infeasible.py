"""Infeasible: conditions of the C of a sampled Program that no input makes true, or false: proofs.

One step is followed from any values that an invariant allows, with any inputs and any page
(`symbolic.py`, `terms.py`). The invariant is what is left of a proposal once all is out that does
not hold at the start or does not stay (Houdini, Flanagan and Leino 2001): ranges of variables, ends
of counters, numbers of modes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

from codegen.expression import LOGIC, c_expression
from codegen.names import SOLVED_ON_PAGE, CNames
from codegen.proofs.symbolic import Fact, World
from codegen.proofs.terms import Range
from codegen.statement import going_on, opposite
from codegen.usage import locals_of
from language.operation import (
    Assign,
    Binary,
    Branch,
    Count,
    Expr,
    Loop,
    Op,
    Select,
    Unary,
)
from language.program import Program
from language.substitution import own_expressions, subexpressions
from language.traversal import walk


@dataclass(frozen=True)
class Place:
    """A decision as C has it: its block, its text, and the numbers of its conditions."""

    block: str
    text: str
    conditions: tuple[int, ...]


def places_of(program: Program) -> Iterator[Place]:
    """Yield the decisions of the Program that C is printed of, as far as C has them as they are."""
    local = locals_of(program)
    for name, block in program.blocks.items():
        place = CNames(program, local[name], SOLVED_ON_PAGE)
        for op in walk(block):
            tests = [(test, test) for test in _inside(op)]
            if isinstance(op, Loop):
                yield Place(name, f"{place(op.index)} < {op.count}", (id(op),))
            if isinstance(op, Loop) and (condition := going_on(op.index, op.body)[0]) is not None:
                tests.append((opposite(condition), condition))
            if isinstance(op, Branch):
                tests.append((op.condition, op.condition))
            if isinstance(op, Count):
                tests.append((opposite(op.condition), op.condition))
            for shown, test in tests:
                numbers = tuple(id(condition) for condition in _conditions(test))
                yield Place(name, c_expression(shown, place), numbers)
            if isinstance(op, Count):
                yield Place(name, f"{place(op.timer)} < {op.limit}U", (id(op),))


def never(
    program: Program, ranges: Mapping[str, Range], wanted: Collection[int]
) -> dict[int, bool]:
    """Return of conditions, by number, the one outcome that they never have, where that is proven.

    `ranges` are those of variables between two steps, as far as they stay in them.
    """
    world = World(program)
    facts = _invariant(world, ranges)
    world.step()
    found: dict[int, bool] = {}
    for number in wanted:
        visits = world.visits.get(number, [])
        for outcome in (True, False):
            if visits and all(world.excludes(visit, outcome, facts) for visit in visits):
                found[number] = outcome
    return found


def _inside(op: Op) -> Iterator[Expr]:
    """Yield the decisions inside an operation: of choices, and of what is assigned as a truth."""
    for expr in own_expressions(op):
        yield from (part.condition for part in subexpressions(expr) if isinstance(part, Select))
    if isinstance(op, Assign) and isinstance(op.value, Binary) and op.value.operator in LOGIC:
        yield op.value


def _conditions(expr: Expr) -> Iterator[Expr]:
    """Yield the conditions of a decision: what stands between `and` and `or`."""
    match expr:
        case Binary("and" | "or", left, right):
            yield from _conditions(left)
            yield from _conditions(right)
        case Unary("not", Binary() as operand):
            yield from _conditions(operand)
        case _:
            yield expr


def _invariant(world: World, ranges: Mapping[str, Range]) -> list[Fact]:
    """Return what holds before every step: the largest part of what is proposed that stays."""
    values = world.step()
    first = world.after_init()
    facts = [fact for fact in world.proposed(ranges) if world.holds(first, fact)]
    while True:
        stays = [fact for fact in facts if world.holds(values, fact, facts)]
        if stays == facts:
            return facts
        facts = stays
