"""Format: a spec laid out by rules, its comments and quotes kept, its meaning unchanged.

A level is indented by two blanks, lines end without blanks, at most one blank line separates;
`{a: 1, b: [2, 3]}` has its blanks there, but for columns of a table. Values of lines that follow
each other are aligned where the author aligned some of them; a key that is longer stands out. A
comment keeps its column as long as two blanks fit before it.
"""

from __future__ import annotations

from language.document import Items, Node, Scalar, Table, lines_of
from language.problem import Source
from language.yaml_tree import parse
from modewright.editing.layout import aligned, ended, indented, spaced
from modewright.editing.page import page_of

PASSES = (ended, indented, spaced, aligned, ended)
MOST_ROUNDS = 8
"""Rounds of the passes: what one has moved may take another out of a column."""
MARK = "\ufeff"
"""A mark of UTF-8 that some editors put before a text."""


def formatted(text: str, name: str = "") -> str:
    """Return the text of a spec laid out. Raises SpecError where it is no YAML of ours.

    A pass that would change what is said, in a text that no rule here foresees, is left out. A mark
    before the text stays, and all lines end as the first one does.
    """
    made = _laid_out(text.removeprefix(MARK).replace("\r\n", "\n"), name)
    if text.partition("\n")[0].endswith("\r"):
        made = made.replace("\n", "\r\n")
    return MARK + made if text.startswith(MARK) else made


def _laid_out(made: str, name: str) -> str:
    said = _said(made, name)
    for _ in range(MOST_ROUNDS):
        before = made
        for one in PASSES:
            tried = one(made)
            if tried != made and _said(tried, name) == said:
                made = tried
        if made == before:
            break
    return made


def _said(text: str, name: str) -> tuple[object, list[str]]:
    """Return what a text says - keys, values, quotes - and its comments."""
    root = parse(Source(name, lines_of(text)), text)
    page = page_of(text)
    comments = [page.lines[line][column:].rstrip() for line, column in page.comments.items()]
    return _plain(root), comments


def _plain(node: Node) -> object:
    match node:
        case Scalar(text, _, quoted):
            return text, quoted
        case Items(nodes):
            return [_plain(part) for part in nodes]
        case Table():
            return [(entry.key, _plain(entry.node)) for entry in node]
