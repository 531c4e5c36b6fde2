"""Checking: report all problems of a spec of any kind, without importing numerics or generator."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from expectation.expectation_reader import read_test
from language.checks.warning_checks import check_warnings
from language.ir.program import Program
from language.loading.load import automaton_of, lower_automaton
from language.loading.recording_map_reader import read_map
from language.loading.scenario_reader import read_scenario
from language.loading.system_reader import read_system
from language.model.automaton import Automaton
from language.overlays.calibration import read_calibration
from language.overlays.effect_reader import read_effect
from language.overlays.expand_document import Project, add_calibrations, expand_document
from language.programs.solved_numbers_report import format_method_lines
from language.text.arguments import PathText, to_project, to_text
from language.text.diagnostic import Problem, Problems, Source, Span, SpecError, sort_problems
from language.text.document import Document, ScalarNode
from language.text.project_files import display_path
from sweep.definition.study_reader import read_study


@dataclass(frozen=True)
class CheckResult:
    """The problems of a spec including warnings.

    `limits` are lines about the step of an automaton.
    """

    problems: tuple[Problem, ...]
    limits: tuple[str, ...] = ()


def check(reference: PathText, root: PathText | None = None) -> list[Problem]:
    """Return all problems of a spec including warnings, each once; an empty list if there are none.

    `reference` is a name or path below `root` (default: the working folder). Errors of the spec,
    also a missing file, are returned and not raised.
    """
    return list(check_spec(reference, root).problems)


def check_spec(
    reference: PathText, root: PathText | None = None, texts: Mapping[Path, str] | None = None
) -> CheckResult:
    """Return all problems of a spec, each once, and lines about the largest stable steps.

    There are such lines for an automaton with continuous states and without errors only, not for a
    calibration. A calibration is checked on its base; the automata of a system are lowered, too.
    `texts` are unsaved texts of an editor by resolved path; they replace the files. SpecError is
    not raised but converted to problems.
    """
    return _run_checks(
        to_text(reference, "reference"),
        to_project(root, texts),
        _DeepChecks(lower_automaton, check_warnings),
    )


def check_without_proofs(reference: str, root: Path, texts: Mapping[Path, str]) -> CheckResult:
    """Return the result of `check_spec` without the slow steps, so that `limits` are empty.

    These steps are the lowering to a Program, which computes solved numbers, and the warnings that
    need proofs.
    """
    skip_deep_checks = _DeepChecks(lambda automaton: None, lambda automaton, problems: None)
    return _run_checks(reference, Project(root, texts), skip_deep_checks)


@dataclass(frozen=True)
class _DeepChecks:
    """The slow steps for a valid automaton: lowering to a Program, and checks with proofs."""

    lower: Callable[[Automaton], Program | None]
    examine: Callable[[Automaton, Problems], None]


def _run_checks(reference: str, project: Project, deep_checks: _DeepChecks) -> CheckResult:
    """Return the problems of a spec according to its kind."""
    problems = Problems()
    limits: tuple[str, ...] = ()
    try:
        document = project.read(project.path_of(reference))
        is_calibration = document.kind == "calibration"
        if is_calibration:
            document = _apply_calibration(document, reference, project, problems)
        expanded_document = expand_document(document, project, problems)
        if expanded_document.kind == "automaton":
            automaton = automaton_of(document, project, problems=problems)
            program = deep_checks.lower(automaton)
            motion = program.integration if program else None
            deep_checks.examine(automaton, problems)
            if motion and motion.stability_limits and not is_calibration:
                first, *others = format_method_lines(motion)
                limits = (f"{document.name}: {first}", *others)
        elif expanded_document.kind == "system":
            instances = read_system(document, project).instances.values()
            for part in {id(each.automaton): each.automaton for each in instances}.values():
                deep_checks.lower(part)
        elif expanded_document.kind == "map":
            read_map(document, project)
        elif expanded_document.kind == "effect":
            read_effect(document, problems)
            problems.raise_if_errors()
        elif expanded_document.kind == "study":
            read_study(document, project, problems=problems)
        elif expanded_document.kind == "test":
            read_test(document, project, problems)
        else:
            _check_scenario(reference, project)
    except SpecError as error:
        return CheckResult(tuple(dict.fromkeys(error.problems)))
    return CheckResult(tuple(dict.fromkeys(problems.reported)), limits)


def _apply_calibration(
    document: Document, reference: str, project: Project, problems: Problems
) -> Document:
    """Return the base of a calibration with the calibration applied, so that its values are
    checked.
    """
    of = read_calibration(document, problems).of
    problems.raise_if_errors()
    base = project.read(project.path_of(of.text, of.span))
    return add_calibrations(base, [str(project.path_of(reference))], reference)


def merge_problems(results: Iterable[CheckResult]) -> list[Problem]:
    """Return the problems of several specs, each once, sorted by file, line, column and label."""
    return sort_problems(problem for each in results for problem in each.problems)


def spec_files(root: PathText) -> Iterator[Path]:
    """Yield the files `*.yaml` below `spec/` of a project, at any depth, sorted by path."""
    yield from sorted((to_project(root).root / "spec").rglob("*.yaml"))


def no_spec_error(folder: Path) -> SpecError:
    """Return the error about a folder of specs that has no spec or does not exist."""
    reason = "" if folder.is_dir() else ": the folder does not exist"
    label = f"there is no spec below {display_path(folder)}{reason}"
    place = Span(Source(display_path(folder)), 1, 1)
    return SpecError([Problem("missing", place, label, f"searched: {folder.absolute()}")])


def problem_json(problem: Problem) -> dict[str, Any]:
    """Return a problem as a dict for JSON.

    The keys are severity, code, kind, file, line, column, message and help (empty if there is
    none).
    """
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
    """Check a scenario against the system that it names. Raises SpecError."""
    document = project.read(project.path_of(reference))
    node = expand_document(document, project).root.get("of")
    if isinstance(node, ScalarNode):
        system = read_system(project.read(project.path_of(node.text, node.span)), project)
        read_scenario(document, project, system)
        return
    raise SpecError(
        [Problem("missing", document.name_span, "a scenario says what system it is `of`")]
    )
