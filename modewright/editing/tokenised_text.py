"""Tokenised text: the lines of a YAML text with tokens and comments, the input of format passes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import yaml

from language.text.document import lines_of

OPENING = (yaml.FlowMappingStartToken, yaml.FlowSequenceStartToken)
CLOSING = (yaml.FlowMappingEndToken, yaml.FlowSequenceEndToken)
BLOCKS = (yaml.BlockMappingStartToken, yaml.BlockSequenceStartToken)


@dataclass(frozen=True)
class Token:
    """A token with its first and last line and column (from 0).

    `depth` is the number of enclosing brackets, `level` the number of enclosing blocks.
    """

    kind: type[yaml.Token]
    line: int
    start_column: int
    end_line: int
    end_column: int
    depth: int
    level: int


@dataclass(frozen=True)
class TokenisedText:
    """A text as lines and tokens.

    `continuation_lines` are the lines of multi-line tokens, `comment_columns` the columns of
    comments by line.
    """

    lines: tuple[str, ...]
    tokens: tuple[Token, ...]
    continuation_lines: frozenset[int]
    comment_columns: Mapping[int, int]

    @property
    def first_tokens(self) -> dict[int, Token]:
        """The first token that starts on a line, by number of the line (from 0)."""
        tokens: dict[int, Token] = {}
        for token in self.tokens:
            tokens.setdefault(token.line, token)
        return tokens


@lru_cache(maxsize=4)
def tokenise(text: str) -> TokenisedText:
    """Return the tokenised form of a YAML text; the last four results are cached.

    A comment is a `#` behind the last token of a line, outside multi-line tokens. Raises
    yaml.YAMLError for invalid YAML.
    """
    lines = lines_of(text)
    tokens = tuple(_scan_tokens(text))
    inside = frozenset(
        line
        for token in tokens
        if token.end_line > token.line
        for line in range(token.line, token.end_line + (1 if token.end_column else 0))
    )
    ends: dict[int, int] = {}
    for token in tokens:
        ends[token.end_line] = max(ends.get(token.end_line, 0), token.end_column)
    comments = {
        number: column
        for number, line in enumerate(lines)
        if number not in inside and (column := line.find("#", ends.get(number, 0))) >= 0
    }
    return TokenisedText(lines, tokens, inside, comments)


def _scan_tokens(text: str) -> Iterable[Token]:
    """Yield the tokens with text, with depth and level."""
    depth = level = 0
    for token in yaml.scan(text, Loader=yaml.CSafeLoader):
        start, end = token.start_mark, token.end_mark
        if isinstance(token, BLOCKS):
            level += 1
        elif isinstance(token, yaml.BlockEndToken):
            level -= 1
        elif isinstance(token, CLOSING):
            depth -= 1
        has_text = (end.line, end.column) > (start.line, start.column)
        if has_text and not isinstance(token, (*BLOCKS, yaml.BlockEndToken)):
            place = (start.line, start.column, end.line, end.column)
            yield Token(type(token), *place, depth, level)
        if isinstance(token, OPENING):
            depth += 1


def join_lines(lines: Iterable[str]) -> str:
    """Return lines joined with line feeds, with a final line feed (also without lines)."""
    return "\n".join(lines) + "\n"
