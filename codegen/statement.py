"""Statement: the operations of a block as lines of C99 (rules C19 and C20)."""

from __future__ import annotations

import dataclasses
import re
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from codegen.comment import comment as safe
from codegen.expression import Place, c_expression
from codegen.usage import Usage
from language.operation import (
    Assign,
    Block,
    Branch,
    Choose,
    Compare,
    Count,
    Expr,
    FaultBit,
    Loop,
    Op,
    Run,
    Select,
    Store,
    Unary,
    Value,
)
from language.program import Program, TransitionInfo, short
from language.traversal import expr_names

INDENT = "    "
NOTHING = f"{INDENT}/* nothing to do */"
ELSE_NOTHING = ("} else {", NOTHING)
"""The end of a chain of conditions none of which has to be true (MISRA C:2012, rule 15.7)."""
WIDTH = 100
"""Longest line of generated C; longer expressions are broken at a sum or a blank."""


@dataclass(frozen=True)
class Writer:
    """What is needed to print one block."""

    program: Program
    usages: Mapping[str, Usage]
    local: frozenset[str]
    place: Place
    types: Mapping[str, str]
    room: int = WIDTH

    def lines(self, block: Block) -> Iterator[str]:
        """Yield the lines of a block, no longer than there is `room`."""
        inner = dataclasses.replace(self, room=self.room - len(INDENT))
        if not block:
            yield NOTHING
        for op in block:
            for line in inner._op(op):
                yield (INDENT + line) if line else ""

    def _op(self, op: Op) -> Iterator[str]:
        match op:
            case Assign(target, value, key):
                yield from self._assign(target, c_expression(value, self.place), value, key)
            case Store(array, index, value):
                left = f"{self.place(array)}[{c_expression(index, self.place)}]"
                yield from wrapped(f"{left} = ", c_expression(value, self.place), "", self.room)
            case Branch(condition, then, other):
                yield from self._branch(condition, then, other)
            case Choose(selector, cases):
                yield from self._choose(selector, cases)
            case Loop(count, index, body):
                yield from self._loop(count, index, body)
            case Count(timer, condition, limit, key):
                yield from self._count(self.place(timer), condition, limit, key, self._wait(timer))
            case FaultBit(fault, _, True):
                yield f"self->faults |= {self.program.name}_FAULT_{fault};"
            case FaultBit(fault, _, _):
                yield f"self->faults &= (uint32_t)~{self.program.name}_FAULT_{fault};"
            case Run(name):
                yield f"{name}({', '.join(self.usages[name].parameters)});"

    def _assign(self, target: str, text: str, value: object, key: str) -> Iterator[str]:
        if isinstance(value, Value) and type(value.value) is int:
            text = self.place.whole(target, value.value)
        kind = self.types[target] if target in self.local else ""
        if isinstance(value, Select) and is_nested(value):
            yield from _cited(key)
            yield from decided(kind, self.place(target), value, self.place, self.room)
        else:
            declared = f"const {kind} " if kind else ""
            yield from wrapped(f"{declared}{self.place(target)} = ", text, key, self.room)

    def _branch(self, condition: Expr, then: Block, other: Block) -> Iterator[str]:
        yield from tested("if", c_expression(condition, self.place), "", self.room)
        yield from self.lines(then)
        chained = len(other) == 1 and isinstance(other[0], Branch)
        while len(other) == 1 and isinstance(other[0], Branch):
            inner = other[0]
            yield from tested("} else if", c_expression(inner.condition, self.place), "", self.room)
            yield from self.lines(inner.then)
            other = inner.other
        if other:
            yield "} else {"
            yield from self.lines(other)
        elif chained:
            yield from ELSE_NOTHING
        yield "}"

    def _choose(self, selector: str, cases: tuple[tuple[int, Block], ...]) -> Iterator[str]:
        yield f"switch ({self.place(selector)}) {{"
        for number, block in cases:
            yield f"case {self.place.whole(selector, number)}:"
            yield from self.lines(block)
            yield f"{INDENT}break;"
        yield "default:"
        yield f"{INDENT}/* there is no other */"
        yield f"{INDENT}break;"
        yield "}"

    def _loop(self, count: int, index: str, body: Block) -> Iterator[str]:
        name = short(index)
        yield f"for (int32_t {name} = 0; {name} < {count}; {name}++) {{"
        condition, inner = going_on(index, body)
        if condition is not None:
            test = c_expression(opposite(condition), self.place)
            yield from (INDENT + line for line in tested("if", test, "", self.room - len(INDENT)))
            yield f"{2 * INDENT}break;"
            yield f"{INDENT}}}"
        yield from self.lines(inner)
        yield "}"

    def _wait(self, timer: str) -> str:
        """Return when the transition of a timer is due; nothing for other counters."""
        return next((_told(info) for info in self.program.transitions if info.timer == timer), "")

    def _count(
        self, timer: str, condition: Expr, limit: int, key: str, awaited: str
    ) -> Iterator[str]:
        yield from tested("if", c_expression(opposite(condition), self.place), key, self.room)
        yield f"{INDENT}{timer} = 0U;"
        yield f"}} else if ({timer} < {limit}U) {{"
        counted = wrapped(timer, "++", awaited, self.room - len(INDENT))
        yield from (INDENT + line for line in counted)
        yield from ELSE_NOTHING
        yield "}"


def _told(info: TransitionInfo) -> str:
    """Return when a transition is due, with the key of its wait."""
    if info.tunable:
        return f"due after more in a row than {info.key}.wait"
    return f"due at {info.ticks + 1} in a row: {info.key}.wait, {float(1000 * info.wait):g} ms"


def going_on(index: str, body: Block) -> tuple[Expr | None, Block]:
    """Return the condition under which a body does anything, where it has one, and what it does.

    Once that is false it stays so, for nothing else is done: the loop may end.
    """
    if len(body) == 1 and isinstance(body[0], Branch) and not body[0].other:
        inner = body[0]
        if index not in expr_names(inner.condition):
            return inner.condition, inner.then
    return None, body


def is_nested(choice: Select) -> bool:
    """Tell whether a choice leads to another one: it is read better as a chain of `if`."""
    return isinstance(choice.then, Select) or isinstance(choice.other, Select)


def decided(kind: str, target: str, value: Expr, place: Place, room: int = WIDTH) -> Iterator[str]:
    """Yield what sets a target, of a `kind` if it is declared here, to the one chosen of many."""
    if kind:
        yield f"{kind} {target};"
    if not isinstance(value, Select):
        yield from wrapped(f"{target} = ", c_expression(value, place), "", room)
        return
    opening = "if"
    while isinstance(value, Select):
        yield from tested(opening, c_expression(value.condition, place), "", room)
        inner = decided("", target, value.then, place, room - len(INDENT))
        yield from (INDENT + line for line in inner)
        opening, value = "} else if", value.other
    yield "} else {"
    inner = decided("", target, value, place, room - len(INDENT))
    yield from (INDENT + line for line in inner)
    yield "}"


def _cited(key: str) -> Iterator[str]:
    if key:
        yield f"/* {safe(key)} */"


def _comment(key: str) -> str:
    return f" /* {safe(key)} */" if key else ""


def wrapped(left: str, text: str, key: str, room: int = WIDTH) -> Iterator[str]:
    """Yield `left text;` with the key path cited, broken before operators where it is too long."""
    comment = _comment(key)
    if len(left) + len(text) + len(comment) < room:
        yield f"{left}{text};{comment}"
        return
    if key:
        yield f"/* {safe(key)} */"
    if len(left) + len(text) < room:
        yield f"{left}{text};"
        return
    pieces = textwrap.wrap(
        re.sub(r" ([*/]|[<>=!]=?|&&) ", "\1\\g<1>\1", text)
        .replace(" + ", " +\1")
        .replace(" - ", " -\1"),
        width=room - 2 * len(INDENT),
        initial_indent="",
        break_long_words=False,
        break_on_hyphens=False,
    )
    joined = "\n".join(pieces).replace("\1", " ")
    first, *rest = joined.split("\n")
    lines = [f"{left}{first}"] if len(left) + len(first) < room else [left.rstrip(), INDENT + first]
    lines += [INDENT + line for line in rest]
    lines[-1] += ";"
    yield from (line.rstrip() for line in lines)


def tested(opening: str, test: str, key: str, room: int) -> Iterator[str]:
    """Yield `opening (test) {` with the key path cited, broken before `&&` where it is too long."""
    line, comment = f"{opening} ({test}) {{", _comment(key)
    if len(line) + len(comment) <= room:
        yield line + comment
        return
    if key:
        yield f"/* {safe(key)} */"
    glued = re.sub("\1(&&|\\|\\|)\1", " \\1\1", line.replace(" ", "\1"))
    pieces = textwrap.wrap(
        glued,
        width=room - 2 * len(INDENT),
        subsequent_indent=INDENT,
        break_long_words=False,
        break_on_hyphens=False,
    )
    yield from (piece.replace("\1", " ") for piece in pieces)


def opposite(condition: Expr) -> Expr:
    """Return what is true where a condition is false; of an order, which NaN fails, by `not`."""
    match condition:
        case Unary("not", operand):
            return operand
        case Compare("==", left, right):
            return Compare("!=", left, right)
        case Compare("!=", left, right):
            return Compare("==", left, right)
    return Unary("not", condition)
