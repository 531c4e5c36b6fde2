"""Kinds: every kind of problem that the product can report, read from its source."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
FLOORS = ("language", "engine", "codegen", "lockstep", "modewright")
REPORTERS = {"error", "warning", "_report", "Problem"}
PASSED_ON = {("language/problem.py", "Problem"), ("language/dimension.py", "error")}
"""Calls whose kind is an argument of the function that they stand in."""


def kinds() -> dict[str, str]:
    """Return every kind with one place where it is reported."""
    found: dict[str, str] = {}
    for floor in FLOORS:
        for path in sorted((ROOT / floor).rglob("*.py")):
            for kind, line in _reported(path):
                found.setdefault(kind, f"{path.relative_to(ROOT)}:{line}")
    return found


def _reported(path: Path) -> Iterator[tuple[str, int]]:
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if not isinstance(node, ast.Call) or not node.args:
            continue
        called = node.func
        name = called.attr if isinstance(called, ast.Attribute) else getattr(called, "id", "")
        if name not in REPORTERS or (len(node.args) < 2):
            continue
        first = node.args[0]
        if isinstance(first, ast.Constant) and isinstance(first.value, str):
            yield first.value, node.lineno
        elif name != "_report" and (str(path.relative_to(ROOT)), name) not in PASSED_ON:
            raise AssertionError(f"{path}:{node.lineno}: the kind of a problem is a literal")
