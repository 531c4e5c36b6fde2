"""Flowing: a continuous model that runs inside the tick of a sampled automaton."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from engine.interpreter.interpreter import Interpreter
from language.ir.program import Program
from tests.language.spec_builders import program, project_of

MODEL = """language: 1
automaton: m
parameters: {{{parameters}}}
inputs: {{u: {{unit: 1/s, default: 0 1/s}}}}
states: {{{states}}}
initial: one
modes:
  one: {{flow: {{{flow}}}, transitions: {{{leave}}}}}
{two}
"""
CLOCK = """language: 1
automaton: s
period: {period}
numbers: float64
model: m
inputs: {{u: {{unit: 1/s, default: 0 1/s}}}}
states: {{{states}}}
modes: {{go: {{runs: {{of: m.one, method: {method}, substeps: {substeps}, events: 4}}}}}}
"""


@dataclass(frozen=True)
class Flow:
    """Balances of mode `one` (and `other` of mode `two`, which `leave` leads to), start values.

    `widths` are those of the states' ranges, 10 if not given; all is without unit but the time.
    """

    folder: Path
    flow: str
    start: Mapping[str, float]
    parameters: str = ""
    leave: str = ""
    other: str = ""
    widths: Mapping[str, float] = field(default_factory=dict)

    def program(
        self, period: str = "1 s", substeps: int = 1, method: str = "exponential"
    ) -> Program:
        states = ", ".join(self._state(name) for name in self.start)
        two = f"  two: {{flow: {{{self.other}}}}}" if self.other else ""
        body = MODEL.format(
            parameters=self.parameters, states=states, flow=self.flow, leave=self.leave, two=two
        )
        project = project_of(self.folder, m=body)
        clock = CLOCK.format(period=period, substeps=substeps, method=method, states=states)
        return program(clock, project)

    def _state(self, name: str) -> str:
        half = self.widths.get(name, 10.0) / 2
        return f'{name}: {{unit: "1", initial: {self.start[name]}, range: [-{half}, {half}]}}'

    def run_ticks(
        self, count: int, u: float = 0.0, period: str = "1 s", substeps: int = 1
    ) -> dict[str, float]:
        """Return the states after some periods; tick 0 only starts."""
        inside = Interpreter(self.program(period, substeps))
        inside.set("input.u", u)
        for _ in range(count + 1):
            inside.run("step")
        return {name: float(inside.get(f"state.{name}")) for name in self.start}
