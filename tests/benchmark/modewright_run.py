"""Ours: a manoeuvre as a system and a scenario of modewright, made ready to be run many times."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np

import modewright as mw
from codegen.simulator.simulator_library import load_library
from engine.batch.compiled_run import CompiledRun
from engine.results.trajectory import Trajectory
from engine.simulation.instance_programs import programs_of
from engine.simulation.simulate import simulate
from engine.simulation.stimuli import resolve_recording
from language.ir.program import Program
from language.model.system import Scenario, System
from tests.benchmark.manoeuvre import NOMINAL, Manoeuvre
from tests.benchmark.reference_solution import Solution

UNITS = {"k_hs": "N*m/rad", "c_hs": "N*m*s/rad", "J_em": "kg*m^2"}
SPEC = """\
language: 1
variant: bench_driveline
extends: driveline
step: {step}
parameters: {{{parameters}}}
---
language: 1
system: bench
inputs: {{T_req: {{unit: N*m}}}}
instances: {{plant: {{of: bench_driveline}}}}
connections: {{plant.T_em: T_req}}
---
language: 1
scenario: bench_run
of: bench
horizon: {horizon} ms
initial: {{plant.w_em: {w_em} rad/s, plant.w_w: {w_w} rad/s, plant.theta_d: {theta_d} rad}}
inputs: {{T_req: {{start: {before} N*m, steps: {{{at} ms: {after} N*m}}}}}}
record: {{every: {every}, signals: [plant.w_em]}}
"""


@dataclass(frozen=True)
class PreparedRun:
    """A system and scenario that are loaded, checked and lowered: what can be run."""

    system: System
    scenario: Scenario
    programs: Mapping[str, Program]

    def interpreted(self) -> Trajectory:
        """Run once by the interpreter."""
        return simulate(self.system, self.scenario, programs=self.programs)

    def compiled(self) -> CompiledRun:
        """Return the run in compiled C, which can be carried out again and again."""
        scenario = resolve_recording(self.scenario)
        return CompiledRun(self.system, scenario, self.programs, load_library)


@cache
def prepare_run(case: Manoeuvre, step: str, every: str | None = None) -> PreparedRun:
    """Return a manoeuvre at a step like `4 ms`; the motor's speed is kept at each of them."""
    w_em, w_w, theta_d, _ = (_digits(value) for value in case.start())
    changed = {
        name: f"{{value: {text} {UNITS[name]}}}"
        for name, text in case.parameters.items()
        if NOMINAL[name] != text
    }
    text = SPEC.format(
        step=step,
        parameters=", ".join(f"{name}: {value}" for name, value in changed.items()),
        horizon=case.horizon_ms,
        w_em=w_em,
        w_w=w_w,
        theta_d=theta_d,
        before=case.torques[0],
        after=case.torques[1],
        at=case.step_ms,
        every=every or step,
    )
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "spec").mkdir()
        for number, part in enumerate(text.split("---\n")):
            (Path(folder) / "spec" / f"{number}.yaml").write_text(part)
        loaded = mw.load("bench", "bench_run", root=Path(folder))
    return PreparedRun(loaded.system, loaded.scenario, programs_of(loaded.system, loaded.scenario))


def solution(trajectory: Trajectory) -> Solution:
    """Return what a trajectory says of events and of the motor's speed."""
    modes = {"drive_contact": 1, "no_contact": 0, "coast_contact": -1}
    events = tuple((event.time, modes[event.target]) for event in trajectory.events)
    milliseconds = trajectory.times * 1000
    whole = np.abs(milliseconds - np.round(milliseconds)) < 1e-6
    times = tuple(np.round(milliseconds[whole]).astype(int).tolist())
    w_em = np.asarray(trajectory.signals["plant.w_em"], dtype=np.float64)
    return Solution(events, times, w_em[whole])


def _digits(value: Fraction) -> str:
    """Return a number with 25 decimals: more than a double keeps."""
    whole, rest = divmod(value.numerator * 10**25 // value.denominator, 10**25)
    return f"{whole}.{rest:025}"
