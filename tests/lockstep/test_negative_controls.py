"""Negative controls: a lock-step is worth something only if it finds what is wrong with the C."""

from __future__ import annotations

import dataclasses
import math
import struct
from collections.abc import Callable

import pytest

from codegen.emit.c_module import emit_c_files
from codegen.toolchain.target_machine import HOST
from language.ir.program import Program
from language.numerics.evaluate import apply_function
from lockstep.comparison import Difference, compare
from lockstep.tick_log import TickLog
from tests.lockstep.heater import PERIOD, column, heater_tape, temperature

Change = Callable[[str, str], None]


@pytest.fixture
def tape() -> TickLog:
    return heater_tape()


@pytest.fixture
def change(monkeypatch: pytest.MonkeyPatch) -> Change:
    """Replace a text that the generated C has once, in what is compiled."""

    def changed(old: str, new: str) -> None:
        def files(program: Program) -> dict[str, str]:
            found = emit_c_files(program)
            assert sum(text.count(old) for text in found.values()) == 1, old
            return {name: text.replace(old, new) for name, text in found.items()}

        monkeypatch.setattr("codegen.harness.harness.emit_c_files", files)

    return changed


def first_difference(tape: TickLog) -> Difference:
    verdict = compare(tape)
    assert not verdict.is_equal
    assert verdict.first is not None
    return verdict.first


def shown(value: float) -> str:
    return f"{value!r} (0x{struct.pack('>d', value).hex()})"


def shown_whole(value: int) -> str:
    return f"{value} (0x{struct.pack('>q', value).hex()})"


def test_unchanged_c_agrees(tape: TickLog) -> None:
    verdict = compare(tape)
    assert verdict.is_equal
    assert verdict.first is None
    assert (verdict.ticks, verdict.values) == (60, 60 * len(tape.names))
    assert verdict.transitions == column(tape, "memory.fired").count(1) * 2 == 8


def power(tick: int, k_p: float) -> float:
    """Return P of the heater in mode `heating` [W]."""
    kelvin = temperature(tick)
    limited = min(k_p * (345.0 - kelvin), 200.0)
    return limited * math.sqrt(abs(float(apply_function("sin", [kelvin / 330.0]))))


def before_update(tape: TickLog, tick: int) -> float:
    """Return `heat` before the update of a tick: as the reset left it, or the tick before."""
    fired = column(tape, "memory.fired")[tick]
    return 0.1 if fired else float(column(tape, "state.heat")[tick - 1])


def test_one_ulp_in_a_constant_is_found(tape: TickLog, change: Change) -> None:
    next_up = math.nextafter(12.3, 13.0)
    change(".k_P = 12.3,", f".k_P = {next_up!r},")
    heating = [tick for tick, mode in enumerate(column(tape, "memory.mode")) if mode == 1]
    tick = next(tick for tick in heating if power(tick, 12.3) != power(tick, next_up))
    found = first_difference(tape)
    assert (found.tick, found.mode, found.signal) == (tick, "heating", "heat")
    assert found.time == pytest.approx(tick * PERIOD)
    before = before_update(tape, tick)
    assert found.engine == shown(before + power(tick, 12.3) * 0.1 - 7.0 * 0.1)
    assert found.compiled == shown(before + power(tick, next_up) * 0.1 - 7.0 * 0.1)


def test_one_swapped_pair_of_operands_is_found(tape: TickLog, change: Change) -> None:
    old = "self->state.heat + (self->equation.P * constant.t_tick) - constant.P_loss_t_tick;"
    new = "self->state.heat - constant.P_loss_t_tick + (self->equation.P * constant.t_tick);"
    change(old, new)
    found = first_difference(tape)
    assert (found.mode, found.signal) == ("heating", "heat")
    before, watts = before_update(tape, found.tick), power(found.tick, 12.3)
    assert found.engine == shown(before + watts * 0.1 - 7.0 * 0.1)
    assert found.compiled == shown(before - 7.0 * 0.1 + watts * 0.1)


@pytest.mark.parametrize(
    ("old", "new", "early"),
    [
        ("rest_heating > 3U", "rest_heating > 2U", 1),
        ("rest_heating < 4U", "rest_heating < 3U", 0),
    ],
    ids=["fires early", "never fires"],
)
def test_a_wait_that_is_off_by_one_is_found_in_its_tick(
    tape: TickLog, change: Change, old: str, new: str, early: int
) -> None:
    change(old, new)
    fired = column(tape, "memory.fired").index(1)
    found = first_difference(tape)
    assert found.tick == fired - early
    assert found.mode == ("rest" if early else "heating")
    assert found.signal == "heat"


def test_a_dropped_reset_is_found_where_it_would_be_made(tape: TickLog, change: Change) -> None:
    change("self->state.heat = reset_heat;", "(void)reset_heat;")
    fired = column(tape, "memory.fired").index(1)
    found = first_difference(tape)
    assert (found.tick, found.signal, found.mode) == (fired, "heat", "heating")


def test_a_mode_or_fired_transition_alone_is_found(tape: TickLog, change: Change) -> None:
    change("self->fired = heater_FIRED_heating_rest;", "self->fired = 1U;")
    found = first_difference(tape)
    assert found.signal == "fired"
    assert (found.engine, found.compiled) == (shown_whole(2), shown_whole(1))


def test_the_sign_of_zero_is_a_difference(tape: TickLog, change: Change) -> None:
    change("self->equation.P = 0.0;", "self->equation.P = -0.0;")
    found = first_difference(tape)
    assert (found.tick, found.signal) == (0, "P")
    assert (found.engine, found.compiled) == (shown(0.0), shown(-0.0))


def test_nan_is_nan_whatever_its_sign(tape: TickLog, change: Change) -> None:
    position = 8 * tape.names.index("equation.P")
    nan = struct.pack("<d", math.nan)
    tape.values = [r[:position] + nan + r[position + 8 :] for r in tape.values]
    change("self->equation.P = 0.0;", "self->equation.P = -(0.0 / 0.0);")
    first_heating = column(tape, "memory.mode").index(1)
    found = first_difference(tape)
    assert (found.tick, found.signal, found.engine) == (first_heating, "P", shown(math.nan))


def test_every_difference_is_counted(tape: TickLog, change: Change) -> None:
    change("self->equation.P = 0.0;", "self->equation.P = 1.0;")
    modes = column(tape, "memory.mode")
    assert compare(tape).differing == modes.count(0)


def test_a_difference_reads_as_one_line(tape: TickLog, change: Change) -> None:
    change("self->equation.P = 0.0;", "self->equation.P = 1.0;")
    assert str(first_difference(tape)) == (
        "t = 0 s (tick 0), mode `rest`: `P` is 0.0 (0x0000000000000000) in the engine,"
        " 1.0 (0x3ff0000000000000) in C"
    )


def test_time_counts_from_the_start_of_the_tape(tape: TickLog, change: Change) -> None:
    change("self->fired = heater_FIRED_heating_rest;", "self->fired = 1U;")
    tape.start = 17.5
    found = first_difference(tape)
    assert found.time == pytest.approx(17.5 + found.tick * PERIOD)


def test_missing_output_is_refused(tape: TickLog) -> None:
    silent = dataclasses.replace(HOST, run=lambda target, records: b"\0" * 8)
    with pytest.raises(ValueError, match=r"C wrote 8 bytes, \d+ were expected"):
        compare(tape, machine=silent)
