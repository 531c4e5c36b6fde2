"""Diagnostics: convert the problems of a check to diagnostics of the protocol."""

from __future__ import annotations

from pathlib import Path

from lsprotocol import types

from language.text.diagnostic import Problem
from modewright.api.spec_check import CheckResult, check_without_proofs
from modewright.lsp.positions import range_of, uri_of
from modewright.lsp.workspace import Workspace

SOURCE = "modewright"
"""The source of diagnostics."""
SEVERITIES = {
    "error": types.DiagnosticSeverity.Error,
    "warning": types.DiagnosticSeverity.Warning,
}
"""Severities of the protocol."""
FILE_START = types.Range(types.Position(0, 0), types.Position(0, 0))
"""The range at the start of a file."""


def check_quickly(workspace: Workspace, path: Path) -> list[types.Diagnostic]:
    """Return the problems of a file as by `check_without_proofs`, with the open texts.

    Problems in other files are shown at the start of this one. An exception becomes a single
    diagnostic, so that other files are still checked.
    """
    try:
        found = check_without_proofs(str(path), workspace.root, dict(workspace.texts))
    except Exception as defect:
        message = f"a defect of modewright: {type(defect).__name__}: {defect}\n"
        message += f"help: `modewright check {path.stem}` writes a report"
        return [types.Diagnostic(FILE_START, message, SEVERITIES["error"], source=SOURCE)]
    return to_diagnostics(found, path, workspace.encoding)


def to_diagnostics(result: CheckResult, path: Path, encoding: str) -> list[types.Diagnostic]:
    """Return the problems of a check as diagnostics of the file `path`, in their order.

    The message contains the help in a line `help: ...`. A problem in another file is at the start
    of `path`, with a related location. `encoding` is that of columns.
    """
    return [_to_diagnostic(problem, path.resolve(), encoding) for problem in result.problems]


def _to_diagnostic(problem: Problem, path: Path, encoding: str) -> types.Diagnostic:
    """Return a problem as a diagnostic; one in another file gets a related location."""
    message = f"{problem.label}\nhelp: {problem.help}" if problem.help else problem.label
    place = Path(problem.span.source.name).resolve()
    related = None
    where = range_of(problem.span, encoding)
    if place != path:
        location = types.Location(uri_of(place), where)
        related = [types.DiagnosticRelatedInformation(location, problem.label)]
        message = f"in {problem.span}: {message}"
        where = FILE_START
    return types.Diagnostic(
        range=where,
        message=message,
        severity=SEVERITIES[problem.severity],
        code=problem.code,
        source=SOURCE,
        related_information=related,
    )
