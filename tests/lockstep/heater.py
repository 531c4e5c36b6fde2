"""The small automaton of tests/codegen/emit/golden: its Program, and a tape of four heatings."""

from __future__ import annotations

from pathlib import Path

from language.ir.program import Program
from lockstep.tick_log import TickLog
from modewright.api.simulation import program
from tests.lockstep.program_strategies import Tick, record_ticks

SPEC = Path(__file__).parents[1] / "codegen" / "emit" / "golden" / "heater.yaml"
PERIOD = 0.1
ROUND = 30
"""Ticks of one round: a request that ends early, a rest, a heating up to the limit."""


def heater() -> Program:
    """Return the Program."""
    return program(str(SPEC))


def temperature(tick: int) -> float:
    """Return the input T [K] of a tick: rising through T_on to T_off."""
    return 320.0 + 0.9 * (tick % ROUND)


def heater_tape() -> TickLog:
    """Return two rounds."""
    inputs: list[Tick] = [
        {"input.T": temperature(tick), "input.request": tick % ROUND != 6}
        for tick in range(2 * ROUND)
    ]
    return record_ticks(heater(), inputs)


def column(tape: TickLog, name: str) -> list[float | int]:
    """Return the values of one variable, tick by tick."""
    position = tape.names.index(name)
    return [tape.unpack(record)[position] for record in tape.values]
