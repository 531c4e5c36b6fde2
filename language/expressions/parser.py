"""Parser: the text of an expression or a balance to its syntax tree, or to a problem.

The span of a problem lies inside the text.
"""

from __future__ import annotations

import re

import lark

from language.expressions.ast_builder import build_trees
from language.expressions.migration_hints import increment_hint
from language.expressions.name_rules import COMMA_HINT
from language.expressions.number_literal import (
    DECIMAL_PATTERN,
    QUANTITY_PATTERN,
    parse_number_literal,
    parse_quantity_literal,
)
from language.expressions.parse_tree import parse_shape
from language.expressions.syntax_tree import Name, Power, SyntaxTree, children, depth
from language.expressions.tokens import KEYWORDS
from language.expressions.units import unit_hint, unit_without_parentheses
from language.text.diagnostic import Problems, Span, SpecError
from language.text.document import ScalarNode

FOREIGN_OPERATORS = {"&&": "and", "||": "or", "~=": "!=", "**": "^", "!": "not", "~": "not"}
"""Operators of other languages, and the operators of this language with the same meaning."""

SIMPLE_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
MAX_EXPRESSION_LENGTH = 2000
"""Longest expression that is parsed [characters]."""
MAX_DEPTH = 100
"""Largest depth of a tree; a sum of 100 terms has it."""
MAX_EXPANDED_SIZE = 10_000
"""Largest number of operands and operations after each power is written as multiplications.

An expression of MAX_EXPRESSION_LENGTH without nested powers stays below it.
"""


def parse_expression(scalar: ScalarNode) -> SyntaxTree:
    """Return the tree of an expression.

    Raises SpecError, with the place inside the text, for a text that is not an expression, is
    longer than MAX_EXPRESSION_LENGTH, has a line break, gives a tree deeper than MAX_DEPTH or
    expands to more than MAX_EXPANDED_SIZE parts, and for a number, unit or exponent that is not
    valid. Names and types are not checked.
    """
    (tree,) = _parse(scalar, "expression")
    return tree


def parse_balance(scalar: ScalarNode) -> tuple[SyntaxTree, SyntaxTree]:
    """Return the trees of both sides of a balance `left = right`, which has exactly one `=`.

    The form of the left side is not checked. Raises SpecError as `parse_expression`.
    """
    left, right = _parse(scalar, "balance")
    return left, right


def _parse(scalar: ScalarNode, start_rule: str) -> tuple[SyntaxTree, ...]:
    """Return the trees of a text for a start rule of the grammar. Raises SpecError."""
    text, span = scalar.text, scalar.text_span
    problems = Problems()
    if len(text) > MAX_EXPRESSION_LENGTH:
        problems.error("expression", span, f"an expression of {len(text)} characters is too long")
    if "\n" in text:
        problems.error("expression", span, "an expression is written on one line")
    problems.raise_if_errors()
    simple = _parse_simple(text, span) if start_rule == "expression" else None
    if simple is not None:
        return (simple,)
    try:
        shape = parse_shape(text, start_rule)
        trees = build_trees(shape, span)
        if shape.depth > MAX_DEPTH and any(depth(tree) > MAX_DEPTH for tree in trees):
            problems.error("expression", span, "the expression is nested too deeply")
        elif "^" in text and any(_expanded_size(tree) > MAX_EXPANDED_SIZE for tree in trees):
            label = f"the powers in this expression have more than {MAX_EXPANDED_SIZE} factors"
            problems.error("power", span, label, "write an equation for the inner power")
        else:
            return trees
    except lark.exceptions.UnexpectedInput as error:
        problems.error("expression", *_explain_syntax_error(text, span, start_rule, error))
    except RecursionError:
        problems.error("expression", span, "the expression is nested too deeply")
    raise SpecError(problems.reported)


def _expanded_size(tree: SyntaxTree) -> int:
    """Return the number of parts of a tree if `x^n` is counted as n factors.

    A nested power such as `(x^2)^2` repeats its base; the number grows by the product of all
    exponents.
    """
    size = 1 + sum(_expanded_size(part) for part in children(tree))
    return size * max(abs(tree.exponent), 1) if isinstance(tree, Power) else size


def _parse_simple(text: str, span: Span) -> SyntaxTree | None:
    """Return the tree of a single name or literal without the grammar; None for another text.

    Most values of a spec are of this form.
    """
    if SIMPLE_NAME.fullmatch(text) and text not in KEYWORDS:
        return Name(text, span.subspan(0, len(text)))
    if DECIMAL_PATTERN.fullmatch(text):
        return parse_number_literal(text, span.subspan(0, len(text)))
    if QUANTITY_PATTERN.fullmatch(text) and text.partition(" ")[2] not in KEYWORDS:
        return parse_quantity_literal(text, span.subspan(0, len(text)))
    return None


def _explain_syntax_error(
    text: str, span: Span, start_rule: str, error: lark.exceptions.UnexpectedInput
) -> tuple[Span, str, str]:
    """Return the span, the label and the help text for a syntax error."""
    column = getattr(error, "column", 0)
    token = str(getattr(error, "token", "")) or ""
    ended = (
        getattr(getattr(error, "token", None), "type", "") == "$END"
        or column < 1
        or (not token and column > len(text))
        or token == "$END"
    )
    place = span.subspan(len(text)) if ended else span.subspan(column - 1, len(token))
    if start_rule == "balance" and "=" not in text:
        return span, "a balance is `coefficient * der(x) = ...`", ""
    if text.count("(") > text.count(")"):
        return place, "a `(` is not closed", COMMA_HINT
    if ended or not text.strip():
        return place, "the expression ends too early", ""
    rest = text[column - 1 :]
    if rest.startswith("[") and text.endswith("]"):
        label = "a condition stands without brackets"
        return span.subspan(0, len(text)), label, f"it is written `{text[1:-1].strip()}`"
    if re.match(r"(\+\+|--|[-+*/]=)", text[max(column - 2, 0) :]) or rest.startswith("+="):
        return place, f"`{rest.split(' ')[0][:20]}` was not expected here", increment_hint(text)
    if token in ("<", "<=", ">", ">=", "==", "!="):
        return place, "an expression has one relation only", "write `a < b and b < c`"
    for foreign, ours in FOREIGN_OPERATORS.items():
        at = text.find(foreign, max(column - 2, 0), column - 1 + len(foreign))
        if at >= 0:
            label = f"`{foreign}` is not part of an expression"
            return span.subspan(at, len(foreign)), label, f"it is written `{ours}`"
    if rest.startswith("="):
        return place, "`=` is not part of an expression", "equality is written `==`"
    unit = re.match(r"1/\([^()]+\)", rest)
    if unit and unit_without_parentheses(unit.group()):
        label = f"`{unit.group()}` is not written as a unit"
        return span.subspan(column - 1, len(unit.group())), label, unit_hint(unit.group())
    hint = "there is no implied multiplication" if re.match(r"[A-Za-z0-9(]", rest) else ""
    if re.match(r",\d", rest):
        hint = "a decimal point is a point: `12.5`"
    return place, f"`{rest.split(' ')[0][:20]}` was not expected here", hint
