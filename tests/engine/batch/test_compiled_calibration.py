"""Compiled page: whatever runs in C has the calibration of the interpreter, tables among it."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from codegen.predictor.predictor import Predictor, build_predictor, columns_of
from codegen.simulator.compiled_stepper import CompiledStepper
from codegen.simulator.simulator_library import load_library
from codegen.toolchain.compiler import flags_at_level
from engine.batch.batch import Batch, SignalStatistic
from engine.batch.compiled_batch import CompiledBatch
from engine.batch.compiled_run import CompiledRun
from engine.batch.interpreted_batch import run_interpreted_batch
from engine.interpreter.interpreter import Interpreter
from engine.results.trajectory import Trajectory
from engine.simulation.instance_programs import programs_of
from engine.simulation.simulate import simulate
from modewright.api.simulation import Loaded, load
from tests.language.spec_builders import project_of

QUICK = flags_at_level("O0")
TUNED = """language: 1
automaton: {name}
{time}
numbers: {number}
parameters:
  gain: {{value: 0.7, tunable: true, range: [0, 9]}}
  twice: {{derived: gain * 2}}
  whole: {{value: 3, type: int, tunable: true}}
  flag: {{value: true, type: bool, tunable: true}}
  gear: {{value: drive, type: enum, values: [park, drive], tunable: true}}
  line: {{table: {{over: u, points: {{0: 10, 1: {end}}}}}, tunable: true}}
  area: {{table: {{over: [u, v], points: {{0: {{0: 1, 1: 2}}, 1: {{0: 4, 1: 8}}}}}}, tunable: true}}
inputs: {{u: {{range: [0, 1]}}, v: {{range: [0, 1]}}}}
equations:
  y_line: lookup(line, u)
  y_plane: lookup(area, u, v)
  y_rest: twice + whole
{state}
initial: waiting
modes:
  waiting: {{transitions: {{driven: {{when: flag and gear == drive}}}}}}
  driven: {{{driven}}}
outputs: [mode, y_line, y_plane, y_rest, x]
"""
TICKING = ("period: 10 ms", "discrete: {x: {initial: 0}}", "update: {x: x + y_line}")
FLOWING = (
    "method: rk4\nstep: 10 ms",
    "states: {x: {initial: 0}}\nflow: {x: 1 * der(x) = (y_line + y_plane + y_rest) * (1 / 1 s)}",
    "",
)
KINDS = {
    f"{kind}_{number}": (number, *text)
    for kind, text in (("ticking", TICKING), ("flowing", FLOWING))
    for number in ("float32", "float64")
}


def tuned(name: str, end: float) -> str:
    number, time, state, driven = KINDS[name]
    return TUNED.format(name=name, time=time, state=state, driven=driven, number=number, end=end)


def four(folder: Path, end: float = 20) -> Loaded:
    """Return a system of a sampled and a continuous automaton of either number type."""
    instances = ", ".join(f"{name}: {{of: {name}}}" for name in KINDS)
    wires = ", ".join(f"{name}.{wire}: {wire}" for name in KINDS for wire in "uv")
    texts = {name: tuned(name, end) for name in KINDS}
    texts["four"] = f"""language: 1
system: four
inputs: {{u: {{default: 0.4}}, v: {{default: 0.7}}}}
instances: {{{instances}}}
connections: {{{wires}}}
"""
    texts["short"] = "language: 1\nscenario: short\nof: four\nhorizon: 50 ms\n"
    project_of(folder, **texts)
    return load("four", "short", root=folder)


def bits(run: Trajectory) -> dict[str, bytes]:
    return {name: values.tobytes() for name, values in run.signals.items()}


def test_a_run_and_each_block_of_it_read_the_page_of_the_spec(tmp_path: Path) -> None:
    loaded = four(tmp_path)
    system, scenario = loaded.system, loaded.scenario
    theirs = simulate(system, scenario)
    for name in KINDS:
        assert theirs.signals[f"{name}.y_line"][-1] == pytest.approx(14)
        assert theirs.signals[f"{name}.y_plane"][-1] == pytest.approx(3.74)
        assert theirs.signals[f"{name}.y_rest"][-1] == pytest.approx(4.4)
        assert theirs.signals[f"{name}.mode"][-1] == 1
    programs = programs_of(system, scenario)
    whole = CompiledRun(system, scenario, programs, partial(load_library, flags=QUICK)).trajectory()
    assert whole is not None
    assert bits(whole) == bits(theirs)
    blocks = simulate(system, scenario, partial(CompiledStepper, flags=QUICK))
    assert bits(blocks) == bits(theirs)


def test_a_batch_reads_the_page_beside_what_it_varies(tmp_path: Path) -> None:
    """With a table other than that of the run before."""
    loaded = four(tmp_path, end=24.3)
    signals = [f"{name}.{wire}" for name in KINDS for wire in ("y_line", "y_plane", "y_rest", "x")]
    batch = Batch(
        loaded.system,
        loaded.scenario,
        2,
        parameters={f"{name}.gain": np.array([0.7, 1.3]) for name in KINDS},
        statistics=tuple(SignalStatistic(signal, signal, "final") for signal in signals),
    )
    mine, theirs = (
        CompiledBatch(batch, partial(load_library, flags=QUICK)).run(),
        run_interpreted_batch(batch),
    )
    assert mine.note == "compiled"
    for name, values in theirs.statistics.items():
        assert mine.statistics[name].tobytes() == values.tobytes(), name
    assert len(set(theirs.statistics["flowing_float32.x"])) == 2
    assert theirs.statistics["ticking_float64.y_line"].tolist() == [pytest.approx(15.72)] * 2


def test_a_batch_does_not_vary_a_table(tmp_path: Path) -> None:
    loaded = four(tmp_path)
    values = {"ticking_float64.line": np.array([1.0])}
    with pytest.raises(ValueError, match="line` is a table"):
        run_interpreted_batch(Batch(loaded.system, loaded.scenario, 1, parameters=values))


@pytest.mark.parametrize("name", ["flowing_float32", "flowing_float64"])
def test_a_predictor_reads_the_tables_that_its_page_does_not_hold(
    tmp_path: Path, name: str
) -> None:
    loaded = four(tmp_path)
    program = programs_of(loaded.system, loaded.scenario)[name]
    columns = columns_of(program, ("x",))
    inputs, no_gain = np.tile([0.4, 0.7], (5, 1)), np.zeros((1, 1, 1))
    with build_predictor(program, columns) as library:
        page = np.array(list(columns.page.values()))
        held = np.zeros(2, dtype=np.int64)
        run = Predictor(columns, library).predict(
            page, inputs, np.zeros((5, 1)), no_gain[:0], no_gain, 1, linear_inputs=held
        )
    theirs, found = Interpreter(program), []
    for row in inputs:
        for wire, value in zip(columns.inputs, row, strict=True):
            theirs.set(f"input.{wire}", value)
        theirs.run("step")
        found.append(theirs.get("state.x"))
    assert run.states[:, 0].tolist() == found
    assert found[-1] > 0.8
