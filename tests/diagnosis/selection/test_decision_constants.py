"""The decision, the search and the selection have few constants of their own."""

from __future__ import annotations

import ast
from pathlib import Path

from tests.language.spec_builders import ROOT

MAX_CONSTANTS = 15
FREE = (0, 1, 2, 0.5)
"""Numbers that are no choice."""
MODULES = ("criterion/*.py", "selection/*.py", "pipeline/decision.py")


def numbers_in(path: Path) -> list[float]:
    """The numeric literals of a module without those of `FREE`."""
    literals = (
        node.value
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Constant) and not isinstance(node.value, bool)
    )
    return [one for one in literals if isinstance(one, int | float) and one not in FREE]


def test_there_are_at_most_15_constants() -> None:
    paths = [path for pattern in MODULES for path in (ROOT / "diagnosis").glob(pattern)]
    assert len(paths) > 10
    found = {path.name: numbers_in(path) for path in paths}
    assert sum(map(len, found.values())) <= MAX_CONSTANTS, found
