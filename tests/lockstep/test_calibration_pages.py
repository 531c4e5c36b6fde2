"""Pages: five tunables change in the middle of a run, in the engine and in C at the same tick."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from codegen.emit.c_module import emit_c_files
from engine.simulation.simulate import simulate
from language.ir.number_type import NUMBER_TYPES, NumberType, round_to_type
from language.ir.program import Program
from language.loading.calibration_page_reader import parse_pages
from language.loading.system_reader import with_number_type
from language.text.diagnostic import SpecError
from lockstep.comparison import compare
from lockstep.tick_log import TickLog, record_ticks
from modewright.api.simulation import load, lockstep
from tests.lockstep.heater import column

ROOT = Path(__file__).parent / "tuned"
TURNED = 517
"""The first tick after 0.5165 s."""
TUNED = {"J_em": 0.051, "k_hs": 5000.0, "c_hs": 16.0, "sd_em": 0.25, "q_w": 31.0}


def estimator(number: NumberType) -> TickLog:
    """Return the estimator's tape in a number type."""
    loaded = load("tuned", "retuned", root=ROOT)
    run, tapes = record_ticks(with_number_type(loaded.system, number), loaded.scenario)
    assert run.stopped is None
    return tapes["est"]


@pytest.mark.parametrize("number", NUMBER_TYPES)
def test_both_sides_turn_the_page_at_the_same_tick(number: NumberType) -> None:
    tape = estimator(number)
    verdict = compare(tape)
    assert verdict.is_equal, str(verdict.first)
    assert verdict.ticks == 701 and verdict.transitions == 5
    turned = [tick for tick, record in enumerate(tape.inputs) if len(record) > len(tape.inputs[0])]
    assert turned == [TURNED, 600]
    names = tuple(
        constant.name for constant in tape.program.constants if constant.kind == "tunable"
    )
    assert sorted(names) == sorted(f"calibration.{name}" for name in TUNED)


@pytest.mark.parametrize("number", NUMBER_TYPES)
def test_what_follows_is_derived_anew_and_stale_numbers_set_their_fault(number: NumberType) -> None:
    tape = estimator(number)
    derived = column(tape, "equation.w_free"), column(tape, "state.theta_d")
    twist = zip(*derived, column(tape, "state.theta_b"), strict=True)
    for tick, (free, theta_d, theta_b) in enumerate(twist):
        k_hs, c_hs = (4800.0, 14.0) if tick < TURNED else (TUNED["k_hs"], TUNED["c_hs"])
        ratio = round_to_type(k_hs / c_hs, number)
        assert free == round_to_type(ratio * round_to_type(theta_d - theta_b, number), number)
    faults = column(tape, "memory.faults")
    stale = 1 << tape.program.faults.index("stale_calibration")
    assert [fault & stale for fault in map(int, faults)] == [0] * TURNED + [stale] * (701 - TURNED)


def test_c_that_does_not_compare_stamps_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = emit_c_files

    def without(program: Program) -> dict[str, str]:
        files = plain(program)
        name = f"{program.name}.c"
        head, mark, tail = files[name].partition("_Calibrate(")
        files[name] = head + mark + tail.replace("    compare_stamps(self, cal);\n", "", 1)
        return files

    monkeypatch.setattr("codegen.harness.harness.emit_c_files", without)
    found = compare(estimator("float64")).first
    assert found and (found.tick, found.signal) == (TURNED, "faults")


def test_the_command_line_gives_pages_too() -> None:
    changes = ["0.5165 s: est.k_hs = 5000 N*m/rad", "0.5165 s: sd_em=0.25 rad/s"]
    _, verdicts = lockstep("tuned", "retuned", root=ROOT, changes=changes, numbers="float32")
    assert all(verdict.is_equal for verdict in verdicts)
    assert {verdict.name: verdict.ticks for verdict in verdicts}["est"] == 701
    system = load("tuned", "retuned", root=ROOT).system
    (page,) = parse_pages(changes, system)
    assert page.values.keys() == {("est", "k_hs"), ("est", "sd_em")}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("k_hs = 5000 N*m/rad", "a change of the calibration is `time: parameter = value`"),
        ("1 s: T_hs = 1 N*m", "`T_hs` is not a tunable parameter of `tuned`"),
        ("1 s: est.J_em = 3 kg*m^2", "the value of `J_em` is outside its range"),
        ("1 s: est.J_em = 3 kg", "`kg` does not fit the unit `kg*m^2`"),
        ("1 m: est.J_em = 0.06 kg*m^2", "`the time of a page` is a time above zero, like `2.5 s`"),
    ],
)
def test_a_change_that_cannot_be_made_is_refused(text: str, message: str) -> None:
    system = load("tuned", "retuned", root=ROOT).system
    with pytest.raises(SpecError) as refused:
        parse_pages([text], system)
    assert message in [problem.label for problem in refused.value.problems]


def test_a_plant_takes_a_new_calibration_at_its_time() -> None:
    """J_em is tunable in the plant too: `J_em` without an instance is all of them."""
    loaded = load("tuned", "retuned", root=ROOT)
    run = simulate(loaded.system, loaded.scenario)
    other = simulate(loaded.system, dataclasses.replace(loaded.scenario, calibrations=()))
    speeds, before = run.signals["plant.w_em"], other.signals["plant.w_em"]
    same = [bool(a == b) for a, b in zip(speeds, before, strict=True)]
    assert all(same[:517]) and not any(same[518:])
