"""Formatter: format the layout of a spec without change of comments, quotes and meaning.

Blocks are indented by two blanks; lines have no trailing blanks; blank lines are single. Flow
collections look like `{a: 1, b: [2, 3]}`, except for columns of tables. Values of consecutive lines
are aligned where the author aligned some of them. A comment keeps its column if two blanks fit
before it.
"""

from __future__ import annotations

import yaml

from language.text.diagnostic import Source, SpecError
from language.text.document import MappingNode, ScalarNode, SequenceNode, YamlNode, lines_of
from language.text.yaml_parser import parse_yaml
from modewright.editing.format_passes import align_values, indent_blocks, space_tokens, strip_blanks
from modewright.editing.tokenised_text import tokenise

PASSES = (strip_blanks, indent_blocks, space_tokens, align_values, strip_blanks)
"""The format passes in their order."""
MAX_ROUNDS = 8
"""Largest number of rounds; a pass may undo the alignment of another one."""
BYTE_ORDER_MARK = "\ufeff"
"""The byte order mark that some editors write at the start of a file."""
Content = tuple[object, list[str]]
"""The content of a text as plain data, and its comments."""


def format_text(text: str, name: str = "") -> str:
    """Return the formatted text of a spec, with the layout that the module describes.

    Passes are repeated up to MAX_ROUNDS times; a pass that would change keys, values, quotes or
    comments, or give invalid YAML, is skipped. A byte order mark is preserved; all line ends become
    those of the first line. `name` is the name of the file in problems. Raises SpecError if the
    text is no valid YAML of the language.
    """
    result = _run_passes(text.removeprefix(BYTE_ORDER_MARK).replace("\r\n", "\n"), name)
    if text.partition("\n")[0].endswith("\r"):
        result = result.replace("\n", "\r\n")
    return BYTE_ORDER_MARK + result if text.startswith(BYTE_ORDER_MARK) else result


def _run_passes(text: str, name: str) -> str:
    """Return the text after the passes, repeated until it does not change."""
    content = _content_of(text, name)
    for _ in range(MAX_ROUNDS):
        before = text
        for run_pass in PASSES:
            candidate = run_pass(text)
            if candidate != text and _has_content(candidate, name, content):
                text = candidate
        if text == before:
            break
    return text


def _has_content(text: str, name: str, content: Content) -> bool:
    """Return whether a text is valid YAML with a content."""
    try:
        return _content_of(text, name) == content
    except (SpecError, yaml.YAMLError):
        return False


def _content_of(text: str, name: str) -> Content:
    """Return the content of a text (keys, values, quotes) and its comments."""
    root = parse_yaml(Source(name, lines_of(text)), text)
    tokenised = tokenise(text)
    comments = [
        tokenised.lines[line][column:].rstrip()
        for line, column in tokenised.comment_columns.items()
    ]
    return _to_plain_data(root), comments


def _to_plain_data(node: YamlNode) -> object:
    """Return a node as nested lists and tuples."""
    match node:
        case ScalarNode(text, _, quoted):
            return text, quoted
        case SequenceNode(nodes):
            return [_to_plain_data(part) for part in nodes]
        case MappingNode():
            return [(entry.key, _to_plain_data(entry.node)) for entry in node]
