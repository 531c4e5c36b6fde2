"""Key trace: relate the keys of a spec to the lines of C that cite them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from expectation.requirement_trace import CodeLine, citations
from language.text.diagnostic import Span
from language.text.document import Document, MappingNode, ScalarNode, YamlNode
from language.text.node_edit import find_node

KEYED_SECTIONS = (
    *("modes", "regions", "tables", "parameters", "inputs", "states", "discrete", "equations"),
    *("flow", "terms", "events", "transitions", "observer", "update", "entry", "exit"),
)
"""Sections whose entries are traced."""


@dataclass(frozen=True)
class KeyTrace:
    """A key of a spec by path, its place, and the lines of C that cite it."""

    spec: str
    path: str
    place: Span
    code: tuple[CodeLine, ...]


@dataclass(frozen=True)
class KeyTraces:
    """All keys in the order of the specs; `unmatched_citations` are paths that no spec has."""

    keys: tuple[KeyTrace, ...]
    unmatched_citations: tuple[str, ...]

    @property
    def uncited(self) -> tuple[KeyTrace, ...]:
        """The keys that no line of C cites, because they are folded into numbers or unused."""
        return tuple(key for key in self.keys if not key.code)


def build_key_traces(
    documents: Sequence[Document], code: Mapping[str, Mapping[str, str]]
) -> KeyTraces:
    """Return the lines of C that cite each key; `code` is C text by automaton and file name.

    Keys are the entries of KEYED_SECTIONS, also nested ones and those of templates. A citation of a
    part of a key belongs to the smallest enclosing key. A citation of a mode that is `like` a
    template belongs to the key of the template if that is smaller. A citation without any such key
    is in `unmatched_citations`, as `automaton path`.
    """
    spans = {
        (document.name, path): span
        for document in documents
        for path, span in _iterate_keys(document.root, "")
    }
    roots = {document.name: document.root for document in documents}
    lines: dict[tuple[str, str], dict[CodeLine, None]] = {key: {} for key in spans}
    strays = []
    for (name, path), where in citations(code).items():
        key = _enclosing_key(name, path, spans, roots.get(name))
        if key is None:
            strays.append(f"{name} {path}")
        else:
            lines[key].update(dict.fromkeys(where))
    keys = (
        KeyTrace(name, path, span, tuple(sorted(lines[name, path])))
        for (name, path), span in spans.items()
    )
    return KeyTraces(tuple(keys), tuple(strays))


def _iterate_keys(table: MappingNode, above: str) -> Iterator[tuple[str, Span]]:
    """Yield path and place of each key in the keyed sections of a mapping, recursively."""
    for part in table:
        if not isinstance(part.node, MappingNode):
            continue
        if part.key == "templates":
            yield from _iterate_entries(part.node, "templates.")
        elif part.key in KEYED_SECTIONS:
            yield from _iterate_entries(part.node, f"{above}{part.key}.")


def _iterate_entries(table: MappingNode, above: str) -> Iterator[tuple[str, Span]]:
    """Yield path and place of the entries of a section and of the keys below them."""
    for entry in table:
        yield f"{above}{entry.key}", entry.span
        if isinstance(entry.node, MappingNode):
            yield from _iterate_keys(entry.node, f"{above}{entry.key}.")


def _enclosing_key(
    name: str, path: str, known: Mapping[tuple[str, str], Span], root: MappingNode | None
) -> tuple[str, str] | None:
    """Return the smallest known key that contains a cited path; None if there is none."""
    parts = path.split(".")
    for count in range(len(parts), 1, -1):
        shorter = ".".join(parts[:count])
        if (name, shorter) in known:
            template = _template_path(root, parts)
            inside = _enclosing_key(name, template, known, None) if template else None
            is_deeper = inside is not None and inside[1].count(".") >= count
            return inside if is_deeper else (name, shorter)
    return None


def _template_path(root: MappingNode | None, parts: Sequence[str]) -> str:
    """Return the path in the template of a mode; empty if the mode has no template."""
    like: YamlNode | None = find_node(root, (*parts[:2], "like")) if root else None
    if not isinstance(like, ScalarNode) or parts[0] != "modes" or len(parts) < 3:
        return ""
    return ".".join(("templates", like.text, *parts[2:]))
