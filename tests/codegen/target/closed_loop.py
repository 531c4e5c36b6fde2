"""Closed loop: long seeded runs of the shipped systems, as the interpreter carried them out."""

from __future__ import annotations

import random
import tempfile
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path

from language.ir.number_type import NumberType
from language.loading.system_reader import with_number_type
from lockstep.tick_log import TickLog, record_ticks
from modewright.api.simulation import load

TICK = Fraction(1, 100)
"""Of the supervisor, and of the slower estimator [s]."""
WORDS: Mapping[str, Callable[[random.Random], str]] = {
    "key": lambda draw: draw.choice(["parked", "ignition", "crank", "crank", "crank"]),
    "U_dc": lambda draw: draw.choice(["0 V", "395 V", "395 V", "395 V", "250 V"]),
    "T_req": lambda draw: f"{draw.uniform(-200, 250):.3f} N*m",
    "v": lambda draw: f"{draw.uniform(-2, 40):.3f} m/s",
    "temp": lambda draw: f"{draw.uniform(20, 110):.2f} degC",
    "hv_ok": lambda draw: "false" if draw.random() < 0.05 else "true",
    "clear": lambda draw: "true" if draw.random() < 0.3 else "false",
}
"""How each input of the supervisor is drawn."""
CHANGES = Fraction(1, 4)
"""Seconds after which inputs change."""


def record_driveline(
    number: NumberType, horizon: Fraction, instances: Sequence[str]
) -> dict[str, TickLog]:
    """Return tapes of instances of the driveline with its estimators: a torque that steps."""
    draw = random.Random(f"driveline {horizon}")
    count = int(horizon / Fraction(2, 5))
    steps = {Fraction(2 * k, 5): f"{draw.randint(-60, 60)} N*m" for k in range(1, count)}
    speeds = "initial: {plant.w_w: 30 rad/s}"
    return _run("ev_driveline", number, horizon, {"T_req": ("20 N*m", steps)}, instances, speeds)


def record_supervisor(number: NumberType, horizon: Fraction) -> dict[str, TickLog]:
    """Return the tape of the supervisor: keys, voltages, temperatures and faults as they come."""
    draw = random.Random(f"supervisor {horizon}")
    times = [CHANGES * k for k in range(1, int(horizon / CHANGES))]
    courses = {
        name: (word(draw), {time: word(draw) for time in times}) for name, word in WORDS.items()
    }
    return _run("supervised", number, horizon, courses, ["sup"])


def _run(
    system: str,
    number: NumberType,
    horizon: Fraction,
    courses: Mapping[str, tuple[str, Mapping[Fraction, str]]],
    instances: Sequence[str],
    extra: str = "",
) -> dict[str, TickLog]:
    lines = ["language: 1", "scenario: long", f"of: {system}", f"horizon: {float(horizon)} s"]
    lines += [extra, "inputs:"]
    for name, (start, steps) in courses.items():
        listed = ", ".join(f"{float(time)} s: {word}" for time, word in steps.items())
        lines.append(f"  {name}: {{start: {start}, steps: {{{listed}}}}}")
    lines.append("record: {every: 1 s}")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scenario_long.yaml"
        path.write_text("\n".join([*lines, ""]))
        loaded = load(system, str(path))
    run, tapes = record_ticks(with_number_type(loaded.system, number), loaded.scenario)
    assert run.stopped is None, run.stopped
    return {name: tapes[name] for name in instances}
