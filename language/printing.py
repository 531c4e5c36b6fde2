"""Printing: the canonical text of a Program, read by golden tests and hashed into its digest."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Iterator

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

INDENT = "    "
MOST_KEPT = 16
"""Programs whose digests are kept, the latest ones: they are asked for before each run."""

_kept: OrderedDict[int, tuple[Program, str]] = OrderedDict()
"""By identity: what is kept holds its Program, so no other one has it meanwhile."""


def program_text(program: Program) -> str:
    """Return the whole program as text, one operation a line."""
    return "\n".join(_program_lines(program)) + "\n"


def digest(program: Program) -> str:
    """Return the first 16 hexadecimal digits of the SHA-256 of the program's text."""
    known = _kept.pop(id(program), None) or (program, _digest(program))
    _kept[id(program)] = known
    if len(_kept) > MOST_KEPT:
        _kept.popitem(last=False)
    return known[1]


def _digest(program: Program) -> str:
    return hashlib.sha256(program_text(program).encode()).hexdigest()[:16]


def expr_text(expr: Expr) -> str:
    """Return an expression with every operation in parentheses."""
    match expr:
        case Value(value):
            return repr(value)
        case Ref(name):
            return name
        case Item(name, index):
            return f"{name}[{expr_text(index)}]"
        case Unary(operator, operand):
            return f"({operator} {expr_text(operand)})"
        case Binary(operator, left, right) | Compare(operator, left, right):
            return f"({expr_text(left)} {operator} {expr_text(right)})"
        case Select(condition, then, other):
            parts = (expr_text(part) for part in (condition, then, other))
            return "(if {} then {} else {})".format(*parts)
        case Call(function, arguments):
            return f"{function}({', '.join(expr_text(argument) for argument in arguments)})"


def block_lines(block: Block, depth: int = 0) -> Iterator[str]:
    """Yield the lines of a block."""
    for op in block:
        yield from (INDENT * depth + line for line in _op_lines(op))


def _op_lines(op: Op) -> Iterator[str]:
    match op:
        case Assign(target, value, key):
            yield f"{target} := {expr_text(value)}{_cited(key)}"
        case Store(array, index, value):
            yield f"{array}[{expr_text(index)}] := {expr_text(value)}"
        case Branch(condition, then, other):
            yield f"if {expr_text(condition)}"
            yield from block_lines(then, 1)
            if other:
                yield "else"
                yield from block_lines(other, 1)
        case Choose(selector, cases):
            for number, case_block in cases:
                yield f"when {selector} is {number}"
                yield from block_lines(case_block, 1)
        case Loop(count, index, body):
            yield f"repeat {count} times as {index}"
            yield from block_lines(body, 1)
        case Count(timer, condition, limit, key):
            yield f"count {timer} up to {limit} while {expr_text(condition)}{_cited(key)}"
        case FaultBit(fault, signal, value):
            yield f"{'fault' if value else 'no fault'} {fault}{f' of {signal}' if signal else ''}"
        case Run(name):
            yield f"run {name}"


def _cited(key: str) -> str:
    return f"    # {key}" if key else ""


def _program_lines(program: Program) -> Iterator[str]:
    yield from _mode_lines(program)
    yield from _event_lines(program)
    yield from _name_lines(program)
    for function in program.functions:
        several = len(function.parameters) > 1
        yield f"function {function.name}" + (f" of {function.parameters}" if several else "")
        yield from block_lines(function.body, 1)
    for name, block in program.blocks.items():
        yield f"block {name}"
        yield from block_lines(block, 1)


def _mode_lines(program: Program) -> Iterator[str]:
    yield f"program {program.name}"
    yield f"numbers {program.number}"
    yield f"period {program.period}" if program.period else f"major step {program.major_step}"
    for mode in program.modes:
        yield f"mode {mode.number} {mode.name}"
    for region in program.regions:
        for mode in region.modes:
            yield f"region {region.name} mode {mode.number} {mode.name}"
    for mode in program.run_modes:
        yield f"run mode {mode.number} {mode.name}"


def _event_lines(program: Program) -> Iterator[str]:
    for t in program.transitions:
        waited = t.tunable or (f"{t.wait} s" if t.wait else "")
        wait = f" wait {waited} = {t.ticks} ticks" if waited else ""
        back = f" rewind {t.rewind} ticks" if t.rewind else ""
        source, target = t.between or (t.source, t.target)
        target = "[]" if target == "" else target
        yield f"transition {t.number} {t.name}: {source} -> {target}{wait}{back}"
    for alarm in program.alarms:
        yield f"alarm {alarm.variable}: {alarm.time} s in {alarm.region} mode {alarm.mode}"
    for info in program.invariants:
        yield f"invariant {info.name} of mode {info.mode} of {info.region}: {info.variable}"
    for bit, fault in enumerate(program.faults):
        yield f"fault {bit} {fault}"


def _name_lines(program: Program) -> Iterator[str]:
    for constant in program.constants:
        stamps = f" from {', '.join(constant.depends_on)}" if constant.depends_on else ""
        limits = f" in {constant.range[0]!r} .. {constant.range[1]!r}" if constant.range else ""
        value = constant.items or constant.value
        yield f"{constant.name} = {value!r} {constant.unit}{limits}{stamps}"
    for variable in program.variables:
        size = f"[{variable.size}]" if variable.size else ""
        values = f" of {', '.join(variable.values)}" if variable.values else ""
        yield f"{variable.name}{size}: {variable.type} {variable.unit}{values}"
    for name, value in program.defaults.items():
        yield f"default input.{name} = {value!r}"
    for wire in program.outputs:
        yield f"output {wire.name} = {wire.source}"
