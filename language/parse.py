"""Parse: the text of an expression or balance to its tree, or a problem at the right place."""

from __future__ import annotations

import re

import lark

from language.aliases import stepped
from language.build import built
from language.document import Scalar
from language.grammar import parsed
from language.names import COMMA_HINT
from language.problem import Problems, Span, SpecError
from language.quantity import DECIMAL, QUANTITY, number, quantity
from language.syntax import Name, Tree, depth

FOREIGN = {"&&": "and", "||": "or", "~=": "!=", "**": "^", "!": "not", "~": "not"}
"""Operators of other languages, and how they are written here."""

SIMPLE_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
WORDS = frozenset({"if", "then", "else", "and", "or", "not", "true", "false"})
MAX_TEXT = 2000
"""Longest expression read; longer ones want an equation of their own."""
MAX_DEPTH = 100
"""Deepest tree: a sum of 100 terms; more want an equation of their own."""


def parse_expression(scalar: Scalar) -> Tree:
    """Parse an expression. Raises SpecError with the place inside the text."""
    (tree,) = _parse(scalar, "expression")
    return tree


def parse_balance(scalar: Scalar) -> tuple[Tree, Tree]:
    """Parse `left = right`. Raises SpecError with the place inside the text."""
    left, right = _parse(scalar, "balance")
    return left, right


def _parse(scalar: Scalar, start: str) -> tuple[Tree, ...]:
    text, span = scalar.text, scalar.text_span
    problems = Problems()
    if len(text) > MAX_TEXT:
        problems.error("expression", span, f"an expression of {len(text)} characters is too long")
    if "\n" in text:
        problems.error("expression", span, "an expression stands on one line")
    problems.stop_if_any()
    simple = _simple(text, span) if start == "expression" else None
    if simple is not None:
        return (simple,)
    try:
        found = parsed(text, start)
        trees = built(found, span)
        if found.depth <= MAX_DEPTH or all(depth(tree) <= MAX_DEPTH for tree in trees):
            return trees
        problems.error("expression", span, "the expression is nested too deeply")
    except lark.exceptions.UnexpectedInput as error:
        problems.error("expression", *_explain(text, span, start, error))
    except RecursionError:
        problems.error("expression", span, "the expression is nested too deeply")
    raise SpecError(problems.found)


def _simple(text: str, span: Span) -> Tree | None:
    """Return a name or a literal without the parser: most values of a spec are one."""
    if SIMPLE_NAME.fullmatch(text) and text not in WORDS:
        return Name(text, span.inside(0, len(text)))
    if DECIMAL.fullmatch(text):
        return number(text, span.inside(0, len(text)))
    if QUANTITY.fullmatch(text) and text.partition(" ")[2] not in WORDS:
        return quantity(text, span.inside(0, len(text)))
    return None


def _explain(
    text: str, span: Span, start: str, error: lark.exceptions.UnexpectedInput
) -> tuple[Span, str, str]:
    column = getattr(error, "column", 0)
    found = str(getattr(error, "token", "")) or ""
    ended = (
        getattr(getattr(error, "token", None), "type", "") == "$END"
        or column < 1
        or (not found and column > len(text))
        or found == "$END"
    )
    place = span.inside(len(text)) if ended else span.inside(column - 1, len(found))
    if start == "balance" and "=" not in text:
        return span, "a balance is `coefficient * der(x) = ...`", ""
    if text.count("(") > text.count(")"):
        return place, "a `(` is not closed", COMMA_HINT
    if ended or not text.strip():
        return place, "the expression ends too early", ""
    rest = text[column - 1 :]
    if rest.startswith("[") and text.endswith("]"):
        label = "a condition stands without brackets"
        return span.inside(0, len(text)), label, f"it is written `{text[1:-1].strip()}`"
    if re.match(r"(\+\+|--|[-+*/]=)", text[max(column - 2, 0) :]) or rest.startswith("+="):
        return place, f"`{rest.split(' ')[0][:20]}` was not expected here", stepped(text)
    if found in ("<", "<=", ">", ">=", "==", "!="):
        return place, "one relation only", "write `a < b and b < c`"
    for foreign, ours in FOREIGN.items():
        at = text.find(foreign, max(column - 2, 0), column - 1 + len(foreign))
        if at >= 0:
            label = f"`{foreign}` is not part of an expression"
            return span.inside(at, len(foreign)), label, f"it is written `{ours}`"
    if rest.startswith("="):
        return place, "`=` is not part of an expression", "equality is written `==`"
    hint = "there is no implied multiplication" if re.match(r"[A-Za-z0-9(]", rest) else ""
    if re.match(r",\d", rest):
        hint = "a decimal point is a point: `12.5`"
    return place, f"`{rest.split(' ')[0][:20]}` was not expected here", hint
