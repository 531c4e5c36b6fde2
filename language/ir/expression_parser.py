"""Parser of the text of an expression, as `format_expr` prints it."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import get_args

from language.ir.ops import (
    Binary,
    BinaryOperator,
    Call,
    Compare,
    Expr,
    Item,
    Ref,
    Relation,
    Select,
    Unary,
    Value,
)

TOKEN = re.compile(
    r"(?P<number>-?(?:\d+(?:\.\d+)?(?:e[+-]?\d+)?|inf(?![\w.])|nan(?![\w.])))"
    r"|(?P<name>[A-Za-z_][\w.]*)"
    r"|(?P<sign><=|>=|==|!=|[-+*/<>()\[\],])"
)
WORDS = frozenset({"if", "then", "else", "not", "and", "or"})
"""Words of the notation; no variable and no function has one of these names."""


class ExpressionSyntaxError(ValueError):
    """A text that is no expression of a Program."""


def parse_expression_text(text: str, whole: Collection[str]) -> Expr:
    """Return the expression of a text of `format_expr`.

    `whole` are the names of whole numbers; references to them are marked so. Raises
    ExpressionSyntaxError with the column.
    """
    reader = _Reader(text, whole)
    expr = reader.read_expression()
    if reader.position < len(reader.tokens):
        raise reader.error("the end")
    return expr


class _Reader:
    """A reader of the tokens of one expression; `position` is the index of the next token."""

    def __init__(self, text: str, whole: Collection[str]) -> None:
        self.text = text
        self.whole = whole
        self.tokens: list[tuple[str, int]] = []
        self.position = 0
        place = 0
        while place < len(text):
            if text[place] == " ":
                place += 1
                continue
            match = TOKEN.match(text, place)
            if match is None:
                raise ExpressionSyntaxError(f"column {place + 1}: unexpected `{text[place]}`")
            self.tokens.append((match[0], place))
            place = match.end()

    @property
    def token(self) -> str:
        """The next token, empty at the end."""
        return self.tokens[self.position][0] if self.position < len(self.tokens) else ""

    def error(self, wanted: str) -> ExpressionSyntaxError:
        """Return an error at the next token."""
        column = (
            self.tokens[self.position][1] if self.position < len(self.tokens) else len(self.text)
        )
        found = f"`{self.token}`" if self.token else "the end"
        return ExpressionSyntaxError(f"column {column + 1}: {found} instead of {wanted}")

    def take(self, wanted: str = "") -> str:
        """Return the next token and go on; raise an error if it is not the wanted one."""
        token = self.token
        if not token or (wanted and token != wanted):
            raise self.error(f"`{wanted}`" if wanted else "an expression")
        self.position += 1
        return token

    def read_expression(self) -> Expr:
        """Return the expression at the next token."""
        token = self.take()
        if token == "(":
            expr = self._read_operation()
            self.take(")")
            return expr
        if token in ("True", "False"):
            return Value(token == "True")
        if token[-1].isdigit() and (token[0].isdigit() or token[0] == "-"):
            return Value(int(token) if token.lstrip("-").isdigit() else float(token))
        if token.lstrip("-") in ("inf", "nan"):
            return Value(float(token))
        if token in WORDS or not re.match("[A-Za-z_]", token):
            self.position -= 1
            raise self.error("an expression")
        return self._read_named(token)

    def _read_named(self, name: str) -> Expr:
        """Return a call, an element of an array or a reference."""
        if self.token == "(":
            self.take()
            arguments: list[Expr] = []
            while self.token != ")":
                if arguments:
                    self.take(",")
                arguments.append(self.read_expression())
            self.take(")")
            return Call(name, tuple(arguments))
        is_whole = name in self.whole
        if self.token == "[":
            self.take()
            index = self.read_expression()
            self.take("]")
            return Item(name, index, is_whole)
        return Ref(name, is_whole)

    def _read_operation(self) -> Expr:
        """Return the operation behind an opening parenthesis."""
        if self.token == "if":
            self.take()
            condition = self.read_expression()
            self.take("then")
            then = self.read_expression()
            self.take("else")
            return Select(condition, then, self.read_expression())
        if self.token == "-":
            self.take()
            return Unary("-", self.read_expression())
        if self.token == "not":
            self.take()
            return Unary("not", self.read_expression())
        left = self.read_expression()
        for operator in get_args(BinaryOperator):
            if self.token == operator:
                self.take()
                return Binary(operator, left, self.read_expression())
        for relation in get_args(Relation):
            if self.token == relation:
                self.take()
                return Compare(relation, left, self.read_expression())
        raise self.error("an operator")
