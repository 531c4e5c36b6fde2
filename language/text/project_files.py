"""Project files: search of specs by name, and reading of a file with its head."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib import resources
from pathlib import Path

from language.text.diagnostic import Problems, Source, Span, SpecError, suggest_name
from language.text.document import Document, MappingNode, ScalarNode, lines_of, read_text
from language.text.project_boundary import (
    path_exists,
    require_inside_project,
    require_link_inside_project,
)
from language.text.yaml_parser import parse_yaml

DOCUMENT_KINDS = (
    "automaton",
    "system",
    "scenario",
    "map",
    "variant",
    "effect",
    "calibration",
    "study",
    "test",
)

HEAD_PATTERN = re.compile(rf"^({'|'.join(DOCUMENT_KINDS)}):\s*([^\s#]+)", re.MULTILINE)

NON_HEAD_KEYS = {"test": ("scenario",)}
"""Kinds that are also keys inside a file of another kind; there they do not name the document."""

LANGUAGE_VERSION = "1"

DocumentHead = tuple[Path, str, str]
"""A file, the kind of its document, and the name of the document."""


@dataclass(frozen=True)
class Project:
    """A folder whose `spec/` is searched before the specs of the distribution.

    `texts` are the texts of open editors by resolved path; they replace the files on the disk.
    """

    root: Path
    texts: Mapping[Path, str] = field(default_factory=dict, repr=False)

    @cached_property
    def index(self) -> dict[str, list[Path]]:
        """Files by the name of their document; those of the project hide those of the distribution.

        The heads of all `*.yaml` files below `spec/` count. A name has all its files of the
        project, but one file of the distribution at most. If an effect and another document have
        the same name, the index has the other document.
        """
        return {**self.effect_index, **self._index_by_name(lambda kind: kind != "effect")}

    @cached_property
    def effect_index(self) -> dict[str, list[Path]]:
        """Files of effects by name; those of the project hide those of the distribution.

        The documents of other kinds are not in it.
        """
        return self._index_by_name(lambda kind: kind == "effect")

    def _index_by_name(self, is_wanted: Callable[[str], bool]) -> dict[str, list[Path]]:
        """Return the files of the wanted kinds by document name.

        A name may have several project files. The first head of a file is its document. Further
        heads are mistakes, and such a name has this file only if no document has the name.
        """
        own: dict[str, list[Path]] = {}
        further: dict[str, list[Path]] = {}
        seen: set[Path] = set()
        for path, kind, name in self._heads:
            if is_wanted(kind):
                (further if path in seen else own).setdefault(name, []).append(path)
            seen.add(path)
        shipped = shipped_folder()
        if shipped.resolve() != (self.root / "spec").resolve():
            for path, kind, name in _shipped_heads(shipped):
                if is_wanted(kind):
                    own.setdefault(name, [path])
        return further | own

    @cached_property
    def _heads(self) -> tuple[DocumentHead, ...]:
        """The heads of all files below `spec/` of the project."""
        return tuple(_heads_below(self.root / "spec", self.texts))

    def read(self, path: Path) -> Document:
        """Return the document of a file; a text in `texts` is read instead of the file on the disk.

        Raises SpecError as `read_document`.
        """
        text = self.texts.get(path.resolve()) if self.texts else None
        return read_document(path) if text is None else parse_document(source_of(path, text), text)

    def read_effect_document(self, name: str, span: Span) -> Document:
        """Return the document of the effect `name`, searched in `effect_index` only.

        Raises SpecError, with a problem at `span`, if there is none or more than one; also if the
        file has problems.
        """
        return self.read(self._unique_path(self.effect_index, name, span, "effect"))

    def path_of(self, reference: str, span: Span | None = None) -> Path:
        """Return the file that a name or a path refers to.

        A reference that ends in `.yaml` or `.yml`, or contains a path separator, is a path:
        relative to the file of `span`, or to the working directory if it does not exist there or
        `span` is None. Whether it exists is not checked. Any other reference is a name in `index`.
        Raises SpecError for a name that has no file or several, and, with `span`, for a path
        outside of the project.
        """
        if reference.endswith((".yaml", ".yml")) or os.sep in reference:
            base = Path(span.source.name).parent if span else Path()
            beside = base / reference
            found = beside if path_exists(beside) else Path(reference)
            if span:
                require_inside_project(found, span, self.root)
            return found
        place = span or Span(Source("command line", (reference,)), 1, 1, len(reference))
        return self._unique_path(self.index, reference, place, "spec")

    def _unique_path(
        self, index: Mapping[str, list[Path]], reference: str, place: Span, what: str
    ) -> Path:
        """Return the only file of a name in an index.

        Raises SpecError if there is none or more than one.
        """
        found = index.get(reference, [])
        if len(found) == 1:
            return found[0]
        problems = Problems()
        if found:
            files = ", ".join(display_path(path) for path in found)
            problems.error("name", place, f"`{reference}` is defined twice", f"in {files}")
        else:
            hint = suggest_name(reference, index)
            if what == "spec":
                hint = suggest_name(reference, index) or "a name of a spec below spec/, or a path"
            problems.error("name", place, f"there is no {what} named `{reference}`", hint)
        raise SpecError(problems.reported)


def shipped_folder() -> Path:
    """Return the folder of the specs of the distribution."""
    return Path(str(resources.files("spec")))


def is_shipped(path: Path) -> bool:
    """Return whether a file is a spec of the distribution."""
    return path.resolve().is_relative_to(shipped_folder().resolve())


def display_path(path: Path) -> str:
    """Return a path for messages: relative if below the working directory, else as it is given."""
    try:
        relative = os.path.relpath(path)
    except ValueError:
        return str(path)
    return relative if not relative.startswith("..") else str(path)


def read_document(path: Path) -> Document:
    """Return the document of a file; its source is named by `display_path`.

    Raises SpecError as `require_link_inside_project`, `read_text`, `parse_yaml` and
    `parse_document`.
    """
    require_link_inside_project(path, display_path(path))
    source, text = read_text(path, display_path(path))
    return parse_document(source, text)


def source_of(path: Path, text: str) -> Source:
    """Return the source for a text that an editor shows instead of the file `path`.

    Its name is that of `display_path`; the file is not read.
    """
    return Source(display_path(path), lines_of(text))


def parse_document(source: Source, text: str) -> Document:
    """Return the document of a text: kind and name from its head, and the tree.

    The text needs `language: 1` and exactly one key of DOCUMENT_KINDS, followed by the name of the
    document as a scalar; the key `scenario` of a test does not count. Raises SpecError with all
    problems of these, or those of `parse_yaml`. The name itself and all other keys are not checked.
    """
    root = parse_yaml(source, text)
    problems = Problems()
    _check_version(root, problems)
    inside = [key for kind, keys in NON_HEAD_KEYS.items() if kind in root.entries for key in keys]
    heads = [entry for entry in root if entry.key in DOCUMENT_KINDS and entry.key not in inside]
    if not heads:
        first = next(iter(root), None)
        span = first.span if first else root.span
        label = "the file does not say what it holds"
        problems.error(
            "form", span, label, f"one of the keys {', '.join(DOCUMENT_KINDS)} with a name"
        )
    elif len(heads) > 1:
        label = f"one file holds one thing: `{heads[0].key}` is given too"
        problems.error("form", heads[1].span, label)
    elif not isinstance(heads[0].node, ScalarNode):
        problems.error("form", heads[0].span, f"`{heads[0].key}` is followed by a name")
    problems.raise_if_errors()
    head = heads[0]
    assert isinstance(head.node, ScalarNode)
    return Document(head.key, head.node.text, head.node.text_span, root, source)


def _check_version(root: MappingNode, problems: Problems) -> None:
    """Report a document without `language: 1`."""
    first = next(iter(root), None)
    node = root.get("language")
    if node is None:
        span = first.span if first else root.span
        problems.error(
            "version", span, "`language: 1` is missing", "it is the first line of a spec"
        )
    elif not isinstance(node, ScalarNode) or node.text != LANGUAGE_VERSION:
        problems.error("version", node.span, "this version of the language is not known: use 1")


def _heads_below(folder: Path, texts: Mapping[Path, str]) -> Iterator[DocumentHead]:
    """Yield the heads of all YAML files below a folder, sorted by path."""
    for path in _yaml_files(folder):
        yield from ((path, kind, name) for kind, name in _heads_in(path, texts))


@cache
def _shipped_heads(folder: Path) -> tuple[DocumentHead, ...]:
    """Return the heads of the distributed specs; cached, because the files do not change."""
    return tuple(_heads_below(folder, {}))


def _yaml_files(folder: Path) -> Iterator[Path]:
    """Yield the files `*.yaml` below a folder, sorted by path."""
    if folder.is_dir():
        yield from sorted(path for path in folder.rglob("*.yaml") if path.is_file())


def _heads_in(path: Path, texts: Mapping[Path, str]) -> list[tuple[str, str]]:
    """Return the kinds and names in the first 65536 characters of a file.

    A file that cannot be read has none.
    """
    text = texts.get(path.resolve()) if texts else None
    try:
        text = path.read_text("utf-8", errors="replace") if text is None else text
    except OSError:
        return []
    heads = HEAD_PATTERN.finditer(text[:65536])
    found = [(match.group(1), match.group(2).strip("'\"")) for match in heads]
    inside = [key for kind, _ in found for key in NON_HEAD_KEYS.get(kind, ())]
    return [(kind, name) for kind, name in found if kind not in inside]
