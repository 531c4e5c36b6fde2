"""Git revision: load specs from the working folder or from a revision of the repository."""

from __future__ import annotations

import dataclasses
import io
import os
import subprocess
import tarfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from codegen.toolchain.external_tools import require_tool
from language.overlays.expand_document import expand_document
from language.readers.base_reader import NO_SPAN
from language.text.diagnostic import Problem, Problems, Source, Span, SpecError
from language.text.document import Document, Entry, MappingNode, ScalarNode, SequenceNode, YamlNode
from language.text.node_edit import put_node
from language.text.overlay import apply_overlay
from language.text.project_files import Project
from language.text.temporary_files import temporary_folder


@contextmanager
def load_documents(*references: str) -> Iterator[list[Document]]:
    """Yield the expanded specs in the given order, with the parameters of their models.

    A reference is the name or file of a spec below the working folder, or `REVISION:spec` for a
    revision of Git; an existing file takes precedence. Bases and models come from the same
    revision. Files of a revision are in a temporary folder until the context ends. Raises
    SpecError, also if Git does not know the revision, and MissingToolError if Git is not installed.
    """
    with temporary_folder() as folder:
        yield [_load_document(reference, folder / str(k)) for k, reference in enumerate(references)]


def _load_document(reference: str, folder: Path) -> Document:
    """Return an expanded spec; the places of a revision's spec name the revision."""
    revision, colon, spec = reference.partition(":")
    if not colon or Path(reference).exists():
        return _load_expanded(reference, Project(Path()))
    folder.mkdir()
    _extract_revision(reference, revision, folder)
    name = str(folder / spec) if (folder / spec).is_file() else spec
    made = _load_expanded(name, Project(folder))
    root = _relabel_source(made.root, f"{folder}{os.sep}", f"{revision}:")
    return dataclasses.replace(made, root=root if isinstance(root, MappingNode) else made.root)


def _load_expanded(reference: str, project: Project) -> Document:
    """Return an expanded spec with the parameters of its model. Raises SpecError."""
    problems = Problems()
    made = expand_document(project.read(project.path_of(reference)), project, problems)
    problems.raise_if_errors()
    return _add_model_parameters(made, project)


def _add_model_parameters(document: Document, project: Project) -> Document:
    """Return a document with the parameters of its model, unless it defines them itself."""
    model = document.root.get("model")
    if not isinstance(model, ScalarNode):
        return document
    base = expand_document(project.read(project.path_of(model.text, model.span)), project)
    theirs, own = (tree.get("parameters") for tree in (base.root, document.root))
    together = apply_overlay(
        _table_or_empty(theirs), _table_or_empty(own), Problems(), is_template=True
    )
    return dataclasses.replace(document, root=put_node(document.root, ("parameters",), together))


def _table_or_empty(node: YamlNode | None) -> MappingNode:
    """Return a mapping node, or an empty one for other nodes."""
    return node if isinstance(node, MappingNode) else MappingNode({}, NO_SPAN)


def _relabel_source(node: YamlNode, folder: str, revision: str) -> YamlNode:
    """Return a tree whose places name a revision instead of a temporary folder."""

    def moved(span: Span) -> Span:
        name = span.source.name.replace(folder, revision, 1)
        return dataclasses.replace(span, source=dataclasses.replace(span.source, name=name))

    match node:
        case ScalarNode():
            return dataclasses.replace(node, span=moved(node.span))
        case SequenceNode(nodes):
            parts = tuple(_relabel_source(part, folder, revision) for part in nodes)
            return SequenceNode(parts, moved(node.span))
        case MappingNode():
            made = {
                e.key: Entry(e.key, moved(e.span), _relabel_source(e.node, folder, revision))
                for e in node
            }
            return MappingNode(made, moved(node.span))


def _extract_revision(reference: str, revision: str, folder: Path) -> None:
    """Write the specs of a revision below the working folder into a folder.

    Raises SpecError if Git does not know the revision, MissingToolError without Git. A text that
    begins with `-` is no revision: Git would read it as an option.
    """
    place = Span(Source("command line", (reference,)), 1, 1, max(1, len(revision)))
    if revision.startswith("-"):
        label = f"`{revision}` is no revision of Git: it begins with `-`"
        raise SpecError([Problem("name", place, label, "like `HEAD~1:room`")])
    try:
        command = [require_tool("git"), "archive", "--format=tar", revision, "--", "*.yaml"]
        data = subprocess.run(command, capture_output=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        output = getattr(error, "stderr", b"") or str(error).encode()
        first = (output.decode("utf-8", errors="replace").splitlines() or ["no answer"])[0]
        raise SpecError(
            [Problem("name", place, f"Git has no `{revision}` here: {first}")]
        ) from None
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        for member in archive:
            content = archive.extractfile(member) if member.isfile() else None
            target = (folder / member.name).resolve()
            if content is not None and target.is_relative_to(folder.resolve()):
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(content.read())
