"""Symbolic: one step of a sampled Program over values that are not known, for z3.

What loops leave is left open, as is what operations give (`terms.py`): more than happens, so what
is never true of it never is.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from codegen.proofs.terms import Limits, Range, Terms
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Choose,
    Compare,
    Count,
    Expr,
    FaultBit,
    Item,
    Loop,
    Op,
    Ref,
    Run,
    Select,
    Store,
    Unary,
    Value,
)
from language.program import MODE, Program
from language.run import MODE as RUN_MODE
from language.traversal import block_writes, reached, walk

EFFORT = 20_000_000
"""Units of z3's own count for one question: some seconds, and the same answer on every machine."""
Fact = tuple[str, Limits]


@dataclass(frozen=True)
class Visit:
    """A condition where a step comes by it, and what holds there."""

    condition: Any
    path: Any


class World:
    """Values of a Program, and one step of it from `start`; `visits` are by `id` of a condition."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.terms = Terms(program.number)
        self.z3 = self.terms.z3
        self.kinds = {v.name: v.type for v in (*program.variables, *program.inputs)}
        self.kinds |= {c.name: c.type for c in program.constants}
        fixed = (c for c in program.constants if c.kind == "fixed")
        self.fixed = {c.name: self.terms.value(c.value) for c in fixed}
        self.start: Mapping[str, Any] = {}
        self.visits: dict[int, list[Visit]] = {}

    def proposed(self, ranges: Mapping[str, Range]) -> Iterator[Fact]:
        """Yield what may hold of variables between two steps."""
        yield from ranges.items()
        for name, infos in ((MODE, self.program.modes), (RUN_MODE, self.program.run_modes)):
            if name in self.kinds and infos:
                yield name, frozenset(info.number for info in infos)
        for block in self.program.blocks.values():
            for op in walk(block):
                if isinstance(op, Count):
                    yield op.timer, frozenset(range(op.limit))
                    yield op.timer, frozenset(range(op.limit + 1))

    def after_init(self) -> dict[str, Any]:
        """Return what variables are before the first step: 0 or false, and what `init` sets."""
        zero = {"real": 0.0, "truth": False}
        values = {name: self.terms.value(zero.get(kind, 0)) for name, kind in self.kinds.items()}
        values |= self.fixed
        self._block(self.program.blocks["init"], values, self.terms.value(True))
        return values

    def step(self) -> dict[str, Any]:
        """Return what variables are after one step from anywhere; its conditions are noted."""
        self.visits = {}
        values = {name: self._any(name) for name in self.kinds} | self.fixed
        self.start = dict(values)
        self._block(self.program.blocks["step"], values, self.terms.value(True))
        return values

    def holds(self, values: Mapping[str, Any], fact: Fact, before: Collection[Fact] = ()) -> bool:
        """Prove a fact of some values, where others held before the step."""
        name, limits = fact
        wrong = self.z3.Not(self.terms.within(values[name], limits))
        return self._is_never([wrong, *self._all(before)])

    def excludes(self, visit: Visit, outcome: bool, before: Collection[Fact]) -> bool:
        """Prove that a condition never has an outcome where it is come by."""
        condition = visit.condition if outcome else self.z3.Not(visit.condition)
        return self._is_never([condition, visit.path, *self._all(before)])

    def _all(self, facts: Collection[Fact]) -> list[Any]:
        return [self.terms.within(self.start[name], limits) for name, limits in facts]

    def _is_never(self, facts: list[Any]) -> bool:
        solver = self.z3.Solver()
        solver.set("rlimit", EFFORT)
        solver.add(*facts)
        return bool(solver.check() == self.z3.unsat)

    def _any(self, name: str) -> Any:
        return self.terms.new(self.kinds.get(name, "real"), name)

    # ---- operations ------------------------------------------------------------------------

    def _block(self, block: Block, values: dict[str, Any], path: Any) -> None:
        for op in block:
            self._op(op, values, path)

    def _op(self, op: Op, values: dict[str, Any], path: Any) -> None:
        match op:
            case Assign(target, value, _):
                values[target] = self._expr(value, values, path)
            case Store(array, index, value):
                self._expr(index, values, path)
                self._expr(value, values, path)
                values[array] = self._any(array)
            case Branch(condition, then, other):
                test = self._decided(condition, values, path)
                self._merge(test, then, other, values, path)
            case Choose(selector, cases):
                which = values[selector]
                for number, case in cases:
                    self._merge(which == number, case, (), values, path)
            case Loop(_, index, body):
                self._loop(index, body, values, path)
            case Count():
                self._count(op, values, path)
            case FaultBit():
                values["memory.faults"] = self._any("memory.faults")
            case Run(name):
                self._block(self.program.blocks[name], values, path)

    def _count(self, op: Count, values: dict[str, Any], path: Any) -> None:
        z3, now = self.z3, values[op.timer]
        test = self._decided(op.condition, values, path)
        counts = self._visited(id(op), now < op.limit, z3.And(path, test))
        values[op.timer] = z3.If(test, z3.If(counts, now + 1, now), 0)

    def _merge(
        self, test: Any, then: Block, other: Block, values: dict[str, Any], path: Any
    ) -> None:
        z3 = self.z3
        one, two = dict(values), dict(values)
        self._block(then, one, z3.And(path, test))
        self._block(other, two, z3.And(path, z3.Not(test)))
        for name in one | two:
            a, b = one.get(name), two.get(name)
            if a is None or b is None:
                values[name] = self._any(name)
            elif a is not b:
                values[name] = z3.If(test, a, b)

    def _loop(self, index: str, body: Block, values: dict[str, Any], path: Any) -> None:
        """Any turn of a loop begins with any values of what the loop sets, and so ends all."""
        names = {index, *block_writes(body)}
        for op in walk(body):
            if isinstance(op, Run):
                for run in reached(op.block, self.program.blocks):
                    names |= set(block_writes(self.program.blocks[run]))
        for name in sorted(names):
            values[name] = self.terms.new("whole", name) if name == index else self._any(name)
        self._block(body, dict(values), path)
        for name in sorted(names):
            values[name] = self._any(name)

    # ---- expressions -----------------------------------------------------------------------

    def _decided(self, condition: Expr, values: dict[str, Any], path: Any) -> Any:
        """Return a decision; note each condition of it, where it is evaluated (C evaluates no more
        than it needs).
        """
        z3 = self.z3
        match condition:
            case Binary("and", left, right):
                test = self._decided(left, values, path)
                return z3.And(test, self._decided(right, values, z3.And(path, test)))
            case Binary("or", left, right):
                test = self._decided(left, values, path)
                return z3.Or(test, self._decided(right, values, z3.And(path, z3.Not(test))))
            case Unary("not", Binary() as operand):
                return z3.Not(self._decided(operand, values, path))
        return self._visited(id(condition), self._expr(condition, values, path), path)

    def _visited(self, number: int, condition: Any, path: Any) -> Any:
        self.visits.setdefault(number, []).append(Visit(condition, path))
        return condition

    def _expr(self, expr: Expr, values: dict[str, Any], path: Any) -> Any:
        z3, terms = self.z3, self.terms
        match expr:
            case Value(value):
                return terms.value(value)
            case Ref(name):
                if name not in values:
                    values[name] = self._any(name)
                return values[name]
            case Item(_, _, whole):
                return terms.new("whole" if whole else "real", "item")
            case Binary("and" | "or") | Unary("not", Binary()):
                return self._decided(expr, values, path)
            case Unary(operator, operand):
                inner = self._expr(operand, values, path)
                return z3.Not(inner) if operator == "not" else terms.minus(inner)
            case Binary(operator, left, right):
                pair = self._expr(left, values, path), self._expr(right, values, path)
                return terms.sum(operator, *pair)
            case Compare(operator, left, right):
                pair = self._expr(left, values, path), self._expr(right, values, path)
                return terms.compare(operator, *pair)
            case Select(condition, then, other):
                test = self._decided(condition, values, path)
                one = self._expr(then, values, z3.And(path, test))
                return z3.If(test, one, self._expr(other, values, z3.And(path, z3.Not(test))))
            case Call(function, arguments):
                return terms.call(function, [self._expr(a, values, path) for a in arguments])
