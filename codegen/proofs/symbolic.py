"""Symbolic: one step of a sampled Program over values that are not known, for z3.

Reals are floating-point numbers: comparisons, signs, abs, min, max and clip are IEEE 754's, NaN
included. What + - * / and functions give is left open (any function, the same for the same
operands), and so is what loops leave: more than happens, so what is never true of it never is.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

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
from language.traversal import block_writes, reached, walk

EFFORT = 20_000_000
"""Units of z3's own count for one question: some seconds, and the same answer on every machine."""
Range = tuple[float, float]
Limits = Range | frozenset[int]
"""Ends of a real, or the values of a whole number."""
Fact = tuple[str, Limits]


@dataclass(frozen=True)
class Visit:
    """A condition where a step comes by it, and what holds there."""

    condition: Any
    path: Any


class World:
    """Values of a Program in z3, and one step of it."""

    def __init__(self, program: Program) -> None:
        import z3

        self.z3 = z3
        self.program = program
        self.kinds = {v.name: v.type for v in (*program.variables, *program.inputs)}
        self.kinds |= {c.name: c.type for c in program.constants}
        self.fixed = {c.name: c.value for c in program.constants if c.kind == "fixed"}
        digits = (11, 53) if program.number == "float64" else (8, 24)
        self.real = z3.FPSort(*digits)
        self.fresh = 0
        self.visits: dict[int, list[Visit]] = {}

    def proposed(self, ranges: Mapping[str, Range]) -> Iterator[Fact]:
        """Yield what may hold of variables between two steps."""
        yield from ranges.items()
        modes = {"memory.mode": self.program.modes, "memory.run_mode": self.program.run_modes}
        for name, infos in modes.items():
            if name in self.kinds and infos:
                yield name, frozenset(info.number for info in infos)
        for block in self.program.blocks.values():
            for op in walk(block):
                if isinstance(op, Count):
                    yield op.timer, frozenset(range(op.limit))
                    yield op.timer, frozenset(range(op.limit + 1))

    def after_init(self) -> dict[str, Any]:
        """Return what variables are before the first step: 0 or false, and what `init` sets."""
        values = {name: self._zero(kind) for name, kind in self.kinds.items()}
        values |= {name: self._value(value) for name, value in self.fixed.items()}
        self._block(self.program.blocks["init"], values, self.z3.BoolVal(True))
        return values

    def step(self) -> dict[str, Any]:
        """Return what variables are after one step from anywhere; its conditions are noted."""
        self.visits = {}
        values = {name: self._any(name) for name in self.kinds}
        values |= {name: self._value(value) for name, value in self.fixed.items()}
        self.start = dict(values)
        self._block(self.program.blocks["step"], values, self.z3.BoolVal(True))
        return values

    def holds(self, values: Mapping[str, Any], fact: Fact, before: Collection[Fact] = ()) -> bool:
        """Prove a fact of some values, where others held before the step."""
        name, limits = fact
        wrong = self.z3.Not(self._within(values[name], limits))
        return self._is_never([wrong, *self._all(before)])

    def excludes(self, visit: Visit, outcome: bool, before: Collection[Fact]) -> bool:
        """Prove that a condition never has an outcome where it is come by."""
        condition = visit.condition if outcome else self.z3.Not(visit.condition)
        return self._is_never([condition, visit.path, *self._all(before)])

    def _all(self, facts: Collection[Fact]) -> list[Any]:
        return [self._within(self.start[name], limits) for name, limits in facts]

    def _within(self, value: Any, limits: Limits) -> Any:
        z3 = self.z3
        if isinstance(limits, frozenset):
            return z3.Or(*(value == number for number in sorted(limits)))
        low, high = (self._value(float(end)) for end in limits)
        return z3.And(z3.fpLEQ(low, value), z3.fpLEQ(value, high))

    def _is_never(self, facts: list[Any]) -> bool:
        solver = self.z3.Solver()
        solver.set("rlimit", EFFORT)
        solver.add(*facts)
        return bool(solver.check() == self.z3.unsat)

    def _zero(self, kind: str) -> Any:
        return self._value({"real": 0.0, "truth": False}.get(kind, 0))

    def _value(self, value: float | int | bool) -> Any:
        if isinstance(value, bool):
            return self.z3.BoolVal(value)
        if isinstance(value, float):
            return self.z3.FPVal(value, self.real)
        return self.z3.IntVal(value)

    def _any(self, name: str) -> Any:
        return self._new(self.kinds.get(name, "real"), name)

    def _new(self, kind: str, name: str) -> Any:
        self.fresh += 1
        text = f"{name}!{self.fresh}"
        if kind == "truth":
            return self.z3.Bool(text)
        return self.z3.Const(text, self.real) if kind == "real" else self.z3.Int(text)

    # ---- operations ------------------------------------------------------------------------

    def _block(self, block: Block, values: dict[str, Any], path: Any) -> None:
        for op in block:
            self._op(op, values, path)

    def _op(self, op: Op, values: dict[str, Any], path: Any) -> None:
        z3 = self.z3
        match op:
            case Assign(target, value, _):
                values[target] = self._expr(value, values, path)
            case Store(array, index, value):
                self._expr(index, values, path)
                self._expr(value, values, path)
                values[array] = self._any(array)
            case Branch(condition, then, other):
                test = self._expr(condition, values, path)
                self._decided(condition, values, path)
                self._merge(test, then, other, values, path)
            case Choose(selector, cases):
                which, taken = values[selector], path
                for number, case in cases:
                    self._merge(which == number, case, (), values, taken)
            case Loop(_, index, body):
                self._loop(index, body, values, path)
            case Count(timer, condition, limit, _):
                test = self._expr(condition, values, path)
                self._decided(condition, values, path)
                counts = values[timer] < limit
                self._visit(id(op), counts, z3.And(path, test))
                counted = z3.If(counts, values[timer] + 1, values[timer])
                values[timer] = z3.If(test, counted, 0)
            case FaultBit():
                values["memory.faults"] = self._any("memory.faults")
            case Run(name):
                self._block(self.program.blocks[name], values, path)

    def _merge(
        self, test: Any, then: Block, other: Block, values: dict[str, Any], path: Any
    ) -> None:
        z3 = self.z3
        one, two = dict(values), dict(values)
        self._block(then, one, z3.And(path, test))
        self._block(other, two, z3.And(path, z3.Not(test)))
        for name in {*one, *two}:
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
        for name in names:
            values[name] = self._new("whole", name) if name == index else self._any(name)
        inside = dict(values)
        self._block(body, inside, path)
        for name in names:
            values[name] = self._any(name)

    def _decided(self, condition: Expr, values: dict[str, Any], path: Any) -> None:
        """Note each condition of a decision, where it is evaluated (C leaves out what is known)."""
        match condition:
            case Binary("and", left, right):
                self._decided(left, values, path)
                test = self._expr(left, values, path)
                self._decided(right, values, self.z3.And(path, test))
            case Binary("or", left, right):
                self._decided(left, values, path)
                test = self._expr(left, values, path)
                self._decided(right, values, self.z3.And(path, self.z3.Not(test)))
            case Unary("not", Binary() as operand):
                self._decided(operand, values, path)
            case _:
                self._visit(id(condition), self._expr(condition, values, path), path)

    def _visit(self, number: int, condition: Any, path: Any) -> None:
        self.visits.setdefault(number, []).append(Visit(condition, path))

    # ---- expressions -----------------------------------------------------------------------

    def _expr(self, expr: Expr, values: dict[str, Any], path: Any) -> Any:
        z3 = self.z3
        match expr:
            case Value(value):
                return self._value(value)
            case Ref(name):
                if name not in values:
                    values[name] = self._any(name)
                return values[name]
            case Item(_, _, whole):
                return self._new("whole" if whole else "real", "item")
            case Unary("-", operand):
                inner = self._expr(operand, values, path)
                return z3.fpNeg(inner) if z3.is_fp(inner) else -inner
            case Unary(_, operand):
                return z3.Not(self._expr(operand, values, path))
            case Binary(operator, left, right):
                pair = self._expr(left, values, path), self._expr(right, values, path)
                return self._binary(operator, *pair)
            case Compare(operator, left, right):
                pair = self._expr(left, values, path), self._expr(right, values, path)
                return self._compare(operator, *pair)
            case Select(condition, then, other):
                self._decided(condition, values, path)
                test = self._expr(condition, values, path)
                one = self._expr(then, values, z3.And(path, test))
                return z3.If(test, one, self._expr(other, values, z3.And(path, z3.Not(test))))
            case Call(function, arguments):
                given = [self._expr(argument, values, path) for argument in arguments]
                return self._call(function, given)

    def _binary(self, operator: str, left: Any, right: Any) -> Any:
        z3 = self.z3
        if operator in ("and", "or"):
            return (z3.And if operator == "and" else z3.Or)(left, right)
        if z3.is_fp(left):
            return z3.Function(f"real {operator}", self.real, self.real, self.real)(left, right)
        if operator == "/":
            return self._new("whole", "quotient")
        return {"+": left + right, "-": left - right, "*": left * right}[operator]

    def _compare(self, operator: str, left: Any, right: Any) -> Any:
        z3 = self.z3
        if z3.is_fp(left):
            of = {"<": z3.fpLT, "<=": z3.fpLEQ, ">": z3.fpGT, ">=": z3.fpGEQ, "==": z3.fpEQ}
            return z3.Not(z3.fpEQ(left, right)) if operator == "!=" else of[operator](left, right)
        if operator in ("==", "!="):
            return left == right if operator == "==" else left != right
        of = {"<": left < right, "<=": left <= right, ">": left > right, ">=": left >= right}
        return of[operator]

    def _call(self, function: str, given: list[Any]) -> Any:
        z3, first = self.z3, given[0]
        if not z3.is_fp(first):
            return self._new("real" if function == "real" else "whole", function)
        match function, given:
            case "abs", _:
                return z3.fpAbs(first)
            case "min", [a, b]:
                return z3.If(z3.fpLT(b, a), b, a)
            case "max", [a, b]:
                return z3.If(z3.fpGT(b, a), b, a)
            case "clip", [x, low, high]:
                return z3.If(z3.fpGT(x, low), z3.If(z3.fpLT(x, high), x, high), low)
            case "within", [x, low, high]:
                return z3.And(z3.fpLEQ(low, x), z3.fpLEQ(x, high))
            case "whole", _:
                return self._new("whole", function)
            case _:
                sorts = [one.sort() for one in given]
                return z3.Function(function, *sorts, self.real)(*given)
