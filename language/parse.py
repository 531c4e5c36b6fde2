"""Parse: the text of an expression or balance to its tree, or a problem at the right place."""

from __future__ import annotations

import re
import sys
from fractions import Fraction
from functools import cache
from importlib import resources
from typing import Any

import lark

from language.document import Scalar
from language.names import COMMA_HINT
from language.problem import Problems, Span, SpecError
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
    depth,
)
from language.units import NO_UNIT, UNIT, Unit, UnitError, parse_unit, unit_hint

FOREIGN = {"&&": "and", "||": "or", "~=": "!=", "**": "^", "!": "not", "~": "not"}
"""Operators of other languages, and how they are written here."""
UNIT_HINT = "a unit is written like `W`, `N*m`, `1/s`, a product with `*`: `2 * x`"

DECIMAL = re.compile(r"(0|[1-9]\d*)(\.\d+)?([eE][-+]?\d+)?")
SIMPLE_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
SIMPLE_QUANTITY = re.compile(rf"{DECIMAL.pattern} {UNIT.pattern}")
WORDS = frozenset({"if", "then", "else", "and", "or", "not", "true", "false"})
MAX_TEXT = 2000
"""Longest expression read; longer ones want an equation of their own."""
MAX_POWER = 8
MAX_DEPTH = 100
"""Deepest tree: a sum of 100 terms; more want an equation of their own."""
LARGEST = Fraction(sys.float_info.max)
MAX_EXPONENT = 330
"""Largest decimal exponent that is looked at: beyond it a double over- or underflows."""


def parse_expression(scalar: Scalar) -> Tree:
    """Parse an expression. Raises SpecError with the place inside the text."""
    tree: Tree = _parse(scalar, "expression")
    return tree


def parse_balance(scalar: Scalar) -> tuple[Tree, Tree]:
    """Parse `left = right`. Raises SpecError with the place inside the text."""
    left, right = _parse(scalar, "balance")
    return left, right


def decimal(text: str, span: Span) -> Fraction:
    """Return the exact value of a decimal literal. Raises SpecError for other forms."""
    problems = Problems()
    if re.fullmatch(r"\d+[eE][-+]?\d+", text):
        digits, exponent = re.split("[eE]", text)
        hint = f"write `{digits}.0e{exponent}`: other YAML tools read `{text}` as a text"
        problems.error("number", span, f"`{text}` has an exponent but no point", hint)
    elif re.fullmatch(r"0\d+.*", text):
        shorter = re.sub(r"^0+(?=\d)", "", text)
        hint = f"write `{shorter}`: other YAML tools read `{text}` as octal"
        problems.error("number", span, f"`{text}` starts with a zero", hint)
    elif not DECIMAL.fullmatch(text):
        hint = _apart(text) or "write it as `1.0e-3` or `12.5`"
        problems.error("number", span, f"`{text}` is not a number", hint)
    elif abs(_exponent(text)) > MAX_EXPONENT:
        problems.error("number", span, f"`{text}` is out of the range of a double")
    problems.stop_if_any()
    return Fraction(text)


def _apart(text: str) -> str:
    """Return how `100ms` is written, or an empty text where this is no number before a unit."""
    found = re.fullmatch(r"([0-9.]+?)\.?([A-Za-z].*)", text)
    if not found or not DECIMAL.fullmatch(found[1]):
        return ""
    try:
        parse_unit(found[2])
    except UnitError:
        return ""
    return f"one blank stands before the unit: `{found[1]} {found[2]}`"


def _in_range(value: Fraction, text: str, span: Span) -> Fraction:
    if abs(value) > LARGEST:
        problems = Problems()
        label = f"`{text}` is out of the range of a double"
        problems.error("number", span, label)
        raise SpecError(problems.found)
    return value


def _exponent(text: str) -> int:
    parts = re.split("[eE]", text)
    return int(parts[1]) if len(parts) == 2 else 0


@cache
def _parser(start: str) -> lark.Lark:
    grammar = resources.files("language").joinpath("expression.lark").read_text("utf-8")
    return lark.Lark(grammar, parser="lalr", start=start)


def _parse(scalar: Scalar, start: str) -> Any:
    text, span = scalar.text, scalar.text_span
    problems = Problems()
    if len(text) > MAX_TEXT:
        problems.error("expression", span, f"an expression of {len(text)} characters is too long")
    if "\n" in text:
        problems.error("expression", span, "an expression stands on one line")
    problems.stop_if_any()
    simple = _simple(text, span) if start == "expression" else None
    if simple is not None:
        return simple
    try:
        tree = _parser(start).parse(text)
        built = _Build(span).transform(tree)
        if any(
            depth(part) > MAX_DEPTH for part in (built if isinstance(built, tuple) else (built,))
        ):
            problems.error("expression", span, "the expression is nested too deeply")
            problems.stop_if_any()
        return built
    except lark.exceptions.VisitError as error:
        if not isinstance(error.orig_exc, RecursionError):
            raise error.orig_exc from None
        problems.error("expression", span, "the expression is nested too deeply")
    except lark.exceptions.UnexpectedInput as error:
        problems.error("expression", *_explain(text, span, start, error))
    except RecursionError:
        problems.error("expression", span, "the expression is nested too deeply")
    raise SpecError(problems.found)


def _simple(text: str, span: Span) -> Tree | None:
    """Return a name or a literal without the parser: most values of a spec are one."""
    build, token = _Build(span), lark.Token("SIMPLE", text, start_pos=0)
    if SIMPLE_NAME.fullmatch(text) and text not in WORDS:
        return Name(text, span.inside(0, len(text)))
    tree: Tree | None = None
    if DECIMAL.fullmatch(text):
        tree = build.number([token])
    elif SIMPLE_QUANTITY.fullmatch(text) and text.partition(" ")[2] not in WORDS:
        tree = build.quantity([token])
    return tree


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


def _unit(text: str, span: Span) -> Unit:
    try:
        return parse_unit(text)
    except UnitError as error:
        problems = Problems()
        hint = unit_hint(text) or UNIT_HINT
        problems.error("unit", span, str(error), hint)
        raise SpecError(problems.found) from None


class _Build(lark.Transformer[Any, Any]):
    """From lark's tree to ours, bottom up."""

    def __init__(self, span: Span) -> None:
        super().__init__()
        self.text = span

    def _at(self, token: lark.Token) -> Span:
        return self.text.inside(token.start_pos or 0, len(token))

    def _between(self, first: lark.Token, last: lark.Token) -> Span:
        width = (last.end_pos or 0) - (first.start_pos or 0)
        return self.text.inside(first.start_pos or 0, width)

    def _over(self, first: Any, last: Any) -> Span:
        """Return the place from one part to another; a part is a tree or a token."""
        start, end = (
            self._at(part) if isinstance(part, lark.Token) else part.span for part in (first, last)
        )
        return Span(start.source, start.line, start.column, end.column + end.width - start.column)

    def expression(self, items: list[Any]) -> Any:
        return items[0]

    def balance(self, items: list[Any]) -> Any:
        return items[0], items[1]

    def number(self, items: list[Any]) -> Any:
        span = self._at(items[0])
        return Number(_in_range(decimal(str(items[0]), span), str(items[0]), span), NO_UNIT, span)

    def quantity(self, items: list[Any]) -> Any:
        digits, _, text = str(items[0]).partition(" ")
        span = self._at(items[0])
        value = decimal(digits, span.inside(0, len(digits)))
        unit = _unit(text, span.inside(len(digits) + 1, len(text)))
        return Number(_in_range(value * unit.factor + unit.offset, str(items[0]), span), unit, span)

    def true(self, items: list[Any]) -> Any:
        return Truth(True, self._at(items[0]))

    def false(self, items: list[Any]) -> Any:
        return Truth(False, self._at(items[0]))

    def path(self, items: list[Any]) -> Any:
        return Name(".".join(items), self._between(items[0], items[-1]))

    def call(self, items: list[Any]) -> Any:
        name, *arguments, close = items
        return Application(name.path, tuple(arguments), self._over(name, close))

    def negative(self, items: list[Any]) -> Any:
        minus, operand = items
        if isinstance(operand, Number) and operand.unit.offset:
            below = 2 * operand.unit.offset - operand.value
            return Number(below, operand.unit, operand.span)
        return Negative(operand, self._over(minus, operand))

    def not_(self, items: list[Any]) -> Any:
        word, operand = items
        return Not(operand, self._over(word, operand))

    def power_of(self, items: list[Any]) -> Any:
        base, token = items
        if abs(int(token)) > MAX_POWER:
            problems = Problems()
            problems.error(
                "power",
                self._at(token),
                f"a power is at most {MAX_POWER}",
                "multiply two powers: `x^8 * x`",
            )
            raise SpecError(problems.found)
        return Power(base, int(token), self._over(base, token))

    def binary(self, items: list[Any]) -> Any:
        left, operator, right = items
        return Arithmetic(str(operator), left, right, self._over(left, right))

    def compare(self, items: list[Any]) -> Any:
        left, operator, right = items
        return Relation(str(operator), left, right, self._over(left, right))

    def or_(self, items: list[Any]) -> Any:
        return Logic("or", items[0], items[1], self._over(items[0], items[1]))

    def and_(self, items: list[Any]) -> Any:
        return Logic("and", items[0], items[1], self._over(items[0], items[1]))

    def select(self, items: list[Any]) -> Any:
        condition, then, other = items
        return Choice(condition, then, other, self._over(condition, other))
