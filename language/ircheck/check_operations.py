"""Checks of operations: targets, conditions, cases, limits, blocks and what each block writes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Count,
    FaultBit,
    Loop,
    Op,
    RunBlock,
    Store,
    Switch,
)
from language.ir.program import MODE_VARIABLE, Program
from language.ir.traversal import block_writes, called_blocks, reachable_names
from language.ircheck.block_contracts import ENTRIES, written_groups
from language.ircheck.check_expression import ExpressionChecker
from language.ircheck.violation import Rule, Violation, operation_place

READ_ONLY_GROUPS = ("input.", "is_new.")
"""Groups of variables that only callers write."""


def check_operations(program: Program) -> Iterator[Violation]:
    """Yield the violations of the operations of all blocks, and of the calls between blocks."""
    checker = _OperationChecker(program)
    for name, block in program.blocks.items():
        yield from checker.check(name, block)
    calls = {name: called_blocks(block) for name, block in program.blocks.items()}
    found = list(_check_calls(program, calls))
    yield from found
    if not found:
        yield from _check_contracts(program, calls)


def _check_calls(program: Program, calls: Mapping[str, Sequence[str]]) -> Iterator[Violation]:
    """Yield the violations of runs of blocks: missing blocks, cycles, unreached blocks.

    `calls` are the blocks that each block runs directly. Back ends run each block of a Program
    without modes.
    """
    has_missing = False
    for name, called in calls.items():
        for missing in sorted(set(called) - calls.keys()):
            has_missing = True
            yield Violation("reference", f"block {name}", f"there is no block `{missing}`")
    if has_missing:
        return
    reached = set[str]()
    for name, called in calls.items():
        below = set[str]().union(*(reachable_names(inner, calls.__getitem__) for inner in called))
        if name in below:
            yield Violation("reference", f"block {name}", "it runs itself")
            return
        if name in ENTRIES or not program.modes:
            reached |= {name} | below
    for name in calls:
        if name not in reached:
            yield Violation("dead-store", f"block {name}", "no entry of the Program runs it")


def _check_contracts(program: Program, calls: Mapping[str, Sequence[str]]) -> Iterator[Violation]:
    """Yield a violation for each variable that a block writes and its kind may not write.

    `calls` are the blocks that each block runs directly.
    """
    writes = {name: block_writes(block) for name, block in program.blocks.items()}
    for name in program.blocks:
        allowed = written_groups(name)
        if allowed is None:
            continue
        reached = reachable_names(name, calls.__getitem__)
        written = dict.fromkeys(variable for inner in reached for variable in writes[inner])
        for variable in written:
            if variable.partition(".")[0] not in allowed:
                message = f"it writes `{variable}`, but may write only {', '.join(sorted(allowed))}"
                yield Violation("interface", f"block {name}", message)


class _OperationChecker:
    """A checker of the operations of blocks, inner blocks included."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.name = ""
        self.op: Op | None = None
        self.found: list[Violation] = []
        self.expressions = ExpressionChecker(program, self.report)
        self.variables = {variable.name: variable for variable in program.variables}
        self.derived = {c.name for c in program.constants if c.kind == "derived"}
        self.numbers = _case_numbers(program)

    def check(self, name: str, block: Block) -> list[Violation]:
        """Return the violations of a block."""
        self.name, self.found = name, []
        self._check_block(block)
        return self.found

    def report(self, rule: Rule, message: str) -> None:
        """Add a violation of the current operation."""
        assert self.op is not None
        self.found.append(Violation(rule, operation_place(self.name, self.op), message))

    def _check_block(self, block: Block) -> None:
        """Report the violations of operations in their order."""
        for op in block:
            self.op = op
            self._check_op(op)

    def _check_op(self, op: Op) -> None:
        """Report the violations of one operation."""
        check = self.expressions.check
        match op:
            case Assign(target, value, _):
                kind = check(value)
                self._check_target(target, kind, False)
            case Store(array, index, value):
                kind = check(value)
                self._check_target(array, kind, True)
                if array in self.variables:
                    self.expressions.check_element(array, index)
            case Branch(condition, then, other):
                kind = check(condition)
                if kind != "truth":
                    self.report("type", f"the condition is {kind}, not truth")
                self._check_block(then)
                self._check_block(other)
            case Switch(selector, cases):
                self._check_switch(selector, cases)
            case Loop(count, index, body):
                self._check_loop(count, index, body)
            case Count(timer, condition, limit, _):
                kind = check(condition)
                if kind != "truth":
                    self.report("type", f"the condition is {kind}, not truth")
                self._check_target(timer, "whole", False)
                largest = self.variables[timer].largest if timer in self.variables else limit
                if not 0 < limit <= largest:
                    message = f"the limit {limit} of `{timer}` is not in 1 .. {largest}"
                    self.report("range", message)
            case FaultBit(fault, _, _):
                if fault not in self.program.faults:
                    self.report("reference", f"there is no fault `{fault}`")
                self._check_target("memory.faults", "whole", False)
            case RunBlock():
                pass

    def _check_target(self, target: str, kind: str, is_element: bool) -> None:
        """Report the violations of a name that is written: it exists and has the type."""
        variable = self.variables.get(target)
        if variable is None:
            if target in self.derived and self.name == "derive":
                return
            is_constant = target in self.expressions.types
            what = "is a constant" if is_constant else "is not declared"
            self.report("reference", f"`{target}` {what}")
            return
        if target.startswith(READ_ONLY_GROUPS):
            self.report("interface", f"`{target}` is an input")
        if is_element != (variable.size > 0):
            what = "is no array" if is_element else "is an array"
            self.report("type", f"`{target}` {what}")
        if variable.type != kind:
            self.report("type", f"`{target}` is {variable.type}, the value {kind}")

    def _check_switch(self, selector: str, cases: tuple[tuple[int, Block], ...]) -> None:
        """Report the violations of a switch: its selector, its cases and their blocks."""
        kind = self.expressions.types.get(selector)
        if kind is None:
            self.report("reference", f"`{selector}` is not declared")
        elif kind != "whole":
            self.report("type", f"the selector `{selector}` is {kind}, not whole")
        numbers = [number for number, _ in cases]
        if not numbers:
            self.report("range", f"the switch over `{selector}` has no case")
        if len(set(numbers)) < len(numbers):
            self.report("range", f"a case of `{selector}` occurs twice")
        known = self.numbers.get(selector)
        for number in numbers:
            if known is not None and number not in known:
                self.report("range", f"`{selector}` is never {number}")
        for _, block in cases:
            self._check_block(block)

    def _check_loop(self, count: int, index: str, body: Block) -> None:
        """Report the violations of a loop: its count, its index and its body."""
        if count < 1:
            self.report("range", f"the loop has {count} iterations")
        self._check_target(index, "whole", False)
        if index in block_writes(body):
            self.report("interface", f"the body writes the index `{index}`")
        self.expressions.intervals[index] = (0, count - 1)
        self._check_block(body)
        del self.expressions.intervals[index]


def _case_numbers(program: Program) -> dict[str, frozenset[int]]:
    """Return the numbers that a selector may have, for mode variables and enumerations."""
    found = {v.name: frozenset(range(len(v.values))) for v in program.variables if v.values}
    for region, variable in program.mode_variables().items():
        found[variable] = frozenset(mode.number for mode in program.modes_of(region))
    if not program.modes:
        found.pop(MODE_VARIABLE, None)
    return found
