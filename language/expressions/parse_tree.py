"""Parse tree: the parse tree of an expression as a function of the kinds of its tokens.

lark parses each sequence of token kinds once: `a + 2 * b` and `x_1 - 7.5 / y` have the same shape.
A text with other tokens is parsed by lark itself.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import resources

import lark

from language.expressions.tokens import KEYWORD_PATTERN, NUMBER_PATTERN, UNIT_PATTERN

ParseShape = tuple[str, tuple["ParseShape | int", ...]]
"""A rule of the grammar with its parts: other shapes, or the numbers of tokens."""

TOKEN_PATTERN = re.compile(
    rf" *(?:(?P<quantity>{NUMBER_PATTERN} (?!(?:then|else|and|or|if|not)\b){UNIT_PATTERN})"
    rf"|(?P<number>{NUMBER_PATTERN})"
    rf"|(?P<word>{KEYWORD_PATTERN})"
    rf"|(?P<name>\$?(?!{KEYWORD_PATTERN})[A-Za-z][A-Za-z0-9_]*)"
    r"|\^ *(?P<exponent>-?\d+)(?![\d.])"
    r"|(?P<sign><=|>=|==|!=|[-+*/<>=(),.]))"
)
"""The tokens of `expression.lark`, each with the blanks before it.

An exponent is matched with its `^`, because digits elsewhere are a number.
"""
REPRESENTATIVE_TOKENS = {"quantity": "1 m", "number": "1", "name": "x"}
"""Text that represents all tokens of a kind; words and signs represent themselves."""
REPRESENTATIVE_EXPONENT = "^ 2"
TOKEN_SEPARATOR = "  "
"""Two blanks: with one blank, a name after a number would be its unit."""
START_RULES = ("expression", "balance")
REPRESENTATIVE_SIGNS = {"/": "*", "<=": "<", ">=": "<", ">": "<", "==": "<", "!=": "<"}
"""Signs with the same parse tree. `+` and `-` differ, because `-` may be unary."""


@dataclass(frozen=True)
class ParsedShape:
    """The shape of a text, text and offset of each token, and a bound of the depth of its tree."""

    shape: ParseShape
    texts: tuple[str, ...]
    offsets: tuple[int, ...]
    depth: int


def parse_shape(text: str, start_rule: str) -> ParsedShape:
    """Return the shape of a text for a start rule, "expression" or "balance", with its tokens.

    Shapes are cached by the kinds of the tokens. Raises lark's UnexpectedInput if the text does not
    match the rule.
    """
    kinds: list[str] = []
    texts: list[str] = []
    starts: list[int] = []
    end = 0
    for match in TOKEN_PATTERN.finditer(text):
        if match.start() != end:
            break
        end = match.end()
        kind = str(match.lastgroup)
        token_text = match[kind]
        texts.append(token_text)
        starts.append(match.start(kind))
        if kind == "exponent":
            kinds.append(REPRESENTATIVE_EXPONENT)
        elif kind in REPRESENTATIVE_TOKENS:
            kinds.append(REPRESENTATIVE_TOKENS[kind])
        else:
            kinds.append(REPRESENTATIVE_SIGNS.get(token_text, token_text))
    cached = _cached_shape(tuple(kinds), start_rule) if not text[end:].strip(" ") else None
    if cached:
        return ParsedShape(cached[0], tuple(texts), tuple(starts), cached[1])
    tokens: list[lark.Token] = []

    def number(token: lark.Token) -> int:
        tokens.append(token)
        return len(tokens) - 1

    shape = _shape_of_tree(_parser(start_rule).parse(text), number)
    places = tuple(token.start_pos or 0 for token in tokens)
    return ParsedShape(shape, tuple(map(str, tokens)), places, _shape_depth(shape))


@lru_cache(maxsize=4096)
def _cached_shape(kinds: tuple[str, ...], start_rule: str) -> tuple[ParseShape, int] | None:
    """Return the shape of a sequence of token kinds and its depth.

    Return None if it is not an expression.
    """
    places: dict[int, int] = {}
    at = 0
    for index, kind in enumerate(kinds):
        places[at + kind.rindex(" ") + 1 if kind == REPRESENTATIVE_EXPONENT else at] = index
        at += len(kind) + len(TOKEN_SEPARATOR)
    try:
        tree = _parser(start_rule).parse(TOKEN_SEPARATOR.join(kinds))
    except lark.exceptions.UnexpectedInput:
        return None
    shape = _shape_of_tree(tree, lambda token: places[token.start_pos or 0])
    return shape, _shape_depth(shape)


def _shape_of_tree(tree: lark.Tree[lark.Token], number: Callable[[lark.Token], int]) -> ParseShape:
    """Return the shape of a parse tree of lark; `number` gives the number of a token."""
    parts = tuple(
        number(part) if isinstance(part, lark.Token) else _shape_of_tree(part, number)
        for part in tree.children
    )
    return str(tree.data), parts


def _shape_depth(shape: ParseShape) -> int:
    """Return an upper bound of the depth of the syntax tree; start rules do not count."""
    deepest = max((_shape_depth(part) for part in shape[1] if not isinstance(part, int)), default=0)
    return deepest if shape[0] in START_RULES else deepest + 1


@cache
def _parser(start_rule: str) -> lark.Lark:
    """Return the LALR parser for a start rule; cached."""
    grammar = resources.files("language.expressions").joinpath("expression.lark").read_text("utf-8")
    return lark.Lark(grammar, parser="lalr", start=start_rule)
