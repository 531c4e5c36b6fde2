"""Way: one way through the blocks of a Program, with what is known on it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass

from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Expr,
    FaultBit,
    Loop,
    Op,
    Ref,
    RunBlock,
    Select,
    Switch,
    Unary,
    Value,
)
from language.ir.program import Program, Variable
from language.ir.rewrite_ops import map_expressions, map_operands, operands
from language.ir.traversal import block_reads, block_writes, expr_names, negate_condition
from language.numerics.evaluate import evaluate

WORK, TIME_LEFT, CROSSED = "work.", "work.left", "work.crossed"
EVALUATION_BLOCKS, POINT_STATE_PREFIX = ("rates_", "guards_"), "work.at_"
"""Blocks that look at a point of the step, and how the states there are called."""


@dataclass(frozen=True)
class PathValue:
    """One value of a `variable` of the Program, at a point of the step."""

    variable: Variable
    point: int


class NotSpecialisable(Exception):
    """What happens hangs on more than the guards of the mode."""


class ExecutionPath:
    """A way without a crossing: `known` are the values of variables, `ops` what is done on it.

    What comes before the guards is in `first`; `quiet` is whether none of these changed. In `made`
    are the variables of its own: each is one value of a variable of the Program, at a `point` of
    the step; rates and guards are looked at in each of these, from 1 to `points`.
    """

    def __init__(self, program: Program, known: dict[str, Expr]) -> None:
        self.program = program
        self.known = known
        self.values: dict[str, PathValue] = {}
        self.points = 1
        self.is_event_free: Expr = Value(True)
        self.prologue: list[Op] = []
        self.ops = self.prologue
        self._variable_by_name = {variable.name: variable for variable in program.variables}
        self._versions: Counter[str] = Counter()
        self._value_numbers: dict[Hashable, int] = {}
        self._number_by_name: dict[str, int | None] = {}
        self._name_by_number: dict[int, str] = {}
        self._has_evaluated = False

    @property
    def is_unconditional(self) -> bool:
        """Tell whether there are no guards."""
        return self.is_event_free == Value(True)

    def reuse_equations(self, equations: Block, constant_groups: tuple[str, ...]) -> None:
        """Keep what equations were when the step before ended, if all that they read `constant_groups` until
        this one begins: a page may turn between them.
        """
        reused = set[str]()
        for op in equations:
            if isinstance(op, Assign):
                value = self._fold_constants(op.value)
                if all(
                    n in reused or n.startswith((*constant_groups, "call "))
                    for n in expr_names(value)
                ):
                    reused.add(op.target)
                    self._number_by_name[op.target] = number = self._value_number(value)
                    if number is not None and not op.target.startswith(WORK):
                        self._name_by_number.setdefault(number, op.target)

    def follow(self, block: Block) -> None:
        """Follow the operations of a block. Raises NotPlain."""
        for op in block:
            match op:
                case Assign(target, value, key):
                    self._assign(target, self._resolve(value), key)
                case Branch(condition, then, other):
                    self._branch(self._resolve(condition), then, other)
                case Switch(selector, cases):
                    number = self._resolve(Ref(selector))
                    if not isinstance(number, Value):
                        raise NotSpecialisable
                    self.follow(dict(cases).get(int(number.value), ()))
                case Loop(count, _, body):
                    self._loop(count, body)
                case RunBlock(name):
                    self.follow(self.program.blocks[name])
                    self._has_evaluated = self._has_evaluated or name.startswith(EVALUATION_BLOCKS)
                case _:
                    raise NotSpecialisable

    def follow_step_end(self) -> None:
        """Follow the end of a step: equations, unless what happened settles first."""
        event, begin = self._resolve(Ref("work.event")), len(self.ops)
        try:
            self.follow(self.program.blocks["equations"])
        except NotSpecialisable:
            self.ops[begin:] = [RunBlock("equations")]
        if event != Value(False):
            now = tuple(self.ops[begin:])
            self.ops[begin:] = [Branch(event, (RunBlock("settle"), RunBlock("equations")), now)]

    def _assign(self, target: str, value: Expr, key: str) -> None:
        if self._has_evaluated and target.startswith(POINT_STATE_PREFIX):
            self._has_evaluated = False
            self.points += 1
        if target == CROSSED:
            self.is_event_free = Value(True) if value == Value(False) else negate_condition(value)
            value = Value(False)
            self.ops = []
        number = self._value_number(value)
        if number in self._name_by_number and not isinstance(value, Value | Ref):
            value = Ref(self._name_by_number[number])
        self._versions[target] += 1
        if target.startswith(WORK) and not isinstance(value, Value | Ref):
            name = f"{target}_{self._versions[target]}"
            self.values[name] = PathValue(self._variable_by_name[target], self.points)
            self.ops.append(Assign(name, value, key))
            self._record_name(name, number)
            value = Ref(name)
        elif not target.startswith(WORK):
            if value != Ref(target):
                self.ops.append(Assign(target, value, key))
            self._invalidate(target)
            self._record_name(target, number)
        if isinstance(value, Value | Ref):
            self.known[target] = value

    def _branch(self, condition: Expr, then: Block, other: Block) -> None:
        """Follow the branch that is taken; where that is not known both have to do the same, or set
        what stays when the step ends.
        """
        if isinstance(condition, Value):
            return self.follow(then if condition.value else other)
        if _writes_only_persistent(then) and _writes_only_persistent(other):
            arms = (map_expressions(arm, self._resolve) for arm in (then, other))
            self.ops.append(Branch(condition, *arms))
            for name in block_writes((*then, *other)):
                self._invalidate(name)
            return None
        before, ops, count = dict(self.known), self.ops, len(self.ops)
        self.follow(then)
        one, self.known = self.known, before
        self.follow(other)
        if self.known != one or self.ops is not ops or len(ops) != count:
            raise NotSpecialisable

    def _loop(self, count: int, body: Block) -> None:
        """Follow each turn of a loop until one does nothing, and so all after it."""
        for _ in range(count):
            before, done = dict(self.known), len(self.ops)
            self.follow(body)
            if self.known == before and len(self.ops) == done:
                return
        raise NotSpecialisable

    def _resolve(self, expr: Expr) -> Expr:
        """Return an expression of what is known. Raises NotPlain for a value that is not."""
        if isinstance(expr, Ref):
            if expr.name not in self.known and expr.name.startswith(WORK):
                raise NotSpecialisable
            return self.known.get(expr.name, expr)
        return _simplify(map_operands(expr, self._resolve), self.program)

    def _fold_constants(self, expr: Expr) -> Expr:
        """Return an expression with the numbers that are known."""
        if isinstance(expr, Ref):
            known = self.known.get(expr.name)
            return known if isinstance(known, Value) else expr
        return _simplify(map_operands(expr, self._fold_constants), self.program)

    def _invalidate(self, name: str) -> None:
        """A variable is another value from here."""
        self._versions[name] += 1
        self._number_by_name.pop(name, None)
        self._name_by_number = {
            number: held for number, held in self._name_by_number.items() if held != name
        }
        self.known.pop(name, None)
        known = self.known.items()
        for other in [n for n, held in known if isinstance(held, Ref) and held.name == name]:
            del self.known[other]

    def _record_name(self, name: str, number: int | None) -> None:
        self._number_by_name[name] = number
        if number is not None:
            self._name_by_number.setdefault(number, name)

    def _value_number(self, value: Expr) -> int | None:
        """Return the number of a value; equal operations on equal numbers have equal ones, as in
        language/passes/common_subexpressions.py, and a name has that of its value.
        """
        key: Hashable = None
        match value:
            case Value(known):
                key = repr(known)
            case Ref(name) if name in self._number_by_name:
                return self._number_by_name[name]
            case Ref(name):
                key = name, self._versions[name]
            case Binary(operator, left, right) | Compare(operator, left, right):
                key = operator, self._value_number(left), self._value_number(right)
            case Unary(operator, operand):
                key = operator, self._value_number(operand)
            case Call(function, arguments):
                key = function, *(self._value_number(argument) for argument in arguments)
        if key is None or (isinstance(key, tuple) and None in key):
            return None
        return self._value_numbers.setdefault(key, len(self._value_numbers))


def _writes_only_persistent(block: Block) -> bool:
    """Tell whether all that a block does is to set what stays when the step ends, from other
    values.
    """
    writes = set(block_writes(block))
    is_plain = all(isinstance(op, Assign | FaultBit) for op in block)
    return is_plain and not any(n.startswith(WORK) or n in set(block_reads(block)) for n in writes)


def _simplify(expr: Expr, program: Program) -> Expr:
    """Return an expression whose parts are simple as a simple one."""
    match expr:
        case Select(Value(condition), then, other):
            return then if condition else other
        case Binary("and", Value(known), rest) | Binary("and", rest, Value(known)):
            return rest if known else Value(False)
        case Binary("or", Value(known), rest) | Binary("or", rest, Value(known)):
            return Value(True) if known else rest
    inner = operands(expr)
    if inner and all(isinstance(part, Value) for part in inner):
        return Value(evaluate(expr, {}, program.number_type))
    return expr
