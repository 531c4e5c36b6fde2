"""Variables: inputs, states and discrete variables with their units."""

from __future__ import annotations

import pytest

from tests.language.spec_builders import automaton, problem_lines

TANK = """language: 1
automaton: tank
inputs: {{T_in: {{unit: degC, default: 20}}}}
states: {{T: {{unit: degC, initial: {initial}}}}}
step: 0.1 s
flow: {{T: 2 s * der(T) = T_in - T}}
outputs: [T]
"""


def test_a_default_without_unit_has_the_unit_of_its_declaration() -> None:
    default = automaton(TANK.format(initial="20 degC")).inputs["T_in"].default
    assert default is not None and float(default) == pytest.approx(293.15, abs=1e-12)


def test_an_initial_value_is_an_expression_and_has_a_unit_of_its_own() -> None:
    lines = problem_lines(lambda: automaton(TANK.format(initial="20")))
    assert lines == ["4:35 this is in `1`, `T` is in `K`"]
