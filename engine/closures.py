"""Closures: each operation of a Program as a Python function over one frame of values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from engine.arithmetic import ARITHMETIC
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

Frame = list[Any]
Read = Callable[[Frame], Any]
Action = Callable[[Frame], None]


class Compiler:
    """From operations to closures; constant parts are evaluated once, with the same operations."""

    def __init__(self, program: Program, slots: Mapping[str, int]) -> None:
        self.slots = slots
        self.faults = {name: 1 << bit for bit, name in enumerate(program.faults)}
        self.left: dict[str, None] = {}
        fixed = ("constant.", "solved.")
        self.arithmetic = ARITHMETIC[program.number]
        value = self.arithmetic.value
        scalars = [c for c in program.constants if c.name.startswith(fixed) and not c.items]
        self.fixed = {c.name: value(c.value) for c in scalars}
        self.functions: dict[str, Callable[..., Any]] = {}
        for function in sorted(program.functions, key=lambda f: _depth(f, program.functions)):
            self.functions[function.name] = self._function(function)
        self.blocks: dict[str, list[Action]] = {name: [] for name in program.blocks}
        for name, block in program.blocks.items():
            self.blocks[name].extend(self._action(op) for op in block)

    def _function(self, function: Function) -> Callable[..., Any]:
        slots = {name: slot for slot, name in enumerate(_locals(function))}
        outer, self.slots = self.slots, slots
        actions = [self._action(op) for op in function.body]
        self.slots = outer
        y, count = slots["work.y"], len(function.parameters)
        rest: Frame = [None] * (len(slots) - count)

        def call(*values: Any) -> Any:
            frame: Frame = [*values, *rest]
            for action in actions:
                action(frame)
            return frame[y]

        return call

    def _block(self, block: Block) -> list[Action]:
        return [self._action(op) for op in block]

    def _action(self, op: Op) -> Action:
        match op:
            case Assign(target, value, _):
                return _assign(self.slots[target], self._read(value))
            case Store(array, index, value):
                return _store(self.slots[array], self._read(index), self._read(value))
            case Branch(condition, then, other):
                return _branch(self._read(condition), self._block(then), self._block(other))
            case Choose(selector, cases):
                table = {number: self._block(block) for number, block in cases}
                return _choose(self.slots[selector], table)
            case Loop(count, index, body):
                return _loop(count, self.slots[index], self._block(body))
            case Count(timer, condition, limit, _):
                return _count(self.slots[timer], self._read(condition), limit)
            case FaultBit(fault, signal, True):
                slot, bit = self.slots["memory.faults"], self.faults[fault]
                return _fault(slot, bit, signal, self.left)
            case FaultBit(fault, _, _):
                return _clear(self.slots["memory.faults"], self.faults[fault])
            case Run(name):
                return _run(self.blocks[name])

    def _read(self, expr: Expr) -> Read:
        if _is_fixed(expr, self.fixed):
            return _constant(self._fold(expr))
        match expr:
            case Ref(name):
                return _slot(self.slots[name])
            case Item(name, index):
                return _item(self.slots[name], self._read(index))
            case Unary("-", operand):
                return _negative(self._read(operand))
            case Unary(_, operand):
                return _not(self._read(operand))
            case Binary("/", left, right):
                return _quotient(self.arithmetic.divide, self._read(left), self._read(right))
            case Binary(operator, left, right):
                return _BINARY[operator](self._read(left), self._read(right))
            case Compare(operator, left, right):
                return _BINARY[operator](self._read(left), self._read(right))
            case Select(condition, then, other):
                return _select(self._read(condition), self._read(then), self._read(other))
            case Call(function, arguments):
                known = self.functions.get(function) or self.arithmetic.elementary[function]
                return _call(known, [self._read(argument) for argument in arguments])
            case _:
                raise TypeError(f"not an expression: {expr!r}")

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


def _locals(function: Function) -> list[str]:
    targets = [op.target for op in function.body if isinstance(op, Assign)]
    parameters = [f"work.{name}" for name in function.parameters]
    return list(dict.fromkeys([*parameters, "work.y", *targets]))


def _depth(function: Function, functions: tuple[Function, ...]) -> int:
    """How many functions a function calls, directly or through others: callees come first."""
    text = repr(function.body)
    called = [f for f in functions if f is not function and f"function='{f.name}'" in text]
    return sum(1 + _depth(f, functions) for f in called)


def _constant(value: Any) -> Read:
    return lambda v: value


def _slot(slot: int) -> Read:
    return lambda v: v[slot]


def _item(slot: int, index: Read) -> Read:
    return lambda v: v[slot][index(v)]


def _negative(a: Read) -> Read:
    return lambda v: -a(v)


def _not(a: Read) -> Read:
    return lambda v: not a(v)


def _select(condition: Read, then: Read, other: Read) -> Read:
    return lambda v: then(v) if condition(v) else other(v)


def _call(function: Callable[..., Any], arguments: list[Read]) -> Read:
    if len(arguments) == 1:
        only = arguments[0]
        return lambda v: function(only(v))
    return lambda v: function(*[argument(v) for argument in arguments])


def _quotient(divide: Callable[[Any, Any], Any], a: Read, b: Read) -> Read:
    return lambda v: divide(a(v), b(v))


def _and(a: Read, b: Read) -> Read:
    return lambda v: a(v) & b(v)


def _or(a: Read, b: Read) -> Read:
    return lambda v: a(v) | b(v)


_BINARY: Mapping[str, Callable[[Read, Read], Read]] = {
    "+": lambda a, b: lambda v: a(v) + b(v),
    "-": lambda a, b: lambda v: a(v) - b(v),
    "*": lambda a, b: lambda v: a(v) * b(v),
    "and": _and,
    "or": _or,
    "<": lambda a, b: lambda v: a(v) < b(v),
    "<=": lambda a, b: lambda v: a(v) <= b(v),
    ">": lambda a, b: lambda v: a(v) > b(v),
    ">=": lambda a, b: lambda v: a(v) >= b(v),
    "==": lambda a, b: lambda v: a(v) == b(v),
    "!=": lambda a, b: lambda v: a(v) != b(v),
}


def _assign(slot: int, value: Read) -> Action:
    def act(v: Frame) -> None:
        v[slot] = value(v)

    return act


def _store(slot: int, index: Read, value: Read) -> Action:
    def act(v: Frame) -> None:
        v[slot][index(v)] = value(v)

    return act


def _branch(condition: Read, then: list[Action], other: list[Action]) -> Action:
    def act(v: Frame) -> None:
        for action in then if condition(v) else other:
            action(v)

    return act


def _choose(slot: int, table: Mapping[int, list[Action]]) -> Action:
    def act(v: Frame) -> None:
        for action in table.get(v[slot], ()):
            action(v)

    return act


def _loop(count: int, slot: int, body: list[Action]) -> Action:
    def act(v: Frame) -> None:
        for index in range(count):
            v[slot] = index
            for action in body:
                action(v)

    return act


def _count(slot: int, condition: Read, limit: int) -> Action:
    def act(v: Frame) -> None:
        v[slot] = min(v[slot] + 1, limit) if condition(v) else 0

    return act


def _fault(slot: int, bit: int, signal: str, left: dict[str, None]) -> Action:
    def act(v: Frame) -> None:
        v[slot] |= bit
        if signal:
            left[signal] = None

    return act


def _clear(slot: int, bit: int) -> Action:
    def act(v: Frame) -> None:
        v[slot] &= ~bit

    return act


def _run(block: list[Action]) -> Action:
    def act(v: Frame) -> None:
        for action in block:
            action(v)

    return act
