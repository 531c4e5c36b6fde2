"""Layout: what formatting does, pass by pass; each takes a text and returns one laid out more."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import yaml

from modewright.editing.page import CLOSING, OPENING, Page, Token, page_of, text_of

INDENTATION = 2
BEFORE_COMMENT = 2
"""Least blanks between a value and the comment behind it."""


def ended(text: str) -> str:
    """Return a text without blanks at the ends of its lines, with single blank lines."""
    page = page_of(text)
    found: list[str] = []
    for number, line in enumerate(page.lines):
        kept = line if number in page.inside else line.rstrip(" \t")
        if kept or number in page.inside or (found and found[-1]):
            found.append(kept)
    while found and not found[-1]:
        found.pop()
    return text_of(found)


def indented(text: str) -> str:
    """Return a text with two blanks for each level of its blocks.

    What goes on over several lines moves with the line on which it starts.
    """
    page = page_of(text)
    moved = _moved(page)
    found = []
    for number, line in enumerate(page.lines):
        bare = line.lstrip(" ")
        old = len(line) - len(bare)
        found.append(" " * max(0, old + moved.get(number, 0)) + bare if bare else line)
    return text_of(_with_comments(page, found))


def _moved(page: Page) -> dict[int, int]:
    """Return by how many columns each line moves."""
    first = page.first
    found: dict[int, int] = {}
    by = 0
    for number, line in enumerate(page.lines):
        token = first.get(number)
        is_start = token is not None and token.depth == 0 and token.kind not in CLOSING
        if token and is_start and number not in page.inside - {token.line}:
            by = INDENTATION * max(0, token.level - 1) - (len(line) - len(line.lstrip(" ")))
        found[number] = by
    for number in sorted(page.comments, reverse=True):
        if number not in first:
            found[number] = _of_comment(page, number, found)
    return found


def _of_comment(page: Page, number: int, moved: dict[int, int]) -> int:
    """A line that is all comment moves with the line below, or above where it is indented more."""
    below = next((k for k in range(number + 1, len(page.lines)) if page.lines[k].strip()), None)
    column = page.comments[number]
    if below is not None:
        line = page.lines[below]
        if column <= len(line) - len(line.lstrip(" ")):
            return moved[below]
    return moved[number]


def spaced(text: str) -> str:
    """Return a text with its blanks inside brackets and behind the dashes of lists."""
    page = page_of(text)
    lines = list(page.lines)
    starts = {(token.line, token.start) for token in page.tokens}
    pairs = [pair for pair in itertools.pairwise(page.tokens) if pair[0].last == pair[1].line]
    for left, right in reversed(pairs):
        wanted = _between(left, right)
        line = lines[right.line]
        if wanted is None or line[left.end : right.start].strip(" "):
            continue
        if left.kind is yaml.FlowEntryToken and _is_in_column(left, right, starts):
            continue
        lines[right.line] = line[: left.end] + wanted + line[right.start :]
    return text_of(_with_comments(page, lines))


def _between(left: Token, right: Token) -> str | None:
    """Return what stands between two tokens of a line; None where that is left as it is."""
    if left.kind in OPENING or right.kind in CLOSING:
        return ""
    if right.kind in (yaml.FlowEntryToken, yaml.ValueToken):
        return ""
    if left.kind in (yaml.FlowEntryToken, yaml.BlockEntryToken):
        return " "
    return " " if left.kind is yaml.ValueToken and left.depth else None


def _is_in_column(left: Token, right: Token, starts: set[tuple[int, int]]) -> bool:
    """Tell whether blanks behind a comma put a part below or above another one: a table."""
    beside = {(right.line - 1, right.start), (right.line + 1, right.start)}
    return right.start > left.end + 1 and not beside.isdisjoint(starts)


def aligned(text: str) -> str:
    """Return a text whose values are aligned where an author did so, comments behind them."""
    page = page_of(text)
    lines = list(page.lines)
    for group in _groups(page):
        column = _column(group)
        for colon, value in group:
            line = lines[colon.line]
            blanks = max(1, column - colon.end)
            lines[colon.line] = line[: colon.end] + " " * blanks + line[value.start :]
    return text_of(_with_comments(page, lines))


def _column(group: list[tuple[Token, Token]]) -> int:
    """Return where aligned values start: where they do, else behind the longest key of them.

    Values are aligned where two of them start in one column and not for want of blanks; a key that
    reaches beyond that column is left alone.
    """
    columns = [value.start for _, value in group]
    spread = [value.start for colon, value in group if value.start > colon.end + 1]
    limit = max((column for column in spread if columns.count(column) > 1), default=0)
    within = [(colon, value) for colon, value in group if colon.end < limit]
    if all(value.start == limit for _, value in within):
        return limit
    return max((colon.end + 1 for colon, _ in within), default=0)


def _groups(page: Page) -> Iterator[list[tuple[Token, Token]]]:
    """Yield the entries, as colon and value, of lines that follow each other at one level."""
    group: list[tuple[Token, Token]] = []
    first = page.first
    for before, colon, value in zip(page.tokens, page.tokens[1:], page.tokens[2:], strict=False):
        if colon.kind is not yaml.ValueToken or colon.depth or value.line != colon.line:
            continue
        if first[colon.line] is not before:
            continue
        last = group[-1][0] if group else None
        if last and (colon.line != last.line + 1 or colon.level != last.level):
            yield group
            group = []
        group.append((colon, value))
    if group:
        yield group


def _with_comments(page: Page, lines: list[str]) -> list[str]:
    """Return lines whose comments stand where they stood, or behind what has become longer."""
    found = []
    for number, (old, new) in enumerate(zip(page.lines, lines, strict=True)):
        column = page.comments.get(number)
        content = "" if column is None else old[:column].rstrip(" ")
        if column is None or not content:
            found.append(new)
            continue
        comment = old[column:]
        kept = new[: len(new) - len(comment)].rstrip(" ")
        blanks = max(BEFORE_COMMENT, column - len(kept))
        found.append(kept + " " * blanks + comment)
    return found
