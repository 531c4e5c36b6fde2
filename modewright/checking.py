"""Checking: all problems of a spec of any kind; loads neither numerics nor generator."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from expectation.reader import read_test
from language.calibration import read_calibration
from language.document import Document, Scalar
from language.effect import read_effect
from language.examine import examine
from language.load import automaton_of, lowered
from language.map import read_map
from language.model import Automaton
from language.numbers_text import motion_lines
from language.problem import Problem, Problems, SpecError, ordered
from language.program import Program
from language.project import Project, expanded, with_calibrations
from language.scenario import read_scenario
from language.system import read_system
from sweep.study_reader import read_study


@dataclass(frozen=True)
class Checked:
    """All problems of a spec, warnings too; of an automaton the limits of its step, as lines."""

    problems: tuple[Problem, ...]
    limits: tuple[str, ...] = ()


def check(reference: str, root: Path | None = None) -> list[Problem]:
    """Return all problems of a spec, warnings too; an empty list means that it is fine."""
    return list(checked(reference, root).problems)


def checked(
    reference: str, root: Path | None = None, texts: Mapping[Path, str] | None = None
) -> Checked:
    """Return all problems of a spec, and the largest stable step of each mode of an automaton.

    `texts` are those of an editor, by resolved path: they stand for what is on the disk.
    """
    return _checked(reference, Project(root or Path(), texts or {}), _Further(lowered, examine))


def errors_first(reference: str, root: Path, texts: Mapping[Path, str]) -> Checked:
    """Return what `checked` does without what takes long: solved numbers, and proofs."""
    nothing = _Further(lambda automaton: None, lambda automaton, problems: None)
    return _checked(reference, Project(root, texts), nothing)


@dataclass(frozen=True)
class _Further:
    """What is done with an automaton without errors: its Program is made, it is looked at."""

    lower: Callable[[Automaton], Program | None]
    examine: Callable[[Automaton, Problems], None]


def _checked(reference: str, project: Project, further: _Further) -> Checked:
    """Return what is found of a spec."""
    problems = Problems()
    limits: tuple[str, ...] = ()
    try:
        document = project.read(project.path_of(reference))
        is_calibration = document.kind == "calibration"
        if is_calibration:
            document = _calibrated(document, reference, project, problems)
        base = expanded(document, project, problems)
        if base.kind == "automaton":
            automaton = automaton_of(document, project, problems=problems)
            program = further.lower(automaton)
            motion = program.motion if program else None
            further.examine(automaton, problems)
            if motion and motion.limits and not is_calibration:
                first, *others = motion_lines(motion)
                limits = (f"{document.name}: {first}", *others)
        elif base.kind == "system":
            instances = read_system(document, project).instances.values()
            for part in {id(each.automaton): each.automaton for each in instances}.values():
                further.lower(part)
        elif base.kind == "map":
            read_map(document, project)
        elif base.kind == "effect":
            read_effect(document, problems)
            problems.stop_if_any()
        elif base.kind == "study":
            read_study(document, project, problems=problems)
        elif base.kind == "test":
            read_test(document, project, problems)
        else:
            _check_scenario(reference, project)
    except SpecError as error:
        return Checked(tuple(dict.fromkeys(error.problems)))
    return Checked(tuple(dict.fromkeys(problems.found)), limits)


def _calibrated(
    document: Document, reference: str, project: Project, problems: Problems
) -> Document:
    """Return what a calibration is of, calibrated by it: so its values are checked there."""
    of = read_calibration(document, problems).of
    problems.stop_if_any()
    base = project.read(project.path_of(of.text, of.span))
    return with_calibrations(base, [str(project.path_of(reference))], reference)


def all_problems(found: Iterable[Checked]) -> list[Problem]:
    """Return the problems of several specs, each once, in the order of their places."""
    return ordered(problem for each in found for problem in each.problems)


def spec_files(root: Path) -> Iterator[Path]:
    """Yield the specs of a project in the order of their paths."""
    yield from sorted((root / "spec").rglob("*.yaml"))


def problem_json(problem: Problem) -> dict[str, Any]:
    """Return a problem as plain data."""
    return {
        "severity": problem.severity,
        "code": problem.code,
        "kind": problem.kind,
        "file": problem.span.source.name,
        "line": problem.span.line,
        "column": problem.span.column,
        "message": problem.label,
        "help": problem.help,
    }


def _check_scenario(reference: str, project: Project) -> None:
    document = project.read(project.path_of(reference))
    node = expanded(document, project).root.get("of")
    if isinstance(node, Scalar):
        system = read_system(project.read(project.path_of(node.text, node.span)), project)
        read_scenario(document, project, system)
        return
    problems = Problems()
    problems.error("missing", document.name_span, "a scenario says what system it is `of`")
    raise SpecError(problems.found)
