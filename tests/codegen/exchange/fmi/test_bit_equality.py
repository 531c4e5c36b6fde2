"""An FMU that is driven as the engine was gives the bits of the engine, tick by tick."""

from __future__ import annotations

import shutil
import zipfile
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import pytest
from fmpy import read_model_description
from fmpy.build import build_platform_binary

from codegen.exchange.fmi.archive import build_fmu
from codegen.exchange.fmi.variable import Version
from engine.interpreter.apply_calibration import calibrate
from engine.interpreter.interpreter import Interpreter
from language.ir.program import Program
from lockstep.tick_log import TickLog
from modewright.api.simulation import program
from tests.codegen.exchange.fmi.conftest import Ready
from tests.codegen.exchange.fmi.importer import (
    Importer,
    UnpackedFmu,
    count_differences,
    inputs_of,
    unpack_fmu,
)
from tests.codegen.tunable_wait import waiting_automaton
from tests.language.spec_builders import program as made

pytestmark = pytest.mark.long

TICKS = {"estimator": 2101, "supervisor": 2001, "estimator_float32": 1000, "driveline": 1000}
"""Ticks that are compared, and steps of the continuous one."""
EVERY = 5
"""Periods in a communication step of several."""


def held(tape: TickLog, every: int) -> TickLog:
    """Return what the interpreter does where inputs change only every so many ticks."""
    stepper, made = Interpreter(tape.program), TickLog(tape.program, tape.name)
    ticks = [inputs for inputs, _ in inputs_of(tape)]
    for tick in range(len(ticks) // every * every + 1):
        until = -(-tick // every) * every
        for name, value in ticks[min(until, len(ticks) - 1)].items():
            _set(stepper, tape.program, name, value)
        stepper.run("step")
        made.record_tick(stepper)
    return made


def turned(tape: TickLog, pages: dict[int, Fraction]) -> TickLog:
    """Return what the interpreter does where J_em changes at some ticks."""
    stepper, made = Interpreter(tape.program), TickLog(tape.program, tape.name)
    for tick, (inputs, _) in enumerate(inputs_of(tape)):
        if tick in pages:
            assert calibrate(stepper, tape.program, {"J_em": pages[tick]})
        for name, value in inputs.items():
            _set(stepper, tape.program, name, value)
        stepper.run("step")
        made.record_tick(stepper)
    return made


def _set(stepper: Interpreter, program: Program, name: str, value: float) -> None:
    full = name if name.startswith("is_new.") else f"input.{name}"
    kind = next(variable.type for variable in program.variables if variable.name == full)
    if kind == "truth":
        stepper.set(full, value != 0.0)
    else:
        stepper.set(full, int(value) if kind == "whole" else value)


@pytest.mark.parametrize("name", TICKS)
def test_an_fmu_gives_the_bits_of_the_engine(
    name: str, version: Version, ready: Ready, tapes: dict[str, TickLog]
) -> None:
    tape = shortened(tapes[name], TICKS[name])
    values, different = count_differences(Importer(ready(name, version)), tape)
    assert different == []
    assert len(tape.values) == TICKS[name]
    assert values > 12 * TICKS[name]
    assert tape.transitions > 5


def test_a_step_of_several_periods_is_as_many_ticks_with_the_inputs_held(
    version: Version, ready: Ready, tapes: dict[str, TickLog]
) -> None:
    tape = held(tapes["estimator"], EVERY)
    values, different = count_differences(Importer(ready("estimator", version)), tape, EVERY)
    assert different == []
    assert values > 12 * 2000 / EVERY


def test_a_parameter_that_is_set_counts_from_the_next_tick(
    version: Version, ready: Ready, tapes: dict[str, TickLog]
) -> None:
    tape = turned(tapes["estimator"], {700: Fraction("0.06"), 1400: Fraction("0.05")})
    importer = Importer(ready("estimator", version))
    _, different = count_differences(importer, tape)
    assert different == []
    assert importer.messages == ["fault `stale_calibration` is set at 0.69999999999999996 s"]
    assert importer.get(["J_em", "fault.stale_calibration"]) == {
        "J_em": 0.05,
        "fault.stale_calibration": True,
    }


def test_a_parameter_that_comes_with_its_solved_numbers_is_not_stale(
    version: Version, ready: Ready
) -> None:
    importer = Importer(ready("estimator", version))
    importer.start({})
    importer.set({"J_em": 0.06})
    importer.set({"solved.stamp_J_em": 0.06})
    importer.step(0.0, 0.001)
    assert importer.messages == []


@pytest.mark.parametrize(("asked", "enters"), [(None, 5), (9, 9), (0, 0)])
def test_a_tunable_wait_is_set_in_ticks(
    version: Version, asked: int | None, enters: int, tmp_path: Path
) -> None:
    text = waiting_automaton(f"waiting_{version}", "1 ms", "float64", "5 ms", "[0, 50]")
    importer = Importer(unpack_fmu(build_fmu(made(text), version), tmp_path / "fmu", version))
    importer.start({"u": 1.0, **({} if asked is None else {"t_on": asked})})
    modes = []
    for tick in range(12):
        modes.append(importer.get(["mode"])["mode"])
        importer.step(tick * 0.001, 0.001)
    assert modes.index(1) == enters


def test_initialization_mode_shows_tick_0_with_what_is_set(version: Version, ready: Ready) -> None:
    importer = Importer(ready("estimator", version))
    importer.enter()
    importer.set({"y_em": 81.0, "y_w": 10.0})
    assert importer.get(["state.w_em", "state.w_w"]) == {"state.w_em": 81.0, "state.w_w": 10.0}
    importer.set({"y_em": 16.0})
    assert importer.get(["state.w_em", "time"]) == {"state.w_em": 16.0, "time": 0.0}


def test_two_instances_know_nothing_of_each_other(
    version: Version, ready: Ready, tapes: dict[str, TickLog]
) -> None:
    tape, ready_one = tapes["estimator"], ready("estimator", version)
    ticks = [inputs for inputs, _ in inputs_of(tape)][:400]
    alone = [_outputs(ready_one, ticks), _outputs(ready_one, ticks[::-1])]
    pair = [Importer(ready_one, "one"), Importer(ready_one, "two")]
    together: list[list[dict[str, float]]] = [[], []]
    for tick in range(len(ticks)):
        for importer, inputs, found in zip(pair, (ticks, ticks[::-1]), together, strict=True):
            found.append(_stepped(importer, tick, inputs[tick]))
    assert together == alone
    assert alone[0] != alone[1]


@pytest.mark.parametrize("name", ["estimator", "supervisor"])
def test_a_state_that_is_restored_goes_on_with_the_same_bits(
    name: str, version: Version, ready: Ready, tapes: dict[str, TickLog]
) -> None:
    ticks = [inputs for inputs, _ in inputs_of(tapes[name])][:600]
    importer = Importer(ready(name, version))
    first = [_stepped(importer, tick, ticks[tick], name) for tick in range(300)]
    state = importer.save_state()
    data = importer.serialise_state(state)
    rest = [_stepped(importer, tick, ticks[tick], name) for tick in range(300, 600)]
    importer.restore(state)
    assert [_stepped(importer, tick, ticks[tick], name) for tick in range(300, 600)] == rest
    other = Importer(ready(name, version), "other")
    other.restore(other.deserialise_state(data))
    assert [_stepped(other, tick, ticks[tick], name) for tick in range(300, 600)] == rest
    assert first[-1] != rest[-1]


def test_what_is_built_from_the_sources_of_the_archive_gives_the_same_bits(
    version: Version, tmp_path: Path, tapes: dict[str, TickLog]
) -> None:
    if shutil.which("cmake") is None:
        pytest.skip("no cmake: make system-packages")
    (tmp_path / "packed.fmu").write_bytes(
        build_fmu(program("estimator"), version, is_source_only=True)
    )
    with zipfile.ZipFile(tmp_path / "packed.fmu") as archive:
        archive.extractall(tmp_path / "unpacked")
    build_platform_binary(tmp_path / "unpacked", configuration="Release")
    description = read_model_description(str(tmp_path / "unpacked"))
    rebuilt = Importer(UnpackedFmu(version, tmp_path / "unpacked", description))
    _, different = count_differences(rebuilt, shortened(tapes["estimator"], 1000))
    assert different == []


def shortened(tape: TickLog, ticks: int) -> TickLog:
    """Return the first ticks of a tape."""
    made = TickLog(tape.program, tape.name)
    made.inputs, made.values = tape.inputs[:ticks], tape.values[:ticks]
    made.transitions = tape.transitions
    return made


def test_a_value_that_differs_is_seen(
    version: Version, ready: Ready, tapes: dict[str, TickLog]
) -> None:
    """The comparison can fail: one number of the tape is another."""
    tape = shortened(tapes["estimator"], 10)
    wrong = replace(tape, inputs=tape.inputs, values=[*tape.values[:9], tape.values[8]])
    _, different = count_differences(Importer(ready("estimator", version)), wrong)
    assert different
    assert all(line.startswith("tick 9: ") for line in different)


def _outputs(ready_one: UnpackedFmu, ticks: list[dict[str, float]]) -> list[dict[str, float]]:
    importer = Importer(ready_one, "alone")
    return [_stepped(importer, tick, inputs) for tick, inputs in enumerate(ticks)]


def _stepped(
    importer: Importer, tick: int, inputs: dict[str, float], name: str = "estimator"
) -> dict[str, float]:
    period = {"estimator": 0.001, "supervisor": 0.01}[name]
    if tick == 0:
        importer.start(inputs)
    else:
        importer.set(inputs)
        importer.step((tick - 1) * period, period)
    variables = importer.variables.values()
    return importer.get(v.name for v in variables if v.causality in ("output", "local"))
