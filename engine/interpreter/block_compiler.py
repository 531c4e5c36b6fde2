"""Block compiler: compiles the blocks of a Program to Python closures over one frame.

Constant subexpressions are evaluated once, with the arithmetic of the number type.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from engine.interpreter import expression_closures, statement_closures
from engine.interpreter.expression_closures import ExpressionClosure, Frame
from engine.interpreter.number_arithmetic import ARITHMETIC_OF_TYPE
from engine.interpreter.statement_closures import StatementClosure
from engine.interpreter.value_frame import RANGE_VIOLATIONS, FrameLayout, frame_layout_of
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
from language.ir.program import Function, Program
from language.ir.rewrite_ops import substitute_variable
from language.ir.traversal import (
    called_functions,
    expr_names,
    subexpressions,
)
from language.numerics.evaluate import BINARY_OPERATIONS

FunctionMap = Mapping[str, Callable[..., Any]]
"""Elementary functions by name."""
MAX_FUSED_ASSIGNMENTS = 4
"""Largest number of assignments in one closure (engine/interpreter/statement_closures.py)."""
MAX_UNROLLED_TURNS = 8
"""Largest number of turns of a loop that is unrolled, so that its indices become constants."""


class _InnerOperation(NamedTuple):
    """Operation on two slots inside another one: outer and inner operator, and the slots."""

    operators: tuple[str, str]
    slots: tuple[int, int]


class BlockCompiler:
    """Compiler of the blocks and functions of one Program.

    `blocks` has the closures by name, `scope` the layout of the frame, `reals` the names of real
    variables and constants.
    """

    def __init__(self, program: Program, functions: FunctionMap | None = None) -> None:
        """Compile a Program; `functions` replace functions of the Program by name."""
        self.program = program
        self.faults = {name: 1 << bit for bit, name in enumerate(program.faults)}
        self.arithmetic = ARITHMETIC_OF_TYPE[program.number_type]
        value = self.arithmetic.to_frame_value
        self.scope = frame_layout_of(program)
        fixed = ("constant.", "solved.")
        scalars = [c for c in program.constants if c.name.startswith(fixed) and not c.items]
        self.fixed = {c.name: value(c.value) for c in scalars}
        self.functions: dict[str, Callable[..., Any]] = dict(functions or {})
        for function in sorted(program.functions, key=lambda f: _call_depth(f, program.functions)):
            if function.name not in self.functions:
                self.functions[function.name] = self._compile_function(function)
        self.reals = frozenset(name for name, kind in program.types().items() if kind == "real")
        self._done: dict[str, StatementClosure] = {}
        self.blocks = {name: self._compile_named_block(name) for name in program.blocks}

    def _compile_function(self, function: Function) -> Callable[..., Any]:
        """Return a Python function of a function of the Program.

        Its frame has the arguments, then `work.y` for the result, then its local variables.
        """
        names = _local_names(function)
        outer = self.scope
        self.scope = FrameLayout(
            {name: slot for slot, name in enumerate(names)}, [None] * len(names)
        )
        act = self._compile_block(function.body)
        y, count = self.scope.slots["work.y"], len(function.parameters)
        rest = self.scope.values[count:]
        self.scope = outer

        def call(*values: Any) -> Any:
            frame: Frame = [*values, *rest]
            act(frame)
            return frame[y]

        return call

    def _compile_named_block(self, name: str) -> StatementClosure:
        """Return the closure of a block of the Program, compiled once."""
        if name not in self._done:
            self._done[name] = self._compile_block(self.program.blocks[name])
        return self._done[name]

    def _compile_block(self, block: Block) -> StatementClosure:
        """Return the closure of operations; consecutive assignments are fused."""
        statements: list[StatementClosure] = []
        pending: list[Assign] = []
        for op in block:
            if pending and not (isinstance(op, Assign) and self._can_fuse(pending, op)):
                statements.append(self._compile_assignments(pending))
                pending = []
            if isinstance(op, Assign):
                pending.append(op)
            else:
                statements.append(self._compile_operation(op))
        return statement_closures.sequence(
            [*statements, *([self._compile_assignments(pending)] if pending else [])]
        )

    def _can_fuse(self, pending: Sequence[Assign], op: Assign) -> bool:
        """Return whether an assignment joins the previous ones in one closure.

        Copies of slots and other assignments are not mixed.
        """
        alike = (self._operand_slot(pending[-1].value) is None) == (
            self._operand_slot(op.value) is None
        )
        return alike and len(pending) < MAX_FUSED_ASSIGNMENTS

    def _compile_assignments(self, assignments: Sequence[Assign]) -> StatementClosure:
        """Return the closure of some assignments; copies of slots have a faster form."""
        targets = [self.scope.slots[op.target] for op in assignments]
        sources = [self._operand_slot(op.value) for op in assignments]
        if None not in sources:
            return statement_closures.copy(targets, [slot for slot in sources if slot is not None])
        return statement_closures.assign(
            targets, [self._compile_expression(op.value) for op in assignments]
        )

    def _compile_operation(self, op: Op) -> StatementClosure:
        """Return the closure of one operation."""
        slots = self.scope.slots
        match op:
            case Assign():
                return self._compile_assignments([op])
            case Store(array, index, value):
                return statement_closures.store(
                    slots[array], self._compile_expression(index), self._compile_expression(value)
                )
            case Branch(condition, then, other):
                two = self._compile_block(then), self._compile_block(other)
                return statement_closures.branch(self._compile_expression(condition), *two)
            case Switch(selector, cases):
                table = {number: self._compile_block(block) for number, block in cases}
                return statement_closures.switch_case(slots[selector], table)
            case Loop(count, index, body) if count <= MAX_UNROLLED_TURNS and _is_indexed(body):
                turns = [substitute_variable(body, index, k) for k in range(count)]
                last = Assign(index, Value(count - 1))
                return self._compile_block((*(op for turn in turns for op in turn), last))
            case Loop(count, index, (Branch(condition, then, ()),)) if index not in expr_names(
                condition
            ):
                more = self._compile_expression(condition)
                return statement_closures.loop_while(
                    count, slots[index], more, self._compile_block(then)
                )
            case Loop(count, index, body):
                return statement_closures.loop(count, slots[index], self._compile_block(body))
            case Count(timer, condition, limit, _):
                return statement_closures.count_while(
                    slots[timer], self._compile_expression(condition), limit
                )
            case FaultBit(fault, signal, is_set):
                slot, bit = slots["memory.faults"], self.faults[fault]
                left = slots[RANGE_VIOLATIONS]
                return (
                    statement_closures.set_fault(slot, bit, signal, left)
                    if is_set
                    else statement_closures.clear_fault(slot, bit)
                )
            case RunBlock(name):
                return self._compile_named_block(name)

    def _operand_slot(self, expr: Expr) -> int | None:
        """Return the slot of an operand that a closure reads directly; None if there is none.

        A subclass that returns None disables the fusion of operations.
        """
        return self._find_slot(expr)

    def _find_slot(self, expr: Expr) -> int | None:
        """Return the slot of a variable or constant expression; None for other expressions."""
        if isinstance(expr, Ref) and expr.name in self.scope.slots:
            return self.scope.slots[expr.name]
        if _is_constant(expr, self.fixed):
            return self.scope.slot_of_literal(self._fold_constant(expr))
        return None

    def _compile_expression(self, expr: Expr) -> ExpressionClosure:
        """Return the closure of an expression. Raises TypeError for an unknown node."""
        place = self._find_slot(expr)
        if place is not None:
            return expression_closures.load_slot(place)
        match expr:
            case Item(name, index) if _is_constant(index, {}):
                return expression_closures.load_element(
                    self.scope.slots[name], self._fold_constant(index)
                )
            case Item(name, index):
                return expression_closures.load_item(
                    self.scope.slots[name], self._compile_expression(index)
                )
            case Unary("-", operand):
                return expression_closures.negate(self._compile_expression(operand))
            case Unary(_, operand):
                return expression_closures.logical_not(self._compile_expression(operand))
            case Binary("and", Compare(">=", a, low), Compare("<=", b, high)):
                return self._compile_range_test(a, low, b, high) or self._compile_binary(
                    "and", expr.left, expr.right
                )
            case Binary(operator, left, right) | Compare(operator, left, right):
                return self._compile_binary(operator, left, right)
            case Select(condition, then, other):
                parts = [self._compile_expression(part) for part in (condition, then, other)]
                return expression_closures.select(*parts)
            case Call(function, arguments):
                known = self.functions.get(function) or self.arithmetic.elementary[function]
                return expression_closures.call_function(
                    known, [self._compile_expression(argument) for argument in arguments]
                )
            case _:
                raise TypeError(f"not an expression: {expr!r}")

    def _compile_range_test(self, *parts: Expr) -> ExpressionClosure | None:
        """Return the closure of a range test if all four operands have slots, else None."""
        slots = [self._operand_slot(part) for part in parts]
        known = [slot for slot in slots if slot is not None]
        return expression_closures.range_test(*known) if len(known) == len(slots) else None

    def _compile_binary(self, operator: str, left: Expr, right: Expr) -> ExpressionClosure:
        """Return the closure of a binary operation.

        An operand that is an operation on two slots is fused if there is a closure for both
        operators.
        """
        a, b = self._operand_slot(left), self._operand_slot(right)
        if a is not None and b is not None:
            return expression_closures.SLOT_SLOT[operator](a, b)
        if b is not None:
            if inner := self._match_inner_operation(operator, left):
                return expression_closures.FUSED_LEFT[inner.operators](*inner.slots, b)
            return expression_closures.EXPRESSION_SLOT[operator](self._compile_expression(left), b)
        inner = self._match_inner_operation(operator, right)
        if a is not None:
            if inner:
                return expression_closures.FUSED_RIGHT[inner.operators](a, *inner.slots)
            return expression_closures.SLOT_EXPRESSION[operator](a, self._compile_expression(right))
        if inner:
            return expression_closures.EXPRESSION_FUSED[inner.operators](
                self._compile_expression(left), *inner.slots
            )
        return expression_closures.EXPRESSION_EXPRESSION[operator](
            self._compile_expression(left), self._compile_expression(right)
        )

    def _match_inner_operation(self, outer_operator: str, expr: Expr) -> _InnerOperation | None:
        """Return an operand as an operation on two slots; None if it cannot be fused."""
        if (
            not isinstance(expr, Binary)
            or (outer_operator, expr.operator) not in expression_closures.FUSED_LEFT
        ):
            return None
        a, b = self._operand_slot(expr.left), self._operand_slot(expr.right)
        if a is None or b is None:
            return None
        return _InnerOperation((outer_operator, expr.operator), (a, b))

    def _fold_constant(self, expr: Expr) -> Any:
        """Return the value of a constant expression. Raises TypeError for other expressions."""
        match expr:
            case Value(value):
                return self.arithmetic.to_frame_value(value)
            case Ref(name):
                return self.fixed[name]
            case Unary("-", operand):
                return -self._fold_constant(operand)
            case Binary("/", left, right):
                return self.arithmetic.divide(self._fold_constant(left), self._fold_constant(right))
            case Binary(operator, left, right):
                return BINARY_OPERATIONS[operator](
                    self._fold_constant(left), self._fold_constant(right)
                )
            case _:
                raise TypeError(f"not foldable: {expr!r}")


def _is_constant(expr: Expr, constants: Mapping[str, float]) -> bool:
    """Return whether an expression consists of literals, constants, `-` and binary operations."""
    match expr:
        case Value():
            return True
        case Ref(name):
            return name in constants
        case Unary("-", operand):
            return _is_constant(operand, constants)
        case Binary(_, left, right):
            return _is_constant(left, constants) and _is_constant(right, constants)
        case _:
            return False


def _is_indexed(body: Block) -> bool:
    """Return whether a body has only assignments and stores and reads an array element."""
    expressions: list[Expr] = []
    for op in body:
        match op:
            case Assign(_, value):
                expressions.append(value)
            case Store(_, index, value):
                expressions += [index, value]
            case _:
                return False
    return any(isinstance(part, Item) for expr in expressions for part in subexpressions(expr))


def _local_names(function: Function) -> list[str]:
    """Return the parameters, `work.y` and the assigned variables of a function, in this order."""
    targets = [op.target for op in function.body if isinstance(op, Assign)]
    parameters = [f"work.{name}" for name in function.parameters]
    return list(dict.fromkeys([*parameters, "work.y", *targets]))


def _call_depth(function: Function, functions: tuple[Function, ...]) -> int:
    """Return how many calls a function makes, directly or through others.

    Callees have smaller numbers.
    """
    names = called_functions([function.body])
    called = [f for f in functions if f is not function and f.name in names]
    return sum(1 + _call_depth(f, functions) for f in called)
