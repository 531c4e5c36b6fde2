"""Text rewriting: replacement of names in the text of an expression, token by token.

Effects and templates edit texts, so that the result is readable and has a place.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping

from language.expressions.tokens import KEYWORD_PATTERN, KEYWORDS, NUMBER_PATTERN, UNIT_PATTERN

TOKEN_PATTERN = re.compile(
    rf"(?P<number>{NUMBER_PATTERN}(?: (?!{KEYWORD_PATTERN}){UNIT_PATTERN})?)"
    r"|(?P<name>\$?[A-Za-z]\w*(?: *\. *[A-Za-z]\w*)*)"
    r"|(?P<mark><=|>=|==|!=|[-+*/^()<>=,])"
    r"|(?P<blank>\s+)|(?P<other>.)"
)
"""The tokens of `expression.lark`, and placeholders such as `$speed`."""
ATOM_PATTERN = re.compile(r"\$?[A-Za-z]\w*|\d+(\.\d+)?")
"""Texts that replace a name without parentheses."""


def substitute_reads(text: str, replacements: Mapping[str, str]) -> tuple[str, frozenset[str]]:
    """Return an expression with names replaced where they are read, and the replaced names.

    A path counts as one name. Not replaced are functions, units, and the argument of `der(...)` and
    `in(...)`. A replacement that is not a single name or unsigned number gets parentheses; it is
    not searched for names again. The rest of the text is kept, blanks included.
    """
    tokens = list(_tokenise(text))
    return _replace_tokens(tokens, replacements, lambda position: _is_read(tokens, position))


def rename_names(text: str, replacements: Mapping[str, str]) -> str:
    """Return an expression with names replaced, also in `der(x)` and `in(x)`.

    A path counts as one name. Functions and units are kept. A replacement that is not a single name
    or unsigned number gets parentheses.
    """
    tokens = list(_tokenise(text))
    return _replace_tokens(
        tokens, replacements, lambda position: not _is_function(tokens, position)
    )[0]


def _replace_tokens(
    tokens: list[tuple[str, str]],
    replacements: Mapping[str, str],
    is_replaced: Callable[[int], bool],
) -> tuple[str, frozenset[str]]:
    """Return the text with the accepted names replaced, and the set of replaced names."""
    used_names: set[str] = set()
    parts = []
    for position, (kind, part) in enumerate(tokens):
        if kind == "name" and part in replacements and is_replaced(position):
            used_names.add(part)
            part = (
                replacements[part]
                if ATOM_PATTERN.fullmatch(replacements[part])
                else f"({replacements[part]})"
            )
        parts.append(part)
    return "".join(parts), frozenset(used_names)


def names_in_text(text: str) -> list[str]:
    """Return the names that an expression reads, from left to right, with repetitions.

    Functions, keywords, units and the argument of `der(...)` and `in(...)` do not count. A path is
    one name, as it is written, blanks included.
    """
    tokens = list(_tokenise(text))
    return [
        part
        for position, (kind, part) in enumerate(tokens)
        if kind == "name" and part not in KEYWORDS and _is_read(tokens, position)
    ]


def split_balance(balance: str) -> tuple[str, str]:
    """Return the left and the right side of a balance: the stripped texts around its first `=`.

    Without a `=` the right side is empty.
    """
    left, _, right = balance.partition("=")
    return left.strip(), right.strip()


def split_summands(text: str) -> list[tuple[str, str]]:
    """Return the top-level summands of an expression as (sign, text), the sign `+` or `-`.

    A sign before the first operand, or after another operator, stays in the text. An expression
    that begins with `if` is one summand. An empty text gives one empty summand.
    """
    result: list[tuple[str, str]] = []
    sign, part, depth, operand = "+", "", 0, False
    if text.split(" ", 1)[0] == "if":
        return [("+", text)]
    for kind, token in _tokenise(text):
        depth += (token == "(") - (token == ")")
        if depth == 0 and kind == "mark" and token in "+-" and operand:
            result.append((sign, part.strip()))
            sign, part, operand = token, "", False
            continue
        if kind != "blank":
            operand = kind != "mark" or token == ")"
        part += token
    return [*result, (sign, part.strip())]


def join_summands(parts: list[tuple[str, str]]) -> str:
    """Return summands (sign, text) as one expression, like `a - b`; `0` for an empty list.

    The sign `+` of the first one is left out. Texts get no parentheses.
    """
    text = ""
    for sign, part in parts:
        if text:
            text += f" {sign} {part}"
        else:
            text = part if sign == "+" else f"-{part}"
    return text or "0"


def _tokenise(text: str) -> Iterator[tuple[str, str]]:
    """Yield kind and text of each token; the texts together are the whole text."""
    for match in TOKEN_PATTERN.finditer(text):
        yield str(match.lastgroup), match.group()


def _is_function(tokens: list[tuple[str, str]], position: int) -> bool:
    """Return whether the token at a position is followed by `(`."""
    after = [part for kind, part in tokens[position + 1 :] if kind != "blank"][:1]
    return after == ["("]


def _is_read(tokens: list[tuple[str, str]], position: int) -> bool:
    """Return whether the name at a position is read: no function, no argument of `der` or `in`."""
    before = [part for kind, part in tokens[:position] if kind != "blank"][-2:]
    return not _is_function(tokens, position) and before not in (["der", "("], ["in", "("])
