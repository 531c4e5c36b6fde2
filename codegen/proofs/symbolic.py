"""Symbolic: one step of a sampled Program over values that are not known, for z3.

What loops leave is left open, as is what operations give (`terms.py`): more than happens, so what
is never true of it never is.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from codegen.proofs.fact import AtMost, Fact, Same, Within, in_loop, runs_of
from codegen.proofs.terms import Range, Terms
from codegen.statement import going_on
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
from language.program import Program
from language.traversal import block_writes

EFFORT = 20_000_000
"""Units of z3's own count for one question: some seconds, and the same answer on every machine."""


@dataclass(frozen=True)
class Claim:
    """A fact of a loop, by its `id`, or, with 0, of steps."""

    loop: int
    fact: Fact


@dataclass(frozen=True)
class Held:
    """A claim where it is known, or where it has to hold."""

    claim: Claim
    term: Any


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
        self.page: list[Any] = []
        self.known: list[Held] = []
        self.duties: list[Held] = []
        self.visits: dict[int, list[Visit]] = {}

    def after_init(self) -> dict[str, Any]:
        """Return what variables are before the first step: 0 or false, and what `init` sets."""
        zero = {"real": 0.0, "truth": False}
        values = {name: self.terms.value(zero.get(kind, 0)) for name, kind in self.kinds.items()}
        values |= {c.name: self._any(c.name) for c in self.program.constants} | self.fixed
        self._block(self.program.blocks["init"], values, self.terms.value(True))
        return values

    def holds_at(self, values: Mapping[str, Any], fact: Fact) -> bool:
        """Prove a fact of some values."""
        return self._is_never([self.z3.Not(self._term(fact, values))])

    def step(self, facts: Sequence[Fact]) -> None:
        """Follow one step from anywhere that some facts allow; its conditions are noted, what is
        known where a step or a turn begins, and what has to hold where they end.
        """
        self.visits, self.known, self.duties = {}, [], []
        values = {name: self._any(name) for name in self.kinds} | self.fixed
        always = self.terms.value(True)
        tunable = [c for c in self.program.constants if c.kind == "tunable" and not c.items]
        self.page = [self._inside(values[c.name], c.range) for c in tunable if c.range]
        claims = [Claim(0, fact) for fact in facts]
        self.known += [Held(claim, self._term(claim.fact, values)) for claim in claims]
        self._block(self.program.blocks["step"], values, always)
        self.duties += [Held(claim, self._term(claim.fact, values)) for claim in claims]

    def lost(self, claims: Collection[Claim]) -> frozenset[Claim]:
        """Return those of some claims that are not proven where all of them are known."""
        known = [held.term for held in self.known if held.claim in claims]
        left = [duty for duty in self.duties if duty.claim in claims]
        found = set[Claim]()
        while left:
            z3, terms = self.z3, [duty.term for duty in left]
            solver = self._solver([z3.Not(z3.And(*terms)), *known, *self.page])
            told = solver.check()
            if told == z3.unsat:
                break
            if told == z3.sat:
                model = solver.model()
                is_held = [z3.is_true(model.eval(term, model_completion=True)) for term in terms]
            else:
                is_held = [self._is_never([z3.Not(term), *known, *self.page]) for term in terms]
            gone = {duty.claim for duty, held in zip(left, is_held, strict=True) if not held}
            if told != z3.sat or not gone:
                return frozenset(found | gone)
            found |= gone
            left = [duty for duty in left if duty.claim not in gone]
        return frozenset(found)

    def excludes(self, visit: Visit, outcome: bool, claims: Collection[Claim]) -> bool:
        """Prove that a condition never has an outcome where it is come by."""
        condition = visit.condition if outcome else self.z3.Not(visit.condition)
        known = [held.term for held in self.known if held.claim in claims]
        return self._is_never([condition, visit.path, *known, *self.page])

    def _inside(self, value: Any, ends: Range) -> Any:
        if self.z3.is_fp(value):
            return self.terms.within(value, ends)
        return self.z3.And(value >= int(ends[0]), value <= int(ends[1]))

    def _term(self, fact: Fact, values: Mapping[str, Any]) -> Any:
        z3 = self.z3
        match fact:
            case Within(name, limits, where):
                within = self.terms.within(values[name], limits)
                return z3.Implies(values[where[0]] == where[1], within) if where else within
            case AtMost(name, others, factor, more, going):
                most = factor * sum(values[other] for other in others) + more
                if going is not None:
                    most = most + z3.If(self._expr(going, dict(values), None), 0, 1)
                return values[name] <= most
            case Same(name, _, comparison):
                return values[name] == self._expr(comparison, dict(values), None)

    def _solver(self, facts: list[Any]) -> Any:
        solver = self.z3.Solver()
        solver.set("rlimit", EFFORT)
        solver.add(*facts, *self.terms.lemmas(facts))
        return solver

    def _is_never(self, facts: list[Any]) -> bool:
        return bool(self._solver(facts).check() == self.z3.unsat)

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
            case Loop():
                self._loop(op, values, path)
            case Count():
                self._count(op, values, path)
            case FaultBit():
                values["memory.faults"] = self._any("memory.faults")
            case Run(name):
                self._block(self.program.blocks[name], values, path)

    def _count(self, op: Count, values: dict[str, Any], path: Any) -> None:
        z3, now = self.z3, values[op.timer]
        test = self._decided(op.condition, values, path)
        counts = self._visited(id(op), now < op.limit, self._and(path, test))
        values[op.timer] = z3.If(test, z3.If(counts, now + 1, now), 0)

    def _merge(
        self, test: Any, then: Block, other: Block, values: dict[str, Any], path: Any
    ) -> None:
        z3 = self.z3
        one, two = dict(values), dict(values)
        self._block(then, one, self._and(path, test))
        self._block(other, two, self._and(path, z3.Not(test)))
        for name in one | two:
            a, b = one.get(name), two.get(name)
            if a is None or b is None:
                values[name] = self._any(name)
            elif a is not b:
                values[name] = z3.If(test, a, b)

    def _loop(self, loop: Loop, values: dict[str, Any], path: Any) -> None:
        """A turn begins with any values of what the loop sets that its facts allow, and the loop
        ends with such values, too.
        """
        z3, body = self.z3, loop.body
        names = {loop.index, *block_writes(body)}
        for run in runs_of(self.program, body):
            names |= set(block_writes(self.program.blocks[run]))
        claims = [Claim(id(loop), fact) for fact in in_loop(self.program, loop)]
        claims = [claim for claim in claims if claim.fact.names <= {*values, *names}]
        values[loop.index] = z3.IntVal(0)
        self._owe(claims, values, path)
        for name in sorted(names):
            values[name] = self.terms.new("whole", name) if name == loop.index else self._any(name)
        turn = values[loop.index]
        self._know(claims, values, z3.And(path, turn >= 0, turn <= loop.count))
        self._visited(id(loop), turn < loop.count, z3.And(path, turn >= 0, turn <= loop.count))
        inside = z3.And(path, turn >= 0, turn < loop.count)
        at_end = dict(values)
        self._block(body, at_end, inside)
        at_end[loop.index] = turn + 1
        going = going_on(loop.index, body)[0]
        more = inside if going is None else z3.And(inside, self._expr(going, dict(values), None))
        self._owe(claims, at_end, more)
        for name in sorted(names):
            values[name] = self._any(name)
        values[loop.index] = self.terms.new("whole", loop.index)
        self._know(claims, values, path)

    def _know(self, claims: Sequence[Claim], values: Mapping[str, Any], path: Any) -> None:
        for claim in claims:
            known = self.z3.Implies(path, self._term(claim.fact, values))
            self.known.append(Held(claim, known))

    def _owe(self, claims: Sequence[Claim], values: Mapping[str, Any], path: Any) -> None:
        for claim in claims:
            owed = self.z3.Implies(path, self._term(claim.fact, values))
            self.duties.append(Held(claim, owed))

    # ---- expressions -----------------------------------------------------------------------

    def _decided(self, condition: Expr, values: dict[str, Any], path: Any) -> Any:
        """Return a decision; note each condition of it, where it is evaluated (C evaluates no more
        than it needs).
        """
        z3 = self.z3
        match condition:
            case Binary("and", left, right):
                test = self._decided(left, values, path)
                return z3.And(test, self._decided(right, values, self._and(path, test)))
            case Binary("or", left, right):
                test = self._decided(left, values, path)
                return z3.Or(test, self._decided(right, values, self._and(path, z3.Not(test))))
            case Unary("not", Binary() as operand):
                return z3.Not(self._decided(operand, values, path))
        return self._visited(id(condition), self._expr(condition, values, path), path)

    def _and(self, path: Any, test: Any) -> Any:
        """Return where a path goes on; none where a fact is looked at."""
        return None if path is None else self.z3.And(path, test)

    def _visited(self, number: int, condition: Any, path: Any) -> Any:
        if path is not None:
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
                one = self._expr(then, values, self._and(path, test))
                return z3.If(test, one, self._expr(other, values, self._and(path, z3.Not(test))))
            case Call(function, arguments):
                return terms.call(function, [self._expr(a, values, path) for a in arguments])
