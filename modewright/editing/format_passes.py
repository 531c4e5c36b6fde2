"""Format passes: functions from a YAML text to a text with improved layout."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import yaml

from modewright.editing.tokenised_text import (
    CLOSING,
    OPENING,
    Token,
    TokenisedText,
    join_lines,
    tokenise,
)

INDENTATION = 2
"""Blanks for each level of blocks."""
VALUE_ENDS = (*CLOSING, yaml.FlowEntryToken)
"""Tokens at the end of a value inside brackets."""
COMMENT_GAP = 2
"""Smallest number of blanks between a value and a comment behind it."""


def strip_blanks(text: str) -> str:
    """Return a text without trailing blanks and tabs, and with single blank lines.

    Blank lines at the start and the end are removed; the text ends with one line feed. Lines inside
    multi-line values do not change.
    """
    tokenised = tokenise(text)
    result: list[str] = []
    for number, line in enumerate(tokenised.lines):
        kept = line if number in tokenised.continuation_lines else line.rstrip(" \t")
        if kept or number in tokenised.continuation_lines or (result and result[-1]):
            result.append(kept)
    while result and not result[-1]:
        result.pop()
    return join_lines(result)


def indent_blocks(text: str) -> str:
    """Return a text whose blocks are indented by INDENTATION blanks for each level.

    Continuation lines move with the line on which their value starts. A comment line moves with the
    line below it, or with the line above if it is indented more than the line below. A comment
    behind a value keeps its column if COMMENT_GAP blanks fit before it.
    """
    tokenised = tokenise(text)
    shifts = _line_shifts(tokenised)
    result = []
    for number, line in enumerate(tokenised.lines):
        bare = line.lstrip(" ")
        old = len(line) - len(bare)
        result.append(" " * max(0, old + shifts.get(number, 0)) + bare if bare else line)
    return join_lines(_restore_comments(tokenised, result))


def _line_shifts(tokenised: TokenisedText) -> dict[int, int]:
    """Return the shift of each line in columns."""
    first = tokenised.first_tokens
    shifts: dict[int, int] = {}
    shift = 0
    for number, line in enumerate(tokenised.lines):
        token = first.get(number)
        is_start = token is not None and token.depth == 0 and token.kind not in CLOSING
        if token and is_start and number not in tokenised.continuation_lines - {token.line}:
            shift = INDENTATION * max(0, token.level - 1) - (len(line) - len(line.lstrip(" ")))
        shifts[number] = shift
    for number in sorted(tokenised.comment_columns, reverse=True):
        if number not in first:
            shifts[number] = _comment_shift(tokenised, number, shifts)
    return shifts


def _comment_shift(tokenised: TokenisedText, number: int, shifts: dict[int, int]) -> int:
    """Return the shift of a comment line.

    It is the shift of the next line, or of the previous one if the comment is indented more.
    """
    below = next(
        (k for k in range(number + 1, len(tokenised.lines)) if tokenised.lines[k].strip()), None
    )
    column = tokenised.comment_columns[number]
    if below is not None:
        line = tokenised.lines[below]
        if column <= len(line) - len(line.lstrip(" ")):
            return shifts[below]
    return shifts[number]


def space_tokens(text: str) -> str:
    """Return a text with normalised blanks inside brackets and after the dashes of lists.

    There is no blank inside brackets at both ends and before a comma or colon, and one after a
    comma, a dash, and a colon in brackets, also if no value follows. Several blanks after a comma
    are preserved if the item starts in the same column as a token of the line above or below.
    """
    tokenised = tokenise(text)
    lines = list(tokenised.lines)
    starts = {(token.line, token.start_column) for token in tokenised.tokens}
    pairs = [
        pair for pair in itertools.pairwise(tokenised.tokens) if pair[0].end_line == pair[1].line
    ]
    for left, right in reversed(pairs):
        separator = _separator_of(left, right)
        line = lines[right.line]
        if separator is None or line[left.end_column : right.start_column].strip(" "):
            continue
        if left.kind is yaml.FlowEntryToken and _is_in_column(left, right, starts):
            continue
        lines[right.line] = line[: left.end_column] + separator + line[right.start_column :]
    return join_lines(_restore_comments(tokenised, lines))


def _separator_of(left: Token, right: Token) -> str | None:
    """Return the blanks between two tokens of a line; None to leave them.

    A blank stays behind the colon of a key without a value, as in `{a: , b: }`, because `a:,` is no
    key in YAML.
    """
    if left.kind is yaml.ValueToken and right.kind in VALUE_ENDS:
        return " "
    if left.kind in OPENING or right.kind in CLOSING:
        return ""
    if right.kind in (yaml.FlowEntryToken, yaml.ValueToken):
        return ""
    if left.kind in (yaml.FlowEntryToken, yaml.BlockEntryToken):
        return " "
    return " " if left.kind is yaml.ValueToken and left.depth else None


def _is_in_column(left: Token, right: Token, starts: set[tuple[int, int]]) -> bool:
    """Return whether blanks after a comma align an item with the line above or below."""
    beside = {(right.line - 1, right.start_column), (right.line + 1, right.start_column)}
    return right.start_column > left.end_column + 1 and not beside.isdisjoint(starts)


def align_values(text: str) -> str:
    """Return a text whose values are aligned where the author aligned some of them.

    This is done in groups of consecutive lines `key: value` of the same level. A group is aligned
    if two of its values start in the same column after more than one blank; longer keys do not
    count. If all values start in this column it is kept, else they start one blank behind the
    longest key. In other groups one blank follows each colon.
    """
    tokenised = tokenise(text)
    lines = list(tokenised.lines)
    for group in _iter_entry_groups(tokenised):
        column = _value_column(group)
        for colon, value in group:
            line = lines[colon.line]
            blanks = max(1, column - colon.end_column)
            lines[colon.line] = line[: colon.end_column] + " " * blanks + line[value.start_column :]
    return join_lines(_restore_comments(tokenised, lines))


def _value_column(group: list[tuple[Token, Token]]) -> int:
    """Return the common column of the values of consecutive lines; 0 if they are not aligned.

    Values are aligned if two of them start in the same column after more than one blank. Keys
    beyond this column are not aligned.
    """
    columns = [value.start_column for _, value in group]
    spread = [
        value.start_column for colon, value in group if value.start_column > colon.end_column + 1
    ]
    limit = max((column for column in spread if columns.count(column) > 1), default=0)
    within = [(colon, value) for colon, value in group if colon.end_column < limit]
    if all(value.start_column == limit for _, value in within):
        return limit
    return max((colon.end_column + 1 for colon, _ in within), default=0)


def _iter_entry_groups(tokenised: TokenisedText) -> Iterator[list[tuple[Token, Token]]]:
    """Yield the entries (colon and value) of consecutive lines at the same level."""
    group: list[tuple[Token, Token]] = []
    first = tokenised.first_tokens
    for before, colon, value in zip(
        tokenised.tokens, tokenised.tokens[1:], tokenised.tokens[2:], strict=False
    ):
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


def _restore_comments(tokenised: TokenisedText, lines: list[str]) -> list[str]:
    """Return lines whose comments keep their columns, or follow a longer content."""
    result = []
    for number, (old, new) in enumerate(zip(tokenised.lines, lines, strict=True)):
        column = tokenised.comment_columns.get(number)
        content = "" if column is None else old[:column].rstrip(" ")
        if column is None or not content:
            result.append(new)
            continue
        comment = old[column:]
        kept = new[: len(new) - len(comment)].rstrip(" ")
        blanks = max(COMMENT_GAP, column - len(kept))
        result.append(kept + " " * blanks + comment)
    return result
