"""Kinds: every kind of problem that the product can report, read from its source."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[3]
FLOORS = (
    "language",
    "engine",
    "codegen",
    "expectation",
    "lockstep",
    "sweep",
    "diagnosis",
    "modewright",
)
KIND = re.compile(r"[a-z]+(-[a-z]+)*")
"""Loggers have `warning` too: their messages are no kinds."""
REPORTERS = {"error": 0, "warning": 0, "Problem": 0}
"""What reports a problem, and which of its arguments is the kind."""


def kinds() -> dict[str, str]:
    """Return every kind with one place where it is reported."""
    found: dict[str, str] = {}
    for floor in FLOORS:
        for path in sorted((ROOT / floor).rglob("*.py")):
            for kind, line in reported_kinds(path.read_text("utf-8")):
                found.setdefault(kind, f"{path.relative_to(ROOT)}:{line}")
    return found


def reported_kinds(text: str) -> Iterator[tuple[str, int]]:
    """Yield the kinds that a source reports, with their lines; also through its own helpers."""
    tree = ast.parse(text)
    reporters = dict(REPORTERS)
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            position = _kind_passed_on(function)
            if position is not None:
                reporters.setdefault(function.name, position)
    for call in _calls(tree):
        position = reporters.get(_called(call), len(call.args))
        for kind in _literals(call.args[position] if position < len(call.args) else None):
            yield kind, call.lineno


def _kind_passed_on(function: ast.FunctionDef) -> int | None:
    """Return which argument of a function is the kind of the problem that it reports."""
    names = [argument.arg for argument in function.args.args if argument.arg != "self"]
    for call in _calls(function):
        first = call.args[0] if call.args else None
        if _called(call) in REPORTERS and isinstance(first, ast.Name) and first.id in names:
            return names.index(first.id)
    return None


def _calls(tree: ast.AST) -> Iterator[ast.Call]:
    return (node for node in ast.walk(tree) if isinstance(node, ast.Call))


def _called(call: ast.Call) -> str:
    return call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")


def _literals(node: ast.expr | None) -> Iterator[str]:
    if isinstance(node, ast.IfExp):
        yield from _literals(node.body)
        yield from _literals(node.orelse)
    elif isinstance(node, ast.Constant) and KIND.fullmatch(str(node.value)):
        yield str(node.value)
