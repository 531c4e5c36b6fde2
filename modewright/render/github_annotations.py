"""GitHub annotations: print problems as workflow commands of GitHub Actions."""

from __future__ import annotations

from collections.abc import Iterable

from language.text.diagnostic import Problem


def annotation_lines(problems: Iterable[Problem]) -> str:
    """Return one line `::severity file=...,line=...::message` for each problem, in its order.

    The message includes the help; reserved characters are escaped as GitHub Actions requires. Empty
    without problems.
    """
    return "".join(f"{_format_annotation(problem)}\n" for problem in problems)


def _format_annotation(problem: Problem) -> str:
    """Return the workflow command of a problem."""
    span = problem.span
    values = {
        "file": span.source.name,
        "line": str(max(1, span.line)),
        "col": str(max(1, span.column)),
        "endColumn": str(max(1, span.column) + span.width),
        "title": problem.code,
    }
    parts = ",".join(f"{name}={_escape_property(value)}" for name, value in values.items())
    text = f"{problem.label}\nhelp: {problem.help}" if problem.help else problem.label
    return f"::{problem.severity} {parts}::{_escape_data(text)}"


def _escape_data(text: str) -> str:
    """Return a text escaped as the message of a workflow command."""
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _escape_property(text: str) -> str:
    """Return a text escaped as a property of a workflow command."""
    return _escape_data(text).replace(":", "%3A").replace(",", "%2C")
