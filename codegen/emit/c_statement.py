"""C statements: prints the operations of a block as lines of C99 (rules C19 and C20)."""

from __future__ import annotations

import dataclasses
import re
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from codegen.emit.c_comment import sanitise_comment
from codegen.emit.c_expression import CNameMap, emit_expression
from codegen.passes.block_usage import Usage
from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Count,
    Expr,
    FaultBit,
    Loop,
    Op,
    RunBlock,
    Select,
    Store,
    Switch,
    Value,
)
from language.ir.program import Program, TransitionInfo, unqualified_name
from language.ir.traversal import expr_names, negate_condition

INDENT = "    "

EMPTY_BODY = f"{INDENT}/* nothing to do */"
"""The body of a block without operations."""

EMPTY_ELSE = ("} else {", EMPTY_BODY)
"""The `else` that ends a chain of `else if` (MISRA C:2012, rule 15.7)."""

MAX_LINE_WIDTH = 100
"""Maximum length of a line of generated C; longer expressions are broken at an operator or a
blank.
"""


@dataclass(frozen=True)
class StatementEmitter:
    """Prints the operations of one block.

    `local` holds the variables that are declared where they are assigned, `types` the C types of
    all variables, `width` the maximum length of a line.
    """

    program: Program
    usages: Mapping[str, Usage]
    local: frozenset[str]
    c_names: CNameMap
    types: Mapping[str, str]
    width: int = MAX_LINE_WIDTH

    def emit_block(self, block: Block) -> Iterator[str]:
        """Yield the lines of a block, indented by INDENT; EMPTY_BODY if it has no operations."""
        inner = dataclasses.replace(self, width=self.width - len(INDENT))
        if not block:
            yield EMPTY_BODY
        for op in block:
            for line in inner._emit_op(op):
                yield (INDENT + line) if line else ""

    def _emit_op(self, op: Op) -> Iterator[str]:
        """Yield the lines of one operation."""
        match op:
            case Assign(target, value, key):
                yield from self._emit_assign(
                    target, emit_expression(value, self.c_names), value, key
                )
            case Store(array, index, value):
                left = f"{self.c_names(array)}[{emit_expression(index, self.c_names)}]"
                yield from emit_wrapped_statement(
                    f"{left} = ", emit_expression(value, self.c_names), "", self.width
                )
            case Branch(condition, then, other):
                yield from self._emit_branch(condition, then, other)
            case Switch(selector, cases):
                yield from self._emit_choose(selector, cases)
            case Loop(count, index, body):
                yield from self._emit_loop(count, index, body)
            case Count(timer, condition, limit, key):
                yield from self._emit_count(
                    self.c_names(timer), condition, limit, key, self._wait_comment(timer)
                )
            case FaultBit(fault, _, True):
                yield f"self->faults |= {self.program.name}_FAULT_{fault};"
            case FaultBit(fault, _, _):
                yield f"self->faults &= (uint32_t)~{self.program.name}_FAULT_{fault};"
            case RunBlock(name):
                yield f"{name}({', '.join(self.usages[name].parameters)});"

    def _emit_assign(self, target: str, text: str, value: object, key: str) -> Iterator[str]:
        """Yield the lines of an assignment; `text` is the C text of its value.

        A nested choice becomes a chain of `if`.
        """
        if isinstance(value, Value) and type(value.value) is int:
            text = self.c_names.integer_constant(target, value.value)
        kind = self.types[target] if target in self.local else ""
        if isinstance(value, Select) and is_nested(value):
            yield from _emit_key_comment(key)
            yield from emit_select(kind, self.c_names(target), value, self.c_names, self.width)
        else:
            declared = f"const {kind} " if kind else ""
            yield from emit_wrapped_statement(
                f"{declared}{self.c_names(target)} = ", text, key, self.width
            )

    def _emit_branch(self, condition: Expr, then: Block, other: Block) -> Iterator[str]:
        """Yield the lines of an `if`; a branch alone in the other arm becomes `else if`."""
        yield from emit_condition("if", emit_expression(condition, self.c_names), "", self.width)
        yield from self.emit_block(then)
        chained = len(other) == 1 and isinstance(other[0], Branch)
        while len(other) == 1 and isinstance(other[0], Branch):
            inner = other[0]
            yield from emit_condition(
                "} else if", emit_expression(inner.condition, self.c_names), "", self.width
            )
            yield from self.emit_block(inner.then)
            other = inner.other
        if other:
            yield "} else {"
            yield from self.emit_block(other)
        elif chained:
            yield from EMPTY_ELSE
        yield "}"

    def _emit_choose(self, selector: str, cases: tuple[tuple[int, Block], ...]) -> Iterator[str]:
        """Yield the lines of a `switch` with an empty default."""
        yield f"switch ({self.c_names(selector)}) {{"
        for number, block in cases:
            yield f"case {self.c_names.integer_constant(selector, number)}:"
            yield from self.emit_block(block)
            yield f"{INDENT}break;"
        yield "default:"
        yield f"{INDENT}/* there is no other */"
        yield f"{INDENT}break;"
        yield "}"

    def _emit_loop(self, count: int, index: str, body: Block) -> Iterator[str]:
        """Yield the lines of a `for` loop.

        If the body has one condition that does not depend on the index, the loop ends early where
        that is false.
        """
        name = unqualified_name(index)
        yield f"for (int32_t {name} = 0; {name} < {count}; {name}++) {{"
        condition, inner = split_loop_guard(index, body)
        if condition is not None:
            test = emit_expression(negate_condition(condition), self.c_names)
            yield from (
                INDENT + line for line in emit_condition("if", test, "", self.width - len(INDENT))
            )
            yield f"{2 * INDENT}break;"
            yield f"{INDENT}}}"
        yield from self.emit_block(inner)
        yield "}"

    def _wait_comment(self, timer: str) -> str:
        """Return the comment that tells when the transition of a timer is due.

        Returns an empty text for other counters.
        """
        return next(
            (_format_due(info) for info in self.program.transitions if info.timer == timer), ""
        )

    def _emit_count(
        self, timer: str, condition: Expr, limit: int, key: str, wait_comment: str
    ) -> Iterator[str]:
        """Yield the lines of a counter: 0 if the condition is false, else one up (rule 4b)."""
        yield from emit_condition(
            "if", emit_expression(negate_condition(condition), self.c_names), key, self.width
        )
        yield f"{INDENT}{timer} = 0U;"
        yield f"}} else if ({timer} < {limit}U) {{"
        counted = emit_wrapped_statement(timer, "++", wait_comment, self.width - len(INDENT))
        yield from (INDENT + line for line in counted)
        yield from EMPTY_ELSE
        yield "}"


def _format_due(info: TransitionInfo) -> str:
    """Return the text that tells when a transition is due, with the key of its wait."""
    if info.tunable_wait:
        return f"due after more in a row than {info.key}.wait"
    return f"due at {info.ticks + 1} in a row: {info.key}.wait, {float(1000 * info.wait):g} ms"


def split_loop_guard(index: str, body: Block) -> tuple[Expr | None, Block]:
    """Return the condition of a loop body that is one branch, and the operations inside it.

    The branch must have no else part and its condition must not read `index`: then the loop may end
    when it is false once. A body of any other form is returned unchanged, with None.
    """
    if len(body) == 1 and isinstance(body[0], Branch) and not body[0].other:
        inner = body[0]
        if index not in expr_names(inner.condition):
            return inner.condition, inner.then
    return None, body


def is_nested(choice: Select) -> bool:
    """Tell whether the then or else value of a choice is itself a choice.

    Such a choice is printed as a chain of `if`, not as `?:`.
    """
    return isinstance(choice.then, Select) or isinstance(choice.other, Select)


def emit_select(
    declared_type: str, target: str, value: Expr, c_names: CNameMap, width: int = MAX_LINE_WIDTH
) -> Iterator[str]:
    """Yield the lines of an `if`, `else if` chain that assigns the chosen value to `target`.

    `target` is C text. If `declared_type` is not empty, the target is declared first with that
    type. A choice in a then part becomes a nested chain. A value that is no choice becomes one
    assignment.
    """
    if declared_type:
        yield f"{declared_type} {target};"
    if not isinstance(value, Select):
        yield from emit_wrapped_statement(
            f"{target} = ", emit_expression(value, c_names), "", width
        )
        return
    opening = "if"
    while isinstance(value, Select):
        yield from emit_condition(opening, emit_expression(value.condition, c_names), "", width)
        inner = emit_select("", target, value.then, c_names, width - len(INDENT))
        yield from (INDENT + line for line in inner)
        opening, value = "} else if", value.other
    yield "} else {"
    inner = emit_select("", target, value, c_names, width - len(INDENT))
    yield from (INDENT + line for line in inner)
    yield "}"


def _emit_key_comment(key: str) -> Iterator[str]:
    """Yield a comment line with a key path, or nothing if it is empty."""
    if key:
        yield f"/* {sanitise_comment(key)} */"


def _key_comment(key: str) -> str:
    """Return a comment with a key path that follows a statement, or an empty text."""
    return f" /* {sanitise_comment(key)} */" if key else ""


def emit_wrapped_statement(
    left: str, text: str, key: str, width: int = MAX_LINE_WIDTH
) -> Iterator[str]:
    """Yield the lines of `left`, `text` and `;`, with the comment `key` unless that is empty.

    The comment follows the statement if the line is then shorter than `width`; otherwise it is a
    line above it. A statement that does not fit is broken before an operator, or at another blank;
    further lines are indented by INDENT.
    """
    comment = _key_comment(key)
    if len(left) + len(text) + len(comment) < width:
        yield f"{left}{text};{comment}"
        return
    if key:
        yield f"/* {sanitise_comment(key)} */"
    if len(left) + len(text) < width:
        yield f"{left}{text};"
        return
    pieces = textwrap.wrap(
        re.sub(r" ([*/]|[<>=!]=?|&&) ", "\1\\g<1>\1", text)
        .replace(" + ", " +\1")
        .replace(" - ", " -\1"),
        width=width - 2 * len(INDENT),
        initial_indent="",
        break_long_words=False,
        break_on_hyphens=False,
    )
    joined = "\n".join(pieces).replace("\1", " ")
    first, *rest = joined.split("\n")
    lines = (
        [f"{left}{first}"] if len(left) + len(first) < width else [left.rstrip(), INDENT + first]
    )
    lines += [INDENT + line for line in rest]
    lines[-1] += ";"
    yield from (line.rstrip() for line in lines)


def emit_condition(opening: str, test: str, key: str, width: int) -> Iterator[str]:
    """Yield the lines of `opening (test) {`, with the comment `key` unless that is empty.

    The comment follows the brace if the line has at most `width` characters; otherwise it is a line
    above it, and the line is broken before `&&` or `||`.
    """
    line, comment = f"{opening} ({test}) {{", _key_comment(key)
    if len(line) + len(comment) <= width:
        yield line + comment
        return
    if key:
        yield f"/* {sanitise_comment(key)} */"
    glued = re.sub("\1(&&|\\|\\|)\1", " \\1\1", line.replace(" ", "\1"))
    pieces = textwrap.wrap(
        glued,
        width=width - 2 * len(INDENT),
        subsequent_indent=INDENT,
        break_long_words=False,
        break_on_hyphens=False,
    )
    yield from (piece.replace("\1", " ") for piece in pieces)
