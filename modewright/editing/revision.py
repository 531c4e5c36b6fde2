"""Revision: a spec as it is, or as it was in a revision of the project's Git repository."""

from __future__ import annotations

import dataclasses
import io
import os
import subprocess
import tarfile
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from language.document import Document, Entry, Items, Node, Scalar, Table
from language.finding import Project
from language.overlay import lay
from language.problem import Problems, Source, Span, SpecError
from language.project import expanded
from language.reader import NOWHERE
from language.tree import put


@contextmanager
def documents(*references: str) -> Iterator[list[Document]]:
    """Yield specs by names or files, `REVISION:` before them perhaps, with all that is laid.

    A revision is taken as a whole: bases and models are those of then. Raises SpecError.
    """
    with tempfile.TemporaryDirectory() as folder:
        yield [
            _document(reference, Path(folder) / str(k)) for k, reference in enumerate(references)
        ]


def _document(reference: str, folder: Path) -> Document:
    revision, colon, spec = reference.partition(":")
    if not colon or Path(reference).exists():
        return _laid(reference, Project(Path()))
    folder.mkdir()
    _extract(reference, revision, folder)
    name = str(folder / spec) if (folder / spec).is_file() else spec
    made = _laid(name, Project(folder))
    root = _shown(made.root, f"{folder}{os.sep}", f"{revision}:")
    return dataclasses.replace(made, root=root if isinstance(root, Table) else made.root)


def _laid(reference: str, project: Project) -> Document:
    problems = Problems()
    made = expanded(project.read(project.path_of(reference)), project, problems)
    problems.stop_if_any()
    return _with_parameters(made, project)


def _with_parameters(document: Document, project: Project) -> Document:
    """Return a document with the parameters of its model, as far as it does not give them anew."""
    model = document.root.get("model")
    if not isinstance(model, Scalar):
        return document
    base = expanded(project.read(project.path_of(model.text, model.span)), project)
    theirs, own = (tree.get("parameters") for tree in (base.root, document.root))
    together = lay(_table(theirs), _table(own), Problems(), template=True)
    return dataclasses.replace(document, root=put(document.root, ("parameters",), together))


def _table(node: Node | None) -> Table:
    return node if isinstance(node, Table) else Table({}, NOWHERE)


def _shown(node: Node, folder: str, revision: str) -> Node:
    """Return a tree whose places name the revision, not the folder that it was written to."""

    def moved(span: Span) -> Span:
        name = span.source.name.replace(folder, revision, 1)
        return dataclasses.replace(span, source=dataclasses.replace(span.source, name=name))

    match node:
        case Scalar():
            return dataclasses.replace(node, span=moved(node.span))
        case Items(nodes):
            parts = tuple(_shown(part, folder, revision) for part in nodes)
            return Items(parts, moved(node.span))
        case Table():
            made = {
                e.key: Entry(e.key, moved(e.span), _shown(e.node, folder, revision)) for e in node
            }
            return Table(made, moved(node.span))


def _extract(reference: str, revision: str, folder: Path) -> None:
    """Write the specs of a revision, those below the working folder, into a folder."""
    try:
        asked = ["git", "archive", "--format=tar", revision, "--", "*.yaml"]
        data = subprocess.run(asked, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        said = getattr(error, "stderr", b"") or str(error).encode()
        first = (said.decode("utf-8", errors="replace").splitlines() or ["no answer"])[0]
        problems = Problems()
        place = Span(Source("command line", (reference,)), 1, 1, len(revision))
        problems.error("name", place, f"Git has no `{revision}` here: {first}")
        raise SpecError(problems.found) from None
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        for member in archive:
            content = archive.extractfile(member) if member.isfile() else None
            target = (folder / member.name).resolve()
            if content is not None and target.is_relative_to(folder.resolve()):
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(content.read())
