"""Load: from a name or path to a checked Automaton, and from that to its Program."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from language.automaton import read_automaton
from language.check import check_automaton
from language.check_number import check_numbers
from language.continuous import continuous_program
from language.document import Document, Node, Scalar
from language.hoist import hoisted
from language.model import Automaton
from language.problem import Problems, Source, Span
from language.program import Program
from language.project import Project
from language.sampled import sampled_program


def automaton_of(
    document: Document,
    project: Project,
    values: Mapping[str, Node] | None = None,
    problems: Problems | None = None,
) -> Automaton:
    """Return the checked automaton of a document; warnings are left in `problems`.

    Raises SpecError with all problems.
    """
    problems = problems or Problems()
    return check_automaton(read_automaton(document, project, values, problems), problems)


def load_automaton(
    reference: str, project: Project, values: Mapping[str, Node] | None = None
) -> Automaton:
    """Return the checked automaton of a name or path. Raises SpecError with all problems."""
    return automaton_of(project.read(project.path_of(reference)), project, values)


def program_of(automaton: Automaton, varying: Collection[str] = ()) -> Program:
    """Return the Program of a checked automaton; `varying` inputs change inside its steps.

    Raises SpecError.
    """
    return hoisted(lowered(automaton, varying))


def lowered(automaton: Automaton, varying: Collection[str] = ()) -> Program:
    """Return the Program of a checked automaton before it is optimised. Raises SpecError."""
    problems = Problems()
    check_numbers(automaton, problems)
    if automaton.is_sampled:
        return sampled_program(automaton, problems)
    return continuous_program(automaton, problems, varying)


def command_line_value(text: str, option: str = "--set", name: str = "") -> Scalar:
    """Return a value given on the command line, as a scalar with a place in `name=value`."""
    shown = f"{name}={text}" if name else text
    place = Span(Source(option, (shown,)), 1, 1 + len(shown) - len(text), max(1, len(text)))
    return Scalar(text, place)
