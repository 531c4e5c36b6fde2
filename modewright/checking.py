"""Checking: all problems of a spec of any kind; loads neither numerics nor generator."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from language.document import Scalar
from language.effect import read_effect
from language.load import automaton_of, program_of
from language.map import read_map
from language.problem import Problem, Problems, SpecError
from language.project import Project, expanded, read_document
from language.scenario import read_scenario
from language.system import read_system


def check(reference: str, root: Path | None = None) -> list[Problem]:
    """Return all problems of a spec, warnings too; an empty list means that it is fine."""
    project = Project(root or Path())
    problems = Problems()
    try:
        document = read_document(project.path_of(reference))
        base = expanded(document, project, problems)
        if base.kind == "automaton":
            program_of(automaton_of(document, project, problems=problems))
        elif base.kind == "system":
            for instance in read_system(document, project).instances.values():
                program_of(instance.automaton)
        elif base.kind == "map":
            read_map(document, project)
        elif base.kind == "effect":
            read_effect(document, problems)
            problems.stop_if_any()
        else:
            _check_scenario(reference, project)
    except SpecError as error:
        return list(dict.fromkeys(error.problems))
    return list(dict.fromkeys(problems.found))


def spec_files(root: Path) -> Iterator[Path]:
    """Yield the specs of a project in the order of their paths."""
    yield from sorted((root / "spec").rglob("*.yaml"))


def problem_json(problem: Problem) -> dict[str, Any]:
    """Return a problem as plain data."""
    return {
        "severity": problem.severity,
        "kind": problem.kind,
        "file": problem.span.source.name,
        "line": problem.span.line,
        "column": problem.span.column,
        "message": problem.label,
        "help": problem.help,
    }


def _check_scenario(reference: str, project: Project) -> None:
    document = read_document(project.path_of(reference))
    node = expanded(document, project).root.get("of")
    if isinstance(node, Scalar):
        system = read_system(read_document(project.path_of(node.text, node.span)), project)
        read_scenario(document, project, system)
        return
    problems = Problems()
    problems.error("missing", document.name_span, "a scenario says what system it is `of`")
    raise SpecError(problems.found)
