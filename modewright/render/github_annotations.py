"""Annotations: problems as the commands by which GitHub Actions marks lines of a change."""

from __future__ import annotations

from collections.abc import Iterable

from language.text.diagnostic import Problem


def annotation_lines(problems: Iterable[Problem]) -> str:
    """Return one `::error file=...::message` for each problem."""
    return "".join(f"{_format_annotation(problem)}\n" for problem in problems)


def _format_annotation(problem: Problem) -> str:
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
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _escape_property(text: str) -> str:
    return _escape_data(text).replace(":", "%3A").replace(",", "%2C")
