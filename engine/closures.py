"""Closures: the blocks of a Program as Python functions over one frame of values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from engine import actions, shapes
from engine.actions import Action
from engine.arithmetic import ARITHMETIC
from engine.frame import LEFT_RANGE, Scope, scope_of
from engine.shapes import Frame, Read
from language.evaluate import OPERATIONS
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
from language.program import Function, Program
from language.traversal import expr_names, with_value

AT_ONCE = 4
"""Most assignments in one function (engine/actions.py)."""
UNROLLED = 8
"""Loops of at most so many turns have a copy of their body for each: indices become constants."""


class _Inner(NamedTuple):
    """An operation inside another: both operators, and its slots."""

    shape: tuple[str, str]
    slots: tuple[int, int]


class Compiler:
    """From operations to closures; constant parts are evaluated once, with the same operations."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.faults = {name: 1 << bit for bit, name in enumerate(program.faults)}
        self.arithmetic = ARITHMETIC[program.number]
        value = self.arithmetic.value
        self.scope = scope_of(program)
        fixed = ("constant.", "solved.")
        scalars = [c for c in program.constants if c.name.startswith(fixed) and not c.items]
        self.fixed = {c.name: value(c.value) for c in scalars}
        self.functions: dict[str, Callable[..., Any]] = {}
        for function in sorted(program.functions, key=lambda f: _depth(f, program.functions)):
            self.functions[function.name] = self._function(function)
        reals = [v.name for v in program.variables if v.type == "real"]
        reals += [c.name for c in program.constants if c.type == "real"]
        self.reals = frozenset(reals)
        self._done: dict[str, Action] = {}
        self.blocks = {name: self._named(name) for name in program.blocks}

    def _function(self, function: Function) -> Callable[..., Any]:
        """Return a function of Python: its frame is its arguments, then its own variables."""
        names = _locals(function)
        outer = self.scope
        self.scope = Scope({name: slot for slot, name in enumerate(names)}, [None] * len(names))
        act = self._block(function.body)
        y, count = self.scope.slots["work.y"], len(function.parameters)
        rest = self.scope.values[count:]
        self.scope = outer

        def call(*values: Any) -> Any:
            frame: Frame = [*values, *rest]
            act(frame)
            return frame[y]

        return call

    def _named(self, name: str) -> Action:
        if name not in self._done:
            self._done[name] = self._block(self.program.blocks[name])
        return self._done[name]

    def _block(self, block: Block) -> Action:
        found: list[Action] = []
        row: list[Assign] = []
        for op in block:
            if row and not (isinstance(op, Assign) and self._go_on(row, op)):
                found.append(self._row(row))
                row = []
            if isinstance(op, Assign):
                row.append(op)
            else:
                found.append(self._action(op))
        return actions.in_turn([*found, *([self._row(row)] if row else [])])

    def _go_on(self, row: Sequence[Assign], op: Assign) -> bool:
        """Tell whether an assignment is done in one function with those before it."""
        alike = (self._slot(row[-1].value) is None) == (self._slot(op.value) is None)
        return alike and len(row) < AT_ONCE

    def _row(self, row: Sequence[Assign]) -> Action:
        targets = [self.scope.slots[op.target] for op in row]
        sources = [self._slot(op.value) for op in row]
        if None not in sources:
            return actions.copy(targets, [slot for slot in sources if slot is not None])
        return actions.assign(targets, [self._read(op.value) for op in row])

    def _action(self, op: Op) -> Action:
        slots = self.scope.slots
        match op:
            case Assign():
                return self._row([op])
            case Store(array, index, value):
                return actions.store(slots[array], self._read(index), self._read(value))
            case Branch(condition, then, other):
                two = self._block(then), self._block(other)
                return actions.branch(self._read(condition), *two)
            case Choose(selector, cases):
                table = {number: self._block(block) for number, block in cases}
                return actions.choose(slots[selector], table)
            case Loop(count, index, body) if count <= UNROLLED and _is_indexed(body):
                turns = [with_value(body, index, k) for k in range(count)]
                last = Assign(index, Value(count - 1))
                return self._block((*(op for turn in turns for op in turn), last))
            case Loop(count, index, (Branch(condition, then, ()),)) if index not in expr_names(
                condition
            ):
                more = self._read(condition)
                return actions.loop_while(count, slots[index], more, self._block(then))
            case Loop(count, index, body):
                return actions.loop(count, slots[index], self._block(body))
            case Count(timer, condition, limit, _):
                return actions.count(slots[timer], self._read(condition), limit)
            case FaultBit(fault, signal, is_set):
                slot, bit = slots["memory.faults"], self.faults[fault]
                left = slots[LEFT_RANGE]
                return (
                    actions.fault(slot, bit, signal, left) if is_set else actions.clear(slot, bit)
                )
            case Run(name):
                return self._named(name)

    def _slot(self, expr: Expr) -> int | None:
        """Return the slot of an operand that is read without a function of its own."""
        return self._place(expr)

    def _place(self, expr: Expr) -> int | None:
        """Return where a value stands that needs no operation."""
        if isinstance(expr, Ref) and expr.name in self.scope.slots:
            return self.scope.slots[expr.name]
        if _is_fixed(expr, self.fixed):
            return self.scope.literal(self._fold(expr))
        return None

    def _read(self, expr: Expr) -> Read:
        place = self._place(expr)
        if place is not None:
            return shapes.of_slot(place)
        match expr:
            case Item(name, index) if _is_fixed(index, {}):
                return shapes.of_element(self.scope.slots[name], self._fold(index))
            case Item(name, index):
                return shapes.of_item(self.scope.slots[name], self._read(index))
            case Unary("-", operand):
                return shapes.negative(self._read(operand))
            case Unary(_, operand):
                return shapes.opposite(self._read(operand))
            case Binary("and", Compare(">=", a, low), Compare("<=", b, high)):
                return self._range(a, low, b, high) or self._pair("and", expr.left, expr.right)
            case Binary(operator, left, right) | Compare(operator, left, right):
                return self._pair(operator, left, right)
            case Select(condition, then, other):
                parts = [self._read(part) for part in (condition, then, other)]
                return shapes.selected(*parts)
            case Call(function, arguments):
                known = self.functions.get(function) or self.arithmetic.elementary[function]
                return shapes.called(known, [self._read(argument) for argument in arguments])
            case _:
                raise TypeError(f"not an expression: {expr!r}")

    def _range(self, *parts: Expr) -> Read | None:
        slots = [self._slot(part) for part in parts]
        found = [slot for slot in slots if slot is not None]
        return shapes.within(*found) if len(found) == len(slots) else None

    def _pair(self, operator: str, left: Expr, right: Expr) -> Read:
        """Return the function of two operands; an inner operation of two slots is part of it."""
        a, b = self._slot(left), self._slot(right)
        if a is not None and b is not None:
            return shapes.SLOTS[operator](a, b)
        if b is not None:
            if inner := self._slots(operator, left):
                return shapes.LEFT[inner.shape](*inner.slots, b)
            return shapes.READ_SLOT[operator](self._read(left), b)
        inner = self._slots(operator, right)
        if a is not None:
            if inner:
                return shapes.RIGHT[inner.shape](a, *inner.slots)
            return shapes.SLOT_READ[operator](a, self._read(right))
        if inner:
            return shapes.READ_PAIR[inner.shape](self._read(left), *inner.slots)
        return shapes.READS[operator](self._read(left), self._read(right))

    def _slots(self, outer: str, expr: Expr) -> _Inner | None:
        """Return the operation of two slots that an operand is, if there is a shape for it."""
        if not isinstance(expr, Binary) or (outer, expr.operator) not in shapes.LEFT:
            return None
        a, b = self._slot(expr.left), self._slot(expr.right)
        if a is None or b is None:
            return None
        return _Inner((outer, expr.operator), (a, b))

    def _fold(self, expr: Expr) -> Any:
        match expr:
            case Value(value):
                return self.arithmetic.value(value)
            case Ref(name):
                return self.fixed[name]
            case Unary("-", operand):
                return -self._fold(operand)
            case Binary("/", left, right):
                return self.arithmetic.divide(self._fold(left), self._fold(right))
            case Binary(operator, left, right):
                return OPERATIONS[operator](self._fold(left), self._fold(right))
            case _:
                raise TypeError(f"not foldable: {expr!r}")


def _is_fixed(expr: Expr, fixed: Mapping[str, float]) -> bool:
    match expr:
        case Value():
            return True
        case Ref(name):
            return name in fixed
        case Unary("-", operand):
            return _is_fixed(operand, fixed)
        case Binary(_, left, right):
            return _is_fixed(left, fixed) and _is_fixed(right, fixed)
        case _:
            return False


def _is_indexed(body: Block) -> bool:
    """Tell whether a loop reads or sets elements, and nothing in it has a body of its own."""
    return all(isinstance(op, Assign | Store) for op in body) and "Item(" in repr(body)


def _locals(function: Function) -> list[str]:
    targets = [op.target for op in function.body if isinstance(op, Assign)]
    parameters = [f"work.{name}" for name in function.parameters]
    return list(dict.fromkeys([*parameters, "work.y", *targets]))


def _depth(function: Function, functions: tuple[Function, ...]) -> int:
    """How many functions a function calls, directly or through others: callees come first."""
    text = repr(function.body)
    called = [f for f in functions if f is not function and f"function='{f.name}'" in text]
    return sum(1 + _depth(f, functions) for f in called)
