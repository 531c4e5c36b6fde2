"""Workspace: the specs of a project, with open texts instead of files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from language.text.diagnostic import SpecError
from language.text.document import Document, ScalarNode
from language.text.project_files import Project
from modewright.lsp.name_occurrence import NameOccurrence, find_names


@dataclass
class Workspace:
    """The folder of a project, open texts by resolved path, and cached documents.

    `encoding` is that of the editor's columns. While a text is no valid YAML, its document is the
    last valid one.
    """

    root: Path
    encoding: str = "utf-16"
    texts: dict[Path, str] = field(default_factory=dict)
    _project: Project | None = None
    _document_cache: dict[Path, tuple[object, Document | None]] = field(default_factory=dict)
    _name_cache: dict[Path, tuple[Document, tuple[NameOccurrence, ...]]] = field(
        default_factory=dict
    )

    def project(self) -> Project:
        """Return the project with the open texts; it is cached until `refresh`."""
        if self._project is None:
            self._project = Project(self.root, dict(self.texts))
        return self._project

    def refresh(self) -> None:
        """Discard the cached project; documents are read again only if they changed."""
        self._project = None

    def set_text(self, path: Path, text: str | None) -> None:
        """Store the text of an open file; None removes it. The cached project is discarded."""
        path = path.resolve()
        if text is None:
            self.texts.pop(path, None)
        else:
            self.texts[path] = text
        self.refresh()

    def document(self, path: Path) -> Document | None:
        """Return the document of a file from its open text, else from the disk.

        While it is not valid, the last valid document is returned; None if there is none or the
        file does not exist. The document is cached by text or modification time.
        """
        path = path.resolve()
        stamp: object = self.texts.get(path)
        if stamp is None:
            try:
                stamp = path.stat().st_mtime_ns
            except OSError:
                return None
        cached = self._document_cache.get(path, (None, None))
        if cached[0] != stamp:
            try:
                cached = (stamp, self.project().read(path))
            except SpecError:
                cached = (stamp, cached[1])
            self._document_cache[path] = cached
        return cached[1]

    def names(self, path: Path) -> tuple[NameOccurrence, ...]:
        """Return the names in a file, cached with its document; empty if it was never valid."""
        document = self.document(path)
        if document is None:
            return ()
        known = self._name_cache.get(path)
        if known is None or known[0] is not document:
            known = self._name_cache[path] = document, find_names(document)
        return known[1]

    def documents(self) -> Iterator[tuple[Path, Document]]:
        """Yield path and document of each valid spec of the project, sorted by path.

        These are the YAML files below `spec/` and the open texts, not the specs of the
        distribution. Links without a target, also loops of links, are left out.
        """
        files = (self.root / "spec").rglob("*.yaml")
        found = {path.resolve() for path in files if path.exists()}
        for path in sorted(found | set(self.texts)):
            document = self.document(path)
            if document is not None:
                yield path, document

    def find_file(self, name: str, referring_file: Path, is_effect: bool = False) -> Path | None:
        """Return the resolved file of a name or path to which a spec refers; None if there is none.

        A name that ends in .yaml or .yml is a path relative to the folder of `referring_file`. Else
        open files are searched before the index of the project; a name that several files have
        gives None. Only effects are searched with `is_effect`, and none without.
        """
        if name.endswith((".yaml", ".yml")):
            beside = referring_file.parent / name
            return beside.resolve() if beside.is_file() else None
        for path in self.texts:
            document = self.document(path)
            if document and document.name == name and (document.kind == "effect") == is_effect:
                return path
        project = self.project()
        found = (project.effect_index if is_effect else project.index).get(name, [])
        return found[0].resolve() if len(found) == 1 else None

    def is_in_project(self, path: Path) -> bool:
        """Return whether a file is below the folder of the project, so that it may be edited."""
        return path.resolve().is_relative_to(self.root.resolve())


def project_root_of(path: Path) -> Path:
    """Return the folder of the project of a file.

    It is the parent of the outermost folder `spec` above the file, else the folder of the file.
    """
    above = [folder.parent for folder in path.resolve().parents if folder.name == "spec"]
    return above[-1] if above else path.resolve().parent


def root_text(document: Document, key: str) -> str:
    """Return the text of a key at the root of a document; empty if it is absent or no scalar."""
    node = document.root.get(key)
    return node.text if isinstance(node, ScalarNode) else ""
