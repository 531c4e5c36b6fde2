"""Program passes: a named function from Program to Program, with the properties that it changes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from language.ir.program import Program

if TYPE_CHECKING:
    from language.ircheck.check_program import Property


@dataclass(frozen=True)
class ProgramPass:
    """A pass: its name on the command line, its summary, and its function.

    The docstring of the module of `run` has the rule, before -> after. `establishes` are properties
    that hold after the pass, `invalidates` those that may not hold after it.
    """

    name: str
    summary: str
    run: Callable[[Program], Program]
    establishes: frozenset[Property] = frozenset()
    invalidates: frozenset[Property] = frozenset()

    def properties_after(self, before: frozenset[Property]) -> frozenset[Property]:
        """Return the properties that hold after the pass, given those that hold before it."""
        return (before - self.invalidates) | self.establishes


@dataclass(frozen=True)
class PassResult:
    """A Program before and after a pass, and the properties that hold after it."""

    step: ProgramPass
    before: Program
    after: Program
    properties: frozenset[Property]


LOWERED_PROPERTIES: frozenset[Property] = frozenset({"no-unused-parameters"})
"""The properties of a Program that no pass has changed."""


def run_each(program: Program, passes: Iterable[ProgramPass]) -> Iterator[PassResult]:
    """Yield the result of each pass in order; each pass gets the Program of the one before."""
    properties = LOWERED_PROPERTIES
    for step in passes:
        properties = step.properties_after(properties)
        after = step.run(program)
        yield PassResult(step, program, after, properties)
        program = after
