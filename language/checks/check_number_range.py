"""Check of numbers: every number of a spec has a finite value near it in the number type."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Iterator, Mapping
from fractions import Fraction

from language.expressions.syntax_tree import NumberLiteral
from language.ir.number_type import round_to_type
from language.model.automaton import Automaton
from language.model.declaration import Input, Parameter, State
from language.text.diagnostic import Problems, Span


def check_numbers(automaton: Automaton, problems: Problems) -> None:
    """Report numbers that are infinite or 0 in the number type, and coinciding points of an axis.

    Examined are literals, values of parameters and defaults of inputs, also of the model; 0 itself
    is none. Ranges are checked by `check_ranges`. Automata of type `float64` have no problem.
    Raises SpecError with all problems if there are errors.
    """
    number = automaton.numbers
    if number == "float64":
        return
    for value, span in dict.fromkeys(_numbers_in(automaton)):
        rounded = round_to_type(value, number)
        if math.isinf(rounded):
            largest = f"{number}, {(2.0 - 2.0**-23) * 2.0**127:.4g}"
            label = f"{_format_short(value)} is beyond the largest {largest}"
            problems.error("value", span, label, "`numbers: float64` has room for it")
        elif rounded == 0.0 and value != 0:
            label = f"{_format_short(value)} is 0 in {number}"
            problems.error("value", span, label, "`numbers: float64` tells it from 0")
    check_ranges(automaton, problems)
    for parameter in automaton.parameters.values():
        for axis in parameter.table.axes if parameter.table else ():
            points = [round_to_type(point, number) for point in axis.points]
            if any(low >= high for low, high in itertools.pairwise(points)):
                label = f"two points of the axis `{axis.name}` are one in {number}"
                problems.error(
                    "table", parameter.span, label, "`numbers: float64` tells them apart"
                )
    problems.raise_if_errors()


def check_ranges(automaton: Automaton, problems: Problems) -> None:
    """Report ranges with a bound that is infinite in the number type of the automaton.

    Examined are inputs, states, discrete variables and parameters, also those of its model.
    """
    for thing in _ranged_declarations(automaton):
        if any(math.isinf(round_to_type(bound, automaton.numbers)) for bound in thing.range or ()):
            label = f"the range of `{thing.name}` goes beyond the largest {automaton.numbers}"
            problems.error("value", thing.span, label, "`numbers: float64` has room for it")


def _ranged_declarations(automaton: Automaton) -> Iterator[Input | State | Parameter]:
    """Yield the inputs, states and parameters of an automaton and of its model."""
    yield from automaton.inputs.values()
    yield from automaton.state_variables.values()
    yield from automaton.parameters.values()
    if automaton.model:
        yield from _ranged_declarations(automaton.model)


def _numbers_in(part: object) -> Iterator[tuple[Fraction, Span]]:
    """Yield every number in a part of a model with its place, recursively."""
    match part:
        case NumberLiteral(value, _, span):
            yield value, span
        case Parameter(value=Fraction() as value, span=span):
            yield value, span
        case Input(default=Fraction() as default, span=span):
            yield default, span
        case Mapping():
            for item in part.values():
                yield from _numbers_in(item)
        case tuple():
            for item in part:
                yield from _numbers_in(item)
        case _ if dataclasses.is_dataclass(part) and not isinstance(part, type | Span):
            for field in dataclasses.fields(part):
                yield from _numbers_in(getattr(part, field.name))


def _format_short(value: Fraction) -> str:
    """Return a number with four significant digits."""
    return f"{float(value):.4g}"
