"""Decision constants: names, values and reasons, from the code of the criteria."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from tests.validation.evidence.evidence_store import ROOT

PACKAGE = "diagnosis/criterion"


@dataclass(frozen=True)
class DecisionConstant:
    """A number of the decision, with the docstring under it as its reason, in one line."""

    name: str
    value: float
    reason: str
    module: str


def decision_constants(folder: Path = ROOT / PACKAGE) -> list[DecisionConstant]:
    """Return all numeric constants of the modules of a package below the root, by module."""
    return [one for path in sorted(folder.glob("*.py")) for one in _constants_of(path)]


def _constants_of(path: Path) -> list[DecisionConstant]:
    """Return the numeric constants of a module; their names are in capitals."""
    relative = path.relative_to(ROOT).with_suffix("")
    module = import_module(".".join(relative.parts))
    statements = ast.parse(path.read_text("utf-8")).body
    found = []
    for k, statement in enumerate(statements):
        name = _assigned_name(statement)
        value = getattr(module, name, None) if name.isupper() else None
        if isinstance(value, int | float) and not isinstance(value, bool):
            reason = _docstring(statements[k + 1]) if k + 1 < len(statements) else ""
            found.append(DecisionConstant(name, float(value), reason, relative.as_posix() + ".py"))
    return found


def _assigned_name(statement: ast.stmt) -> str:
    """Return the name that a statement assigns; empty for other statements."""
    if isinstance(statement, ast.Assign):
        (target, *_) = statement.targets
    elif isinstance(statement, ast.AnnAssign):
        target = statement.target
    else:
        return ""
    return target.id if isinstance(target, ast.Name) else ""


def _docstring(statement: ast.stmt) -> str:
    """Return the text of a statement that is a string, in one line; else an empty text."""
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        text = statement.value.value
        return " ".join(text.split()) if isinstance(text, str) else ""
    return ""
