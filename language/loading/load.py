"""Loading: from a name or path to a checked Automaton, and from there to its Program."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from language.checks.check_automaton import check_automaton
from language.checks.check_number_range import check_numbers
from language.checks.check_temperatures import has_celsius, parameters_used_as_differences
from language.expressions.parser import parse_expression
from language.ir.program import Program
from language.loading.automaton_reader import read_automaton
from language.model.automaton import Automaton
from language.overlays.expand_document import Project
from language.passes.pass_list import run_passes
from language.programs.continuous_program import lower_continuous_automaton
from language.programs.sampled_program import lower_sampled_automaton
from language.text.diagnostic import Problems, Source, Span
from language.text.document import Document, ScalarNode, YamlNode


def automaton_of(
    document: Document,
    project: Project,
    values: Mapping[str, YamlNode] | None = None,
    problems: Problems | None = None,
) -> Automaton:
    """Return the checked automaton of a document with some parameter values replaced.

    `values` are new values by name. Warnings are added to `problems`. Raises SpecError with all
    problems, those in `problems` included. A new value in degC of a parameter that is used as a
    difference of temperatures is an error, too.
    """
    problems = problems or Problems()
    automaton = check_automaton(read_automaton(document, project, values, problems), problems)
    _refuse_celsius_differences(automaton, values or {}, problems)
    return automaton


def _refuse_celsius_differences(
    automaton: Automaton, values: Mapping[str, YamlNode], problems: Problems
) -> None:
    """Raise SpecError for each new value in degC that would be used as a difference."""
    in_celsius = {
        name: node
        for name, node in values.items()
        if isinstance(node, ScalarNode) and has_celsius(parse_expression(node))
    }
    for name in sorted(parameters_used_as_differences(automaton, in_celsius)):
        label = f"`{name}` is a difference of temperatures: 3 degC are 276.15 K"
        problems.error("temperature", in_celsius[name].span, label, "write it in K, like `3 K`")
    problems.raise_if_errors()


def load_automaton(reference: str, project: Project) -> Automaton:
    """Return the checked automaton of a name or path. Raises SpecError with all problems.

    Warnings are discarded.
    """
    return automaton_of(project.read(project.path_of(reference)), project)


def program_of(automaton: Automaton, varying: Collection[str] = ()) -> Program:
    """Return the optimised Program of a checked automaton.

    `varying` are the inputs that change inside a step of a continuous automaton; it is ignored for
    a sampled one. Raises SpecError for numbers that the number type cannot hold and for constructs
    that cannot be lowered.
    """
    return run_passes(lower_automaton(automaton, varying))


def lower_automaton(automaton: Automaton, varying: Collection[str] = ()) -> Program:
    """Return the Program of a checked automaton before the passes. Raises SpecError.

    The numbers are checked first (`check_numbers`). `varying` are the inputs that change inside a
    step of a continuous automaton; it is ignored for a sampled one.
    """
    problems = Problems()
    check_numbers(automaton, problems)
    if automaton.is_sampled:
        return lower_sampled_automaton(automaton, problems)
    return lower_continuous_automaton(automaton, problems, varying)


def command_line_value(text: str, name: str = "") -> ScalarNode:
    """Return a value of the command line as a scalar; problems point to it in the text `name=text`.

    Without a name they point into `text` alone. The text is not parsed.
    """
    shown = f"{name}={text}" if name else text
    place = Span(Source("--set", (shown,)), 1, 1 + len(shown) - len(text), max(1, len(text)))
    return ScalarNode(text, place)
