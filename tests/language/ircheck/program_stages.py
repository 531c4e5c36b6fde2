"""Stages: a Program after lowering and after each pass of language and generator, by name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random

from codegen.passes.pass_list import c_passes
from language.ir.number_type import NumberType
from language.ir.program import Program
from language.ircheck.check_program import Property
from language.loading.load import lower_automaton
from language.passes.pass_list import LANGUAGE_PASSES
from language.passes.program_pass import LOWERED_PROPERTIES, run_each
from tests.lockstep.random_specs.spec import automaton
from tests.lockstep.random_specs.spec_kinds import random_spec


@dataclass(frozen=True)
class Stage:
    """A Program, the pass that made it, and the properties that hold after it."""

    name: str
    program: Program
    properties: frozenset[Property]


def stages(program: Program) -> Iterator[Stage]:
    """Yield the stages of a Program that no pass has changed, both fast paths included."""
    yield Stage("lowered", program, LOWERED_PROPERTIES)
    for result in run_each(program, (*LANGUAGE_PASSES, *c_passes())):
        yield Stage(result.step.name, result.after, result.properties)
        if result.step.name == "unused-parameters":
            program = result.after
    for result in run_each(program, c_passes(by_magnitude=False, fast_path="anew")):
        yield Stage(f"{result.step.name} of a predictor", result.after, result.properties)


def random_program(seed: int, number: NumberType, folder: Path) -> Program:
    """Return the Program of a random spec before all passes."""
    return lower_automaton(automaton(random_spec(Random(seed), "found"), number, folder))
