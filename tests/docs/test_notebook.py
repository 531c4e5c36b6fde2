"""The notebook of the driveline runs from top to bottom and shows what it says."""

from __future__ import annotations

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).parents[2] / "docs" / "ev_driveline.ipynb"
SECONDS = 240
"""Longest time of one cell before it is given up; the whole takes about 15 s."""


@pytest.mark.long
def test_the_notebook_runs_and_every_picture_is_shown(tmp_path: Path) -> None:
    book = nbformat.read(NOTEBOOK, as_version=4)  # type: ignore[no-untyped-call]
    where = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(book, timeout=SECONDS, kernel_name="python3", resources=where).execute()
    cells = [cell for cell in book.cells if cell.cell_type == "code"]
    shown = [
        kind
        for cell in cells
        for output in cell.outputs
        for kind in output.get("data", {})
        if kind.startswith("image/")
    ]
    assert shown == ["image/svg+xml", "image/png", "image/png"]
    printed = "".join(output.get("text", "") for cell in cells for output in cell.outputs)
    assert "0.506013945 s: drive_contact -> no_contact" in printed
    assert printed.count("values, 0 differ") == 3
    assert (tmp_path / "run.csv").exists()


def test_the_notebook_is_kept_without_results() -> None:
    for cell in nbformat.read(NOTEBOOK, as_version=4).cells:  # type: ignore[no-untyped-call]
        assert cell.get("outputs", []) == []
        assert cell.get("execution_count") is None
