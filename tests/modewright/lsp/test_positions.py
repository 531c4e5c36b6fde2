"""Positions: which file a URI of the editor denotes."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from lsprotocol import types

from modewright.lsp.open_documents import OpenDocuments
from modewright.lsp.positions import path_of, uri_of

NAMES = ["a.yaml", "two words.yaml", "ä.yaml", "a#b.yaml", "a?b.yaml", "a;b.yaml", "50%.yaml"]


@pytest.mark.parametrize("name", NAMES)
def test_the_path_of_the_uri_of_a_file_is_that_of_the_file(tmp_path: Path, name: str) -> None:
    assert path_of(uri_of(tmp_path / name)) == tmp_path / name


def test_a_semicolon_needs_no_escape(tmp_path: Path) -> None:
    assert path_of(f"{tmp_path.as_uri()}/a;b.yaml") == tmp_path / "a;b.yaml"


@pytest.mark.parametrize(
    "uri", ["git:{path}?ref=HEAD", "untitled:{path}", "vscode-vfs://host{path}"]
)
def test_a_uri_of_another_scheme_is_no_file(tmp_path: Path, uri: str) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("language: 1\n")
    other = path_of(uri.format(path=path))
    assert other != path and not other.exists()


def test_a_text_of_another_scheme_does_not_replace_that_of_a_file(tmp_path: Path) -> None:
    (tmp_path / "spec").mkdir()
    path = tmp_path / "spec" / "a.yaml"
    path.write_text("language: 1\n")
    published: dict[str, list[types.Diagnostic]] = {}

    async def edit() -> None:
        documents = OpenDocuments(lambda uri, version, found: published.update({uri: found}))
        documents.update(path.as_uri(), 1, "language: 1\nautomaton: now\n")
        documents.update(f"git:{path}", 1, "language: 1\nautomaton: before\n")
        workspace, _ = documents.workspace_of(path.as_uri())
        assert workspace.texts[path] == "language: 1\nautomaton: now\n"
        assert documents.check_task
        await documents.check_task
        assert documents.proof_task
        documents.proof_task.cancel()

    asyncio.run(edit())
    assert set(published) == {path.as_uri(), f"git:{path}"}
