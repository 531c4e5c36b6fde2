"""Printer: the canonical text of a Program, and its complete text, which a parser reads.

The canonical text has what a Program computes; its digest is in every generated file. The complete
text has the same lines. Behind a line with more to say there is an attribute line, `@` and a JSON
object: comments, keys, ranges, and for each block the names that it reads and writes.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterator, Mapping
from fractions import Fraction

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
from language.ir.traversal import block_reads, block_writes, reachable_blocks

INDENT = "    "
ATTRIBUTE_MARK = "@ "
"""First characters of an attribute line, behind its indentation."""
Attributes = Mapping[str, object]
"""What the canonical text of a line leaves out, by name; JSON values."""
NO_ATTRIBUTES: Attributes = {}
Line = tuple[str, Attributes]
"""A line of the canonical text, and its attributes."""


def format_program(program: Program) -> str:
    """Return a Program as text, one operation, constant or variable per line.

    The order is header (name, number type, period, modes), transitions, alarms, invariants, faults,
    constants, variables, default inputs, outputs, functions, blocks; each in the order of the
    Program. Inner blocks are indented by INDENT.
    """
    return "".join(f"{text}\n" for text, _ in _program_lines(program))


def serialise_program(program: Program) -> str:
    """Return the complete text of a Program: the canonical text with attribute lines.

    `parse_program` (language/ir/program_parser.py) returns an equal Program, if it has no switch
    without cases: that has no text.
    """
    return "".join(f"{line}\n" for line in _serialised_lines(program))


def _serialised_lines(program: Program) -> Iterator[str]:
    """Yield the lines of the complete text."""
    for text, attributes in _program_lines(program):
        yield text
        if attributes:
            indent = text[: len(text) - len(text.lstrip())]
            yield f"{indent}{ATTRIBUTE_MARK}{json.dumps(attributes, default=_to_json)}"


def _to_json(value: object) -> object:
    """Return a fraction, a complex number or a record of a Program as a JSON value."""
    if isinstance(value, Fraction):
        return str(value)
    if isinstance(value, complex):
        return [value.real, value.imag]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    raise TypeError(f"not a part of a Program: {value!r}")


def _attributes_of(record: object, *printed: str) -> Attributes:
    """Return the fields of a record that are not `printed` and differ from their defaults."""
    assert dataclasses.is_dataclass(record)
    return {
        f.name: getattr(record, f.name)
        for f in dataclasses.fields(record)
        if f.name not in printed and getattr(record, f.name) != f.default
    }


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
    yield from (text for text, _ in _block_lines(block, depth))


def _block_lines(block: Block, depth: int) -> Iterator[Line]:
    """Yield the lines of a block with their attributes.

    A switch behind a switch over the same variable has the attribute `switch`, because its lines
    alone would belong to the switch before it.
    """
    previous: Op | None = None
    for op in block:
        follows = isinstance(op, Switch) and isinstance(previous, Switch)
        is_new = follows and op.selector == previous.selector  # type: ignore[union-attr]
        for text, attributes in _op_lines(op):
            yield INDENT * depth + text, {"switch": "new"} if is_new else attributes
            is_new = False
        previous = op


def _op_lines(op: Op) -> Iterator[Line]:
    """Yield the lines of one operation; inner blocks are indented by one level."""
    match op:
        case Assign(target, value, key):
            yield f"{target} := {format_expr(value)}{_format_citation(key)}", NO_ATTRIBUTES
        case Store(array, index, value):
            yield f"{array}[{format_expr(index)}] := {format_expr(value)}", NO_ATTRIBUTES
        case Branch(condition, then, other):
            yield f"if {format_expr(condition)}", NO_ATTRIBUTES
            yield from _block_lines(then, 1)
            if other:
                yield "else", NO_ATTRIBUTES
                yield from _block_lines(other, 1)
        case Switch(selector, cases):
            for number, case_block in cases:
                yield f"when {selector} is {number}", NO_ATTRIBUTES
                yield from _block_lines(case_block, 1)
        case Loop(count, index, body):
            yield f"repeat {count} times as {index}", NO_ATTRIBUTES
            yield from _block_lines(body, 1)
        case Count(timer, condition, limit, key):
            head = f"count {timer} up to {limit} while {format_expr(condition)}"
            yield head + _format_citation(key), NO_ATTRIBUTES
        case FaultBit(fault, signal, value):
            text = f"{'fault' if value else 'no fault'} {fault}{f' of {signal}' if signal else ''}"
            yield text, NO_ATTRIBUTES
        case RunBlock(name):
            yield f"run {name}", NO_ATTRIBUTES


def _format_citation(key: str) -> str:
    """Return the comment with the key path of an operation, or an empty text without a key."""
    return f"    # {key}" if key else ""


def _program_lines(program: Program) -> Iterator[Line]:
    """Yield the lines of a Program: header, names, functions, blocks."""
    yield from _mode_lines(program)
    yield from _event_lines(program)
    yield from _name_lines(program)
    for function in program.functions:
        several = len(function.parameters) > 1
        text = f"function {function.name}" + (f" of {function.parameters}" if several else "")
        yield text, _attributes_of(function, "name", "body")
        yield from _block_lines(function.body, 1)
    for name, block in program.blocks.items():
        mark = program.inlining.get(name)
        yield (
            f"block {name}",
            {
                "reads": sorted(set(interface_reads(program, name))),
                "writes": sorted(set(interface_writes(program, name))),
                **({"inlining": mark} if mark else {}),
            },
        )
        yield from _block_lines(block, 1)


def interface_reads(program: Program, name: str) -> list[str]:
    """Return the names that a block reads, directly or through the blocks that it runs.

    Blocks that do not exist are ignored.
    """
    reached = _existing_blocks(program, name)
    return [read for inner in reached for read in block_reads(program.blocks[inner])]


def interface_writes(program: Program, name: str) -> list[str]:
    """Return the names that a block writes, directly or through the blocks that it runs."""
    reached = _existing_blocks(program, name)
    return [write for inner in reached for write in block_writes(program.blocks[inner])]


def _existing_blocks(program: Program, name: str) -> set[str]:
    """Return a block and all blocks that it runs; only itself if one of these does not exist."""
    try:
        return reachable_blocks(name, program.blocks)
    except KeyError:
        return {name}


def _mode_lines(program: Program) -> Iterator[Line]:
    """Yield the lines of the name, the number type, the period and the modes."""
    head: dict[str, object] = {}
    if program.observers:
        head["observers"] = program.observers
    if program.integration:
        head["integration"] = program.integration
    yield f"program {program.name}", head
    yield f"numbers {program.number_type}", NO_ATTRIBUTES
    step = program.major_step
    yield (
        f"period {program.period}" if program.period else f"major step {step}",
        {"major_step": step} if program.period not in (None, step) else NO_ATTRIBUTES,
    )
    for mode in program.modes:
        yield f"mode {mode.number} {mode.name}", NO_ATTRIBUTES
    for region in program.regions:
        for mode in region.modes:
            yield f"region {region.name} mode {mode.number} {mode.name}", NO_ATTRIBUTES
    for mode in program.run_modes:
        yield f"run mode {mode.number} {mode.name}", NO_ATTRIBUTES


def _event_lines(program: Program) -> Iterator[Line]:
    """Yield the lines of transitions, alarms, invariants and faults."""
    for t in program.transitions:
        waited = t.tunable_wait or (f"{t.wait} s" if t.wait else "")
        wait = f" wait {waited} = {t.ticks} ticks" if waited else ""
        back = f" rewind {t.rewind_ticks} ticks" if t.rewind_ticks else ""
        source, target = t.chart_endpoints or (t.source, t.target)
        target = "[]" if target == "" else target
        text = f"transition {t.number} {t.name}: {source} -> {target}{wait}{back}"
        yield text, _attributes_of(t)
    for alarm in program.alarms:
        text = f"alarm {alarm.variable}: {alarm.time} s in {alarm.region} mode {alarm.mode}"
        yield text, _attributes_of(alarm)
    for info in program.invariants:
        text = f"invariant {info.name} of mode {info.mode} of {info.region}: {info.variable}"
        yield text, _attributes_of(info)
    for bit, fault in enumerate(program.faults):
        yield f"fault {bit} {fault}", NO_ATTRIBUTES


def _name_lines(program: Program) -> Iterator[Line]:
    """Yield the lines of constants, variables, default inputs and outputs."""
    for constant in program.constants:
        stamps = f" from {', '.join(constant.depends_on)}" if constant.depends_on else ""
        limits = f" in {constant.range[0]!r} .. {constant.range[1]!r}" if constant.range else ""
        value = constant.items or constant.value
        text = f"{constant.name} = {value!r} {constant.unit}{limits}{stamps}"
        yield text, _attributes_of(constant, "name")
    for variable in program.variables:
        size = f"[{variable.size}]" if variable.size else ""
        values = f" of {', '.join(variable.values)}" if variable.values else ""
        text = f"{variable.name}{size}: {variable.type} {variable.unit}{values}"
        yield text, _attributes_of(variable, "name", "type", "size")
    for name, value in program.defaults.items():
        yield f"default input.{name} = {value!r}", NO_ATTRIBUTES
    for wire in program.outputs:
        yield f"output {wire.name} = {wire.source}", _attributes_of(wire, "name", "source")
