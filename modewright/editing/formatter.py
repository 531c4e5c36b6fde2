"""Format: a spec laid out by rules, its comments and quotes kept, its meaning unchanged.

A level is indented by two blanks, lines end without blanks, at most one blank line separates;
`{a: 1, b: [2, 3]}` has its blanks there, but for columns of a table. Values of lines that follow
each other are aligned where the author aligned some of them; a key that is longer stands out. A
comment keeps its column as long as two blanks fit before it.
"""

from __future__ import annotations

from language.text.diagnostic import Source
from language.text.document import MappingNode, ScalarNode, SequenceNode, YamlNode, lines_of
from language.text.yaml_parser import parse_yaml
from modewright.editing.format_passes import align_values, indent_blocks, space_tokens, strip_blanks
from modewright.editing.tokenised_text import tokenise

PASSES = (strip_blanks, indent_blocks, space_tokens, align_values, strip_blanks)
MAX_ROUNDS = 8
"""Rounds of the passes: what one has moved may take another out of a column."""
BYTE_ORDER_MARK = "\ufeff"
"""A mark of UTF-8 that some editors put before a text."""


def format_text(text: str, name: str = "") -> str:
    """Return the text of a spec laid out. Raises SpecError where it is no YAML of ours.

    A pass that would change what is said, in a text that no rule here foresees, is left out. A mark
    before the text stays, and all lines end as the first one does.
    """
    result = _run_passes(text.removeprefix(BYTE_ORDER_MARK).replace("\r\n", "\n"), name)
    if text.partition("\n")[0].endswith("\r"):
        result = result.replace("\n", "\r\n")
    return BYTE_ORDER_MARK + result if text.startswith(BYTE_ORDER_MARK) else result


def _run_passes(text: str, name: str) -> str:
    content = _content_of(text, name)
    for _ in range(MAX_ROUNDS):
        before = text
        for run_pass in PASSES:
            candidate = run_pass(text)
            if candidate != text and _content_of(candidate, name) == content:
                text = candidate
        if text == before:
            break
    return text


def _content_of(text: str, name: str) -> tuple[object, list[str]]:
    """Return what a text says - keys, values, quotes - and its comments."""
    root = parse_yaml(Source(name, lines_of(text)), text)
    tokenised = tokenise(text)
    comments = [
        tokenised.lines[line][column:].rstrip()
        for line, column in tokenised.comment_columns.items()
    ]
    return _to_plain_data(root), comments


def _to_plain_data(node: YamlNode) -> object:
    match node:
        case ScalarNode(text, _, quoted):
            return text, quoted
        case SequenceNode(nodes):
            return [_to_plain_data(part) for part in nodes]
        case MappingNode():
            return [(entry.key, _to_plain_data(entry.node)) for entry in node]
