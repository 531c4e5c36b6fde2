"""Reading: an A2L by a parser of others (pya2ldb)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pya2l.model as model
from pya2l import import_a2l


@contextmanager
def open_database(text: str, folder: Path) -> Iterator[Any]:
    """Give the database that the parser makes of a text."""
    (folder / "read.a2l").write_text(text)
    session = import_a2l(
        str(folder / "read.a2l"),
        encoding="ascii",
        in_memory=True,
        progress_bar=False,
        loglevel="ERROR",
    )
    try:
        yield session
    finally:
        session.close()


def elements_of_kind(session: Any, kind: str) -> dict[str, Any]:
    """Return all elements of a kind, such as Measurement, by name."""
    return {one.name: one for one in session.query(getattr(model, kind)).all()}
