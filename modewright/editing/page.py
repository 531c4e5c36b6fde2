"""Page: the lines of a YAML text with its tokens and comments, for layout without new meaning."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import yaml

from language.document import lines_of

OPENING = (yaml.FlowMappingStartToken, yaml.FlowSequenceStartToken)
CLOSING = (yaml.FlowMappingEndToken, yaml.FlowSequenceEndToken)
BLOCKS = (yaml.BlockMappingStartToken, yaml.BlockSequenceStartToken)


@dataclass(frozen=True)
class Token:
    """A part of a text with its first and last line and column, from 0.

    `depth` counts the brackets around it, `level` the blocks.
    """

    kind: type[yaml.Token]
    line: int
    start: int
    last: int
    end: int
    depth: int
    level: int


@dataclass(frozen=True)
class Page:
    """A text as lines; `inside` are those within a value of several lines, `comments` columns."""

    lines: tuple[str, ...]
    tokens: tuple[Token, ...]
    inside: frozenset[int]
    comments: Mapping[int, int]

    @property
    def first(self) -> dict[int, Token]:
        """The first token of each line that begins with one."""
        found: dict[int, Token] = {}
        for token in self.tokens:
            found.setdefault(token.line, token)
        return found


@lru_cache(maxsize=4)
def page_of(text: str) -> Page:
    """Return the page of a text that is YAML."""
    lines = lines_of(text)
    found = tuple(_tokens(text))
    inside = frozenset(
        line
        for token in found
        if token.last > token.line
        for line in range(token.line, token.last + (1 if token.end else 0))
    )
    ends: dict[int, int] = {}
    for token in found:
        ends[token.last] = max(ends.get(token.last, 0), token.end)
    comments = {
        number: column
        for number, line in enumerate(lines)
        if number not in inside and (column := line.find("#", ends.get(number, 0))) >= 0
    }
    return Page(lines, found, inside, comments)


def _tokens(text: str) -> Iterable[Token]:
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


def text_of(lines: Iterable[str]) -> str:
    """Return lines as a text that ends with one line feed."""
    return "\n".join(lines) + "\n"
