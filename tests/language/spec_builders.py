"""Making: documents, models and Programs out of texts, and what the user is told about a text."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import TypeVar

from engine.interpreter.interpreter import Interpreter
from language.expressions.parser import parse_expression
from language.expressions.syntax_tree import SyntaxTree
from language.expressions.units import Dimension, parse_unit
from language.ir.program import Program
from language.loading.load import automaton_of, program_of
from language.model.automaton import Automaton
from language.overlays.expand_document import Project, parse_document, read_document
from language.text.diagnostic import Problem, Problems, Source, Span, SpecError
from language.text.document import Document, ScalarNode

ROOT = Path(__file__).parents[2]
SHIPPED = Project(ROOT)
NOWHERE = Span(Source("nowhere"), 1, 1)

Made = TypeVar("Made")


def scalar(text: str, name: str = "here") -> ScalarNode:
    return ScalarNode(text, Span(Source(name, (text,)), 1, 1, max(1, len(text))))


def tree(text: str) -> SyntaxTree:
    return parse_expression(scalar(text))


def document(text: str, name: str = "here.yaml") -> Document:
    return parse_document(Source(name, tuple(text.splitlines())), text)


def automaton(text: str, project: Project = SHIPPED, **values: str) -> Automaton:
    given = {name: scalar(value) for name, value in values.items()}
    return automaton_of(document(text), project, given)


def program(text: str, project: Project = SHIPPED, **values: str) -> Program:
    return program_of(automaton(text, project, **values))


def stepper(text: str, project: Project = SHIPPED, **values: str) -> Interpreter:
    return Interpreter(program(text, project, **values))


@cache
def load_shipped(name: str, **values: str) -> Automaton:
    given = {key: scalar(value) for key, value in values.items()}
    return automaton_of(read_document(SHIPPED.path_of(name)), SHIPPED, given)


def project_of(folder: Path, **files: str) -> Project:
    """Return a project of some files: `spec/<name>.yaml`."""
    (folder / "spec").mkdir(exist_ok=True)
    for name, text in files.items():
        (folder / "spec" / f"{name}.yaml").write_text(text, "utf-8")
    return Project(folder)


def solve_constants(made: Program) -> dict[str, float]:
    """Return the constants of a Program by name."""
    return {constant.name: constant.value for constant in made.constants}


def dimension(unit: str) -> Dimension:
    return parse_unit(unit).dimension


def si_value(text: str) -> Fraction:
    """Return a literal such as `3 deg` in SI, exactly."""
    number, _, unit = text.partition(" ")
    return Fraction(number) * parse_unit(unit or "1").factor


def raised_problems(make: Callable[[], object]) -> tuple[Problem, ...]:
    """Return the problems that something is refused with; () if it is not."""
    try:
        make()
    except SpecError as error:
        return tuple(dict.fromkeys(error.problems))
    except RecursionError:
        raise AssertionError("no refusal, but RecursionError") from None  # a thousand lines less
    return ()


def problem_lines(make: Callable[[], object]) -> list[str]:
    """Return what the user is told: `line:column label` of each problem."""
    return [f"{p.span.line}:{p.span.column} {p.label}" for p in raised_problems(make)]


def problem_labels(problems: Problems) -> list[str]:
    return [problem.label for problem in problems.reported]
