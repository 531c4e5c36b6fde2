"""Path specialisation: follows one execution path of a Program and folds what is known on it.

`fast_path.py` uses it to obtain the straight-line block of an event-free step.
"""

from __future__ import annotations

from dataclasses import dataclass

from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Expr,
    FaultBit,
    Loop,
    Op,
    Ref,
    RunBlock,
    Select,
    Switch,
    Value,
)
from language.ir.program import Program, Variable
from language.ir.rewrite_ops import map_expressions, map_operands, operands
from language.ir.traversal import block_reads, block_writes, expr_names, negate_condition
from language.numerics.evaluate import evaluate
from language.passes.value_numbering import ValueNumbering

WORK, TIME_LEFT, CROSSED = "work.", "work.left", "work.crossed"
"""The prefix of work variables, the time left in a step, and the flag of a crossing."""
EVALUATION_BLOCKS, POINT_STATE_PREFIX = ("rates_", "guards_"), "work.at_"
"""Prefixes of blocks that are evaluated at a point of the step, and of the states at that point."""


@dataclass(frozen=True)
class PathValue:
    """A value of a variable of the Program at a point of the step."""

    variable: Variable
    point: int


class NotSpecialisable(Exception):
    """The control flow of a path depends on more than the guards of the mode."""


class ExecutionPath:
    """A path through a step without a crossing.

    `known` holds the known values of variables as expressions, and `ops` the operations on the
    path. `prologue` holds the operations before the guards, and `is_event_free` the condition that
    no guard changed. `values` maps each new variable to the variable of the Program and the point
    of the step that it stands for. Rates and guards are evaluated at the points 1 to `points`.
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
        self._values = ValueNumbering()
        self._name_by_number: dict[int, str] = {}
        self._has_evaluated = False

    @property
    def is_unconditional(self) -> bool:
        """Tell whether the path has no guards: `is_event_free` is the literal true."""
        return self.is_event_free == Value(True)

    def reuse_equations(self, equations: Block, constant_groups: tuple[str, ...]) -> None:
        """Record the values of equations that are still valid from the end of the step before.

        `constant_groups` are prefixes of names. An assignment is reused if it reads only names with
        such a prefix, targets reused before it, and functions. A calibration page may change
        between two steps, so callers do not name its parameters. Other operations are skipped;
        nothing is appended to `ops`.
        """
        reused = set[str]()
        for op in equations:
            if isinstance(op, Assign):
                value = self._fold_constants(op.value)
                names = expr_names(value)
                if all(n in reused or n.startswith(constant_groups) for n in names):
                    reused.add(op.target)
                    self._values.number_by_name[op.target] = number = self._values.number_of(value)
                    if not op.target.startswith(WORK):
                        self._name_by_number.setdefault(number, op.target)

    def follow(self, block: Block) -> None:
        """Append the operations of a block to the path, with known values folded.

        Blocks that it runs are followed in place. A switch on a mode without a case adds nothing. A
        branch on an unknown condition is kept if its arms assign only persistent variables;
        otherwise both arms must have the same effect. Raises NotSpecialisable if not, if a selector
        or a work variable is unknown, if a loop does not come to rest, and for any other operation.
        """
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
        """Append the equations at the end of a step: those of the block `equations`.

        If `work.event` may be true, they stand in a branch whose other arm runs the transitions
        (`macro_step`) first. If the equations cannot be specialised, their block is run as it is.
        Raises NotSpecialisable if `work.event` is unknown.
        """
        event, begin = self._resolve(Ref("work.event")), len(self.ops)
        try:
            self.follow(self.program.blocks["equations"])
        except NotSpecialisable:
            self.ops[begin:] = [RunBlock("equations")]
        if event != Value(False):
            now = tuple(self.ops[begin:])
            self.ops[begin:] = [Branch(event, (RunBlock("macro_step"), RunBlock("equations")), now)]

    def _assign(self, target: str, value: Expr, key: str) -> None:
        """Append an assignment and record the value of its target.

        A work variable gets a new name for each value. A value that was computed before is replaced
        by its name. An assignment to the flag of a crossing ends the prologue.
        """
        if self._has_evaluated and target.startswith(POINT_STATE_PREFIX):
            self._has_evaluated = False
            self.points += 1
        if target == CROSSED:
            self.is_event_free = Value(True) if value == Value(False) else negate_condition(value)
            value = Value(False)
            self.ops = []
        number = self._values.number_of(value)
        if number in self._name_by_number and not isinstance(value, Value | Ref):
            value = Ref(self._name_by_number[number])
        self._values.versions[target] += 1
        if target.startswith(WORK) and not isinstance(value, Value | Ref):
            name = f"{target}_{self._values.versions[target]}"
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
        """Follow the taken arm of a branch.

        If the condition is unknown, a branch that assigns only persistent variables is kept.
        Otherwise both arms must have the same effect, or NotSpecialisable is raised.
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
        """Follow the iterations of a loop until one has no effect.

        Raises NotSpecialisable if all `count` iterations have an effect.
        """
        for _ in range(count):
            before, done = dict(self.known), len(self.ops)
            self.follow(body)
            if self.known == before and len(self.ops) == done:
                return
        raise NotSpecialisable

    def _resolve(self, expr: Expr) -> Expr:
        """Return an expression with known values inserted and folded.

        Raises NotSpecialisable if it reads a work variable whose value is unknown.
        """
        if isinstance(expr, Ref):
            if expr.name not in self.known and expr.name.startswith(WORK):
                raise NotSpecialisable
            return self.known.get(expr.name, expr)
        return _simplify(map_operands(expr, self._resolve), self.program)

    def _fold_constants(self, expr: Expr) -> Expr:
        """Return an expression with known literals inserted and folded; other names stay."""
        if isinstance(expr, Ref):
            known = self.known.get(expr.name)
            return known if isinstance(known, Value) else expr
        return _simplify(map_operands(expr, self._fold_constants), self.program)

    def _invalidate(self, name: str) -> None:
        """Forget what is known of a variable, and of others that equal it: its value changes."""
        self._values.versions[name] += 1
        self._values.number_by_name.pop(name, None)
        self._name_by_number = {
            number: held for number, held in self._name_by_number.items() if held != name
        }
        self.known.pop(name, None)
        known = self.known.items()
        for other in [n for n, held in known if isinstance(held, Ref) and held.name == name]:
            del self.known[other]

    def _record_name(self, name: str, number: int) -> None:
        """Record that a name holds the value with a number.

        The first name of a value is used for it.
        """
        self._values.number_by_name[name] = number
        self._name_by_number.setdefault(number, name)


def _writes_only_persistent(block: Block) -> bool:
    """Tell whether a block only assigns persistent variables that it does not read."""
    writes = set(block_writes(block))
    is_plain = all(isinstance(op, Assign | FaultBit) for op in block)
    return is_plain and not any(n.startswith(WORK) or n in set(block_reads(block)) for n in writes)


def _simplify(expr: Expr, program: Program) -> Expr:
    """Return a folded expression: known choices and conditions, operations on literals.

    The operands must be simple already.
    """
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
