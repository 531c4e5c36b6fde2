"""An editor that talks to the server, with a text or a project open in it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.modewright.lsp.client import LspClient
from tests.modewright.lsp.heater import HEATER, ROOT


@pytest.fixture(scope="module")
def talk() -> Iterator[LspClient]:
    with LspClient(("utf-8", "utf-16")) as made:
        yield made


@pytest.fixture
def heater(talk: LspClient, tmp_path: Path) -> Path:
    path = tmp_path / "spec" / "heater.yaml"
    path.parent.mkdir()
    path.write_text("language: 1\nautomaton: heater\n")  # the editor's text counts, not this
    told = talk.open(path, HEATER)
    assert told == [], told
    return path


@pytest.fixture
def driveline(talk: LspClient, tmp_path: Path) -> Path:
    shutil.copytree(ROOT / "spec" / "ev_driveline", tmp_path / "spec")
    path = tmp_path / "spec" / "plant.yaml"
    assert talk.open(path, path.read_text()) == []
    return path
