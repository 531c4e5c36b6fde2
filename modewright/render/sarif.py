"""SARIF output: convert problems to SARIF 2.1.0 (OASIS 2020) for code hosts and editors."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import PurePath
from typing import Any

from language.text.diagnostic import Problem
from language.text.error_codes import code_of, meaning_of

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"
"""The schema of the format."""


def to_sarif(problems: Sequence[Problem]) -> dict[str, Any]:
    """Return problems as a SARIF log with one run, in their order.

    The rules are the kinds of these problems only, sorted by code. Columns count code points; the
    level is the severity.
    """
    kinds = sorted({problem.kind for problem in problems}, key=code_of)
    places = {kind: index for index, kind in enumerate(kinds)}
    driver = {
        "name": "modewright",
        "version": version("modewright"),
        "rules": [_rule(kind) for kind in kinds],
    }
    results = [_result(problem, places[problem.kind]) for problem in problems]
    run = {"tool": {"driver": driver}, "columnKind": "unicodeCodePoints", "results": results}
    return {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}


def _rule(kind: str) -> dict[str, Any]:
    """Return the SARIF rule of a kind of problem."""
    return {"id": code_of(kind), "name": kind, "shortDescription": {"text": meaning_of(kind)}}


def _result(problem: Problem, rule: int) -> dict[str, Any]:
    """Return the SARIF result of a problem."""
    span = problem.span
    text = f"{problem.label}. {problem.help}" if problem.help else problem.label
    region = {
        "startLine": max(1, span.line),
        "startColumn": max(1, span.column),
        "endColumn": max(1, span.column) + span.width,
    }
    artifact = {"uri": PurePath(span.source.name).as_posix()}
    return {
        "ruleId": problem.code,
        "ruleIndex": rule,
        "level": problem.severity,
        "message": {"text": text},
        "locations": [{"physicalLocation": {"artifactLocation": artifact, "region": region}}],
    }
