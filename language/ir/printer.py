"""Printer: the canonical text of a Program, for golden tests and for its digest."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

from language.ir.analysis_cache import cache_on_owner
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

INDENT = "    "


def format_program(program: Program) -> str:
    """Return a Program as text, one operation, constant or variable per line.

    The order is header (name, number type, period, modes), transitions, alarms, invariants, faults,
    constants, variables, default inputs, outputs, functions, blocks; each in the order of the
    Program. Inner blocks are indented by INDENT.
    """
    return "\n".join(_program_lines(program)) + "\n"


@cache_on_owner
def digest(program: Program) -> str:
    """Return the first 16 hexadecimal digits of the SHA-256 of `format_program`."""
    return hashlib.sha256(format_program(program).encode()).hexdigest()[:16]


def format_expr(expr: Expr) -> str:
    """Return an expression as text with every operation in parentheses: `(a + (- b))`.

    Variables have their full names, literals the text of repr; a choice is `(if a then b else c)`,
    a call `f(a, b)`, an element `x[i]`.
    """
    match expr:
        case Value(value):
            return repr(value)
        case Ref(name):
            return name
        case Item(name, index):
            return f"{name}[{format_expr(index)}]"
        case Unary(operator, operand):
            return f"({operator} {format_expr(operand)})"
        case Binary(operator, left, right) | Compare(operator, left, right):
            return f"({format_expr(left)} {operator} {format_expr(right)})"
        case Select(condition, then, other):
            parts = (format_expr(part) for part in (condition, then, other))
            return "(if {} then {} else {})".format(*parts)
        case Call(function, arguments):
            return f"{function}({', '.join(format_expr(argument) for argument in arguments)})"


def block_lines(block: Block, depth: int = 0) -> Iterator[str]:
    """Yield the lines of a block, indented by `depth` times INDENT.

    Inner blocks are one level deeper. Examples: `x := (a + b) # key`, `x[i] := a`, `if c`, `else`,
    `when x is 1`, `repeat 3 times as i`, `count t up to 9 while c`, `fault f of x`, `run block`.
    """
    for op in block:
        yield from (INDENT * depth + line for line in _op_lines(op))


def _op_lines(op: Op) -> Iterator[str]:
    """Yield the lines of one operation; inner blocks are indented by one level."""
    match op:
        case Assign(target, value, key):
            yield f"{target} := {format_expr(value)}{_format_citation(key)}"
        case Store(array, index, value):
            yield f"{array}[{format_expr(index)}] := {format_expr(value)}"
        case Branch(condition, then, other):
            yield f"if {format_expr(condition)}"
            yield from block_lines(then, 1)
            if other:
                yield "else"
                yield from block_lines(other, 1)
        case Switch(selector, cases):
            for number, case_block in cases:
                yield f"when {selector} is {number}"
                yield from block_lines(case_block, 1)
        case Loop(count, index, body):
            yield f"repeat {count} times as {index}"
            yield from block_lines(body, 1)
        case Count(timer, condition, limit, key):
            head = f"count {timer} up to {limit} while {format_expr(condition)}"
            yield head + _format_citation(key)
        case FaultBit(fault, signal, value):
            yield f"{'fault' if value else 'no fault'} {fault}{f' of {signal}' if signal else ''}"
        case RunBlock(name):
            yield f"run {name}"


def _format_citation(key: str) -> str:
    """Return the comment with the key path of an operation, or an empty text without a key."""
    return f"    # {key}" if key else ""


def _program_lines(program: Program) -> Iterator[str]:
    """Yield the lines of a Program: header, names, functions, blocks."""
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
    """Yield the lines of the name, the number type, the period and the modes."""
    yield f"program {program.name}"
    yield f"numbers {program.number_type}"
    yield f"period {program.period}" if program.period else f"major step {program.major_step}"
    for mode in program.modes:
        yield f"mode {mode.number} {mode.name}"
    for region in program.regions:
        for mode in region.modes:
            yield f"region {region.name} mode {mode.number} {mode.name}"
    for mode in program.run_modes:
        yield f"run mode {mode.number} {mode.name}"


def _event_lines(program: Program) -> Iterator[str]:
    """Yield the lines of transitions, alarms, invariants and faults."""
    for t in program.transitions:
        waited = t.tunable_wait or (f"{t.wait} s" if t.wait else "")
        wait = f" wait {waited} = {t.ticks} ticks" if waited else ""
        back = f" rewind {t.rewind_ticks} ticks" if t.rewind_ticks else ""
        source, target = t.chart_endpoints or (t.source, t.target)
        target = "[]" if target == "" else target
        yield f"transition {t.number} {t.name}: {source} -> {target}{wait}{back}"
    for alarm in program.alarms:
        yield f"alarm {alarm.variable}: {alarm.time} s in {alarm.region} mode {alarm.mode}"
    for info in program.invariants:
        yield f"invariant {info.name} of mode {info.mode} of {info.region}: {info.variable}"
    for bit, fault in enumerate(program.faults):
        yield f"fault {bit} {fault}"


def _name_lines(program: Program) -> Iterator[str]:
    """Yield the lines of constants, variables, default inputs and outputs."""
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
