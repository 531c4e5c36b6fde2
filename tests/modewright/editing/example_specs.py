"""Corpus: the specs by which shapes and schema are held equal to the readers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from language.overlays.expand_document import read_document
from language.text.diagnostic import SpecError
from language.text.document import Document, MappingNode, ScalarNode, SequenceNode, YamlNode

ROOT = Path(__file__).parents[3]
FOLDERS = (
    "spec",
    "tests/semantics/rules",
    "tests/data",
    "tests/semantics/invalid_specs",
    "tests/language",
)


def valid_documents(folders: Sequence[str] = FOLDERS) -> Iterator[tuple[Path, Document]]:
    """Yield the specs that are said to be valid: shipped, of the rules, repaired ones."""
    for folder in folders:
        for path in sorted((ROOT / folder).rglob("*.yaml")):
            if folder == "tests/semantics/invalid_specs" and ".repaired" not in path.suffixes:
                continue
            try:
                yield path, read_document(path)
            except SpecError:
                assert folder != "spec", path


def to_plain_data(node: YamlNode) -> Any:
    """Return a tree as an editor sees it: scalars by the core schema of YAML 1.2."""
    match node:
        case SequenceNode():
            return [to_plain_data(part) for part in node.nodes]
        case MappingNode():
            return {entry.key: to_plain_data(entry.node) for entry in node}
        case ScalarNode(text, _, quoted) if not quoted:
            return _resolved(text)
        case ScalarNode():
            return node.text


def _resolved(text: str) -> Any:
    if re.fullmatch(r"[-+]?\d+", text):
        return int(text)
    if re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", text):
        return float(text)
    return {"true": True, "false": False, "": None, "null": None, "~": None}.get(text, text)
