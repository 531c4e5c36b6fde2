"""Symbolic execution: the paths of a sampled Program between cutpoints as terms of z3.

The effects of loops inside branches, and results of operations (`float_terms.py`), are
over-approximated. An outcome that is impossible in this model is therefore impossible in the
Program.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from codegen.emit.c_statement import split_loop_guard
from codegen.proofs.infeasible.cutpoints import (
    ConditionVisit,
    Cutpoint,
    CutpointState,
    ExecutionPath,
    blocks_of,
    items_of,
    loop_cut,
    step_cut,
)
from codegen.proofs.infeasible.float_terms import Terms
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Count,
    Expr,
    FaultBit,
    Item,
    Loop,
    Op,
    Ref,
    RunBlock,
    Select,
    Store,
    Switch,
    Unary,
    Value,
)
from language.ir.program import Program
from language.ir.traversal import block_writes

KINDS = ("real", "whole")
"""Kinds of the elements of an array."""


class SymbolicProgram:
    """The symbolic paths of a Program between cutpoints, and the visits of its conditions.

    Each of the `cuts` has the numbers and truth values with which its loop begins. `said` memoises
    the terms of facts at a cutpoint.
    """

    def __init__(self, program: Program) -> None:
        self.program = program
        self.terms = Terms(program.number_type)
        self.z3 = self.terms.z3
        self.kinds = program.types()
        self.items = items_of(program)
        self.kinds |= {name: "whole" for of in self.items.values() for name in of}
        fixed = (c for c in program.constants if c.kind == "fixed")
        self.fixed = {c.name: self.terms.value(c.value) for c in fixed}
        self.tables = {c.name: c.items for c in program.constants if c.kind == "fixed" and c.items}
        self.always = self.terms.value(True)
        self.cuts: dict[Cutpoint, dict[str, int]] = {}
        self.ways: list[ExecutionPath] = []
        self.visits: dict[int, list[ConditionVisit]] = {}
        self.said: dict[tuple[int, object], tuple[Any, CutpointState]] = {}
        self.begin: CutpointState | None = None
        self.given: tuple[Any, ...] = ()
        self._go()

    def _go(self) -> None:
        """Go all ways: to the first step, and from one to the next."""
        cut = step_cut(self.program)
        self.cuts[cut] = {}
        self._end(cut, self._after_init())
        self.visits = {}
        self.begin = CutpointState(cut, {name: self._any(name) for name in self.kinds} | self.fixed)
        values = dict(self.begin.values)
        self.given = self._page(values)
        self._block(self.program.blocks["step"], values, self.always)
        self._end(cut, values)

    def _after_init(self) -> dict[str, Any]:
        """Return what variables are before the first step: 0 or false, and what `init` sets."""
        zero = {"real": 0.0, "truth": False}
        values = {name: self.terms.value(zero.get(kind, 0)) for name, kind in self.kinds.items()}
        values |= {c.name: self._any(c.name) for c in self.program.constants} | self.fixed
        self._block(self.program.blocks["init"], values, self.always)
        return values

    def _end(self, cut: Cutpoint, values: Mapping[str, Any]) -> None:
        self.ways.append(ExecutionPath(self.begin, self.given, CutpointState(cut, dict(values))))

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
                where, stored = (self._expr(one, values, path) for one in (index, value))
                values[array] = self._any(array)
                for k, item in enumerate(self.items.get(array, ())):
                    values[item] = self.z3.If(where == k, stored, values[item])
            case Branch(condition, then, other):
                test = self._decided(condition, values, path)
                self._merge(test, then, other, values, path)
            case Switch(selector, cases):
                self._choose(values[selector], cases, values, path)
            case Loop() if path is self.always:
                self._cut(op, values)
            case Loop(_, index, body):
                self._left_open(index, body, values, path)
            case Count():
                self._count(op, values, path)
            case FaultBit():
                values["memory.faults"] = self._any("memory.faults")
            case RunBlock(name):
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
        one = dict(values)
        self._block(then, one, z3.And(path, test))
        self._block(other, values, z3.And(path, z3.Not(test)))
        self._join(test, one, values)

    def _join(self, test: Any, one: dict[str, Any], values: dict[str, Any]) -> None:
        """Some values are those of one way where a test is true."""
        for name in one | values:
            a, b = one.get(name), values.get(name)
            if a is None or b is None:
                values[name] = self._any(name)
            elif a is not b:
                values[name] = self.terms.choose(test, a, b)

    def _choose(
        self,
        which: Any,
        cases: Sequence[tuple[int, Block]],
        values: dict[str, Any],
        path: Any,
    ) -> None:
        """Each case begins with what there was before the choice, for only one is taken."""
        before = dict(values)
        for number, case in cases:
            test, one = which == number, dict(before)
            self._block(case, one, self.z3.And(path, test))
            self._join(test, one, values)

    def _cut(self, loop: Loop, values: dict[str, Any]) -> None:
        """A loop that every step comes by: ways lead into it, through a turn of it, and on."""
        index, limit, going = loop.index, loop.count, split_loop_guard(loop.index, loop.body)[0]
        self.kinds[index] = "whole"
        cut = loop_cut(self.program, loop, len(self.cuts))
        values[index] = self.z3.IntVal(0)
        for name in cut.names:
            values.setdefault(name, self._any(name))
        known = {name: self.terms.number_of(values[name]) for name in cut.names}
        self.cuts[cut] = {name: number for name, number in known.items() if number is not None}
        self._end(cut, values)
        turn = self._begun(cut, values)
        self._visited(id(loop), turn[index] < limit, self.always)
        self.given += (turn[index] < limit,)
        goes = self.always if going is None else self._unseen(going, values)
        after = dict(values)
        self._block(loop.body, after, self.always)
        after[index] = turn[index] + 1
        self.given += (goes,)
        self._end(cut, after)
        turn = self._begun(cut, values)
        goes = self.always if going is None else self._unseen(going, values)
        self.given += (self.z3.Not(self.z3.And(turn[index] < limit, goes)),)

    def _begun(self, cut: Cutpoint, values: dict[str, Any]) -> Mapping[str, Any]:
        """Begin at a cut: nothing is known of values but what its facts say."""
        for name in values:
            if name not in self.fixed:
                values[name] = self._any(name)
        self.begin, self.given = CutpointState(cut, dict(values)), self._page(values)
        return self.begin.values

    def _page(self, values: Mapping[str, Any]) -> tuple[Any, ...]:
        """Return that what a page holds is within its ranges."""
        tunable = [c for c in self.program.constants if c.kind == "tunable" and not c.items]
        return tuple(self.terms.within(values[c.name], c.range) for c in tunable if c.range)

    def _unseen(self, condition: Expr, values: Mapping[str, Any]) -> Any:
        """Return a condition that is not come by here."""
        visits, self.visits = self.visits, {}
        found = self._expr(condition, dict(values), self.always)
        self.visits = visits
        return found

    def _left_open(self, index: str, body: Block, values: dict[str, Any], path: Any) -> None:
        """Any turn of a loop begins with any values of what the loop sets, and so ends all."""
        names = {index}
        for block in blocks_of(self.program, body):
            names |= set(block_writes(block))
        names |= {item for array in names & set(self.items) for item in self.items[array]}
        for name in sorted(names):
            values[name] = self.terms.new("whole", name) if name == index else self._any(name)
        self._block(body, dict(values), self.z3.And(path, self.always))
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
        given = (*self.given, path)
        self.visits.setdefault(number, []).append(ConditionVisit(self.begin, given, condition))
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
            case Item(name, index, whole):
                where, found = self._expr(index, values, path), terms.new(KINDS[whole], "item")
                for k, item in enumerate(self.items.get(name, ())):
                    found = z3.If(where == k, values[item], found)
                return found
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
                two = self._expr(other, values, z3.And(path, z3.Not(test)))
                return terms.choose(test, one, two)
            case Call("lookup", (_, Value(int(size)), Ref(name), x)) if name in self.tables:
                points = self.tables[name][:size]
                return terms.looked_up(points, self._expr(x, values, path))
            case Call(function, arguments):
                return terms.call(function, [self._expr(a, values, path) for a in arguments])
