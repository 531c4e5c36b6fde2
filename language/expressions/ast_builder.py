"""AST builder: the syntax tree of an expression from its shape and its tokens, with spans."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from language.expressions.number_literal import parse_number_literal, parse_quantity_literal
from language.expressions.parse_tree import ParsedShape, ParseShape
from language.expressions.syntax_tree import (
    Arithmetic,
    BoolLiteral,
    Conditional,
    FunctionCall,
    Logic,
    Name,
    Negation,
    Not,
    NumberLiteral,
    Power,
    Relation,
    SyntaxTree,
)
from language.text.diagnostic import Problem, Span, SpecError

MAX_POWER = 8
"""Largest size of the exponent in `x^n`."""


def build_trees(parsed: ParsedShape, span: Span) -> tuple[SyntaxTree, ...]:
    """Return the tree of an expression, or the trees of both sides (left, right) of a balance.

    `span` is the span of the whole text. Raises SpecError at the first number ("number"), unit
    ("unit") or exponent above MAX_POWER in size ("power") that is not valid.
    """
    builder = _AstBuilder(parsed, span)
    return tuple(builder.build_part(part) for part in parsed.shape[1])


class _AstBuilder:
    """Builder of trees from a shape.

    A part of a shape is another shape or the number of a token.
    """

    def __init__(self, parsed: ParsedShape, span: Span) -> None:
        self.texts = parsed.texts
        self.starts = parsed.offsets
        self.span = span

    def build_part(self, shape: ParseShape | int) -> Any:
        """Return the tree of a shape, built from its parts.

        The number of a token is returned unchanged.
        """
        if isinstance(shape, int):
            return shape
        return BUILDERS[shape[0]](self, [self.build_part(part) for part in shape[1]])

    def token_span(self, token: int) -> Span:
        """Return the span of a token."""
        return self.text_span(self.starts[token], len(self.texts[token]))

    def text_span(self, start: int, width: int) -> Span:
        """Return the span of a part of the text; an atomic span is returned whole."""
        span = self.span
        return span if span.is_atomic else Span(span.source, span.line, span.column + start, width)

    def joined_span(self, first: Any, last: Any) -> Span:
        """Return the span from the start of one part to the end of another.

        A part is a tree or a token.
        """
        start = self.token_span(first) if isinstance(first, int) else first.span
        end = self.token_span(last) if isinstance(last, int) else last.span
        return Span(start.source, start.line, start.column, end.column + end.width - start.column)


def _build_name(builder: _AstBuilder, parts: list[int]) -> SyntaxTree:
    """Return the name of a dotted path; blanks around the dots are removed."""
    first, last = parts[0], parts[-1]
    path = builder.texts[first] if first == last else ".".join(builder.texts[k] for k in parts)
    start, end = builder.starts[first], builder.starts[last] + len(builder.texts[last])
    return Name(path, builder.text_span(start, end - start))


def _build_call(builder: _AstBuilder, parts: list[Any]) -> SyntaxTree:
    """Return the call of a function; its span ends with the closing parenthesis."""
    name, *arguments, close = parts
    return FunctionCall(name.path, tuple(arguments), builder.joined_span(name, close))


def _build_negation(builder: _AstBuilder, parts: list[Any]) -> SyntaxTree:
    """Return the negation of an operand; `-5 degC` becomes the literal of that temperature."""
    minus, operand = parts
    if isinstance(operand, NumberLiteral) and operand.unit.offset:
        below = 2 * operand.unit.offset - operand.value
        return NumberLiteral(below, operand.unit, operand.span)
    return Negation(operand, builder.joined_span(minus, operand))


def _build_power(builder: _AstBuilder, parts: list[Any]) -> SyntaxTree:
    """Return the power. Raises SpecError if the exponent is above MAX_POWER in size."""
    base, token = parts
    exponent = int(builder.texts[token])
    if abs(exponent) > MAX_POWER:
        label = f"a power is at most {MAX_POWER}"
        raise SpecError(
            [Problem("power", builder.token_span(token), label, "multiply two powers: `x^8 * x`")]
        )
    return Power(base, exponent, builder.joined_span(base, token))


def _build_arithmetic(builder: _AstBuilder, parts: list[Any]) -> SyntaxTree:
    """Return the sum, difference, product or quotient of two trees."""
    left, operator, right = parts
    return Arithmetic(builder.texts[operator], left, right, builder.joined_span(left, right))


def _build_relation(builder: _AstBuilder, parts: list[Any]) -> SyntaxTree:
    """Return the relation of two trees."""
    left, operator, right = parts
    return Relation(builder.texts[operator], left, right, builder.joined_span(left, right))


def _build_conditional(builder: _AstBuilder, parts: list[Any]) -> SyntaxTree:
    """Return the conditional expression; its span starts at the condition."""
    condition, then, other = parts
    return Conditional(condition, then, other, builder.joined_span(condition, other))


BUILDERS: Mapping[str, Callable[[_AstBuilder, list[Any]], SyntaxTree]] = {
    "number": lambda build, parts: parse_number_literal(
        build.texts[parts[0]], build.token_span(parts[0])
    ),
    "quantity": lambda build, parts: parse_quantity_literal(
        build.texts[parts[0]], build.token_span(parts[0])
    ),
    "true": lambda build, parts: BoolLiteral(True, build.token_span(parts[0])),
    "false": lambda build, parts: BoolLiteral(False, build.token_span(parts[0])),
    "path": _build_name,
    "call": _build_call,
    "negative": _build_negation,
    "not_": lambda build, parts: Not(parts[1], build.joined_span(*parts)),
    "power_of": _build_power,
    "binary": _build_arithmetic,
    "compare": _build_relation,
    "or_": lambda build, parts: Logic("or", parts[0], parts[1], build.joined_span(*parts)),
    "and_": lambda build, parts: Logic("and", parts[0], parts[1], build.joined_span(*parts)),
    "select": _build_conditional,
}
"""Builder function of each rule of the grammar."""
