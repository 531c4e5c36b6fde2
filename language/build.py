"""Build: the tree of an expression from its shape and its tokens, each part with its place."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from language.grammar import Parsed, Shape
from language.problem import Problems, Span, SpecError
from language.quantity import number, quantity
from language.syntax import (
    Application,
    Arithmetic,
    Choice,
    Logic,
    Name,
    Negative,
    Not,
    Number,
    Power,
    Relation,
    Tree,
    Truth,
)

MAX_POWER = 8


def built(parsed: Parsed, span: Span) -> tuple[Tree, ...]:
    """Return the tree of an expression, or both sides of a balance; `span` is that of the text.

    Raises SpecError for a number, a unit or a power that is none.
    """
    build = _Build(parsed, span)
    return tuple(build.part(part) for part in parsed.shape[1])


class _Build:
    """From shapes to trees; a part is a tree, or the number of a token."""

    def __init__(self, parsed: Parsed, span: Span) -> None:
        self.texts = parsed.texts
        self.starts = parsed.starts
        self.span = span

    def part(self, shape: Shape | int) -> Any:
        if isinstance(shape, int):
            return shape
        return RULES[shape[0]](self, [self.part(part) for part in shape[1]])

    def at(self, token: int) -> Span:
        """Return the place of a token."""
        return self.inside(self.starts[token], len(self.texts[token]))

    def inside(self, start: int, width: int) -> Span:
        """Return the place of a part of the text, which has at least one character."""
        span = self.span
        return span if span.whole else Span(span.source, span.line, span.column + start, width)

    def over(self, first: Any, last: Any) -> Span:
        """Return the place from one part to another."""
        start = self.at(first) if isinstance(first, int) else first.span
        end = self.at(last) if isinstance(last, int) else last.span
        return Span(start.source, start.line, start.column, end.column + end.width - start.column)


def _path(build: _Build, parts: list[int]) -> Tree:
    first, last = parts[0], parts[-1]
    path = build.texts[first] if first == last else ".".join(build.texts[k] for k in parts)
    start, end = build.starts[first], build.starts[last] + len(build.texts[last])
    return Name(path, build.inside(start, end - start))


def _call(build: _Build, parts: list[Any]) -> Tree:
    name, *arguments, close = parts
    return Application(name.path, tuple(arguments), build.over(name, close))


def _negative(build: _Build, parts: list[Any]) -> Tree:
    minus, operand = parts
    if isinstance(operand, Number) and operand.unit.offset:
        below = 2 * operand.unit.offset - operand.value
        return Number(below, operand.unit, operand.span)
    return Negative(operand, build.over(minus, operand))


def _power(build: _Build, parts: list[Any]) -> Tree:
    base, token = parts
    exponent = int(build.texts[token])
    if abs(exponent) > MAX_POWER:
        problems = Problems()
        label = f"a power is at most {MAX_POWER}"
        problems.error("power", build.at(token), label, "multiply two powers: `x^8 * x`")
        raise SpecError(problems.found)
    return Power(base, exponent, build.over(base, token))


def _binary(build: _Build, parts: list[Any]) -> Tree:
    left, operator, right = parts
    return Arithmetic(build.texts[operator], left, right, build.over(left, right))


def _compare(build: _Build, parts: list[Any]) -> Tree:
    left, operator, right = parts
    return Relation(build.texts[operator], left, right, build.over(left, right))


def _select(build: _Build, parts: list[Any]) -> Tree:
    condition, then, other = parts
    return Choice(condition, then, other, build.over(condition, other))


RULES: Mapping[str, Callable[[_Build, list[Any]], Tree]] = {
    "number": lambda build, parts: number(build.texts[parts[0]], build.at(parts[0])),
    "quantity": lambda build, parts: quantity(build.texts[parts[0]], build.at(parts[0])),
    "true": lambda build, parts: Truth(True, build.at(parts[0])),
    "false": lambda build, parts: Truth(False, build.at(parts[0])),
    "path": _path,
    "call": _call,
    "negative": _negative,
    "not_": lambda build, parts: Not(parts[1], build.over(*parts)),
    "power_of": _power,
    "binary": _binary,
    "compare": _compare,
    "or_": lambda build, parts: Logic("or", parts[0], parts[1], build.over(*parts)),
    "and_": lambda build, parts: Logic("and", parts[0], parts[1], build.over(*parts)),
    "select": _select,
}
"""What each rule of the grammar makes of its parts."""
