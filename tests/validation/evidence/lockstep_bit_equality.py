"""Verify lock-step: differing bits over a million steps per type, of plant and of estimators.

Seeded torques and speeds swing the driveline through its gap. Resumable: a part that was run with
the same Program is not run again; docs/evidence/lockstep.json holds every part.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import os
import random
import sys
from collections.abc import Iterator
from fractions import Fraction

from engine.interpreter.interpreter import Interpreter
from engine.simulation.instance_programs import programs_of
from engine.simulation.simulate import simulate
from language.ir.number_type import NUMBER_TYPES, NumberType
from language.ir.printer import digest
from language.ir.program import Program
from language.loading.load import program_of
from language.loading.stimulus_reader import constant_pieces
from language.loading.system_reader import single_instance_system, with_number_type
from language.model.system import Stimulus
from lockstep.comparison import compare
from lockstep.tick_log import TickLog
from modewright.api.simulation import Loaded, load
from tests.validation.evidence.evidence_store import ROOT, write_json

EVIDENCE = ROOT / "docs" / "evidence" / "lockstep.json"
PART = 50_000
"""Ticks of one tape: some seconds of the interpreter and 10 MB."""
RATIO, STIFFNESS = 8.1, 4800.0
"""Gear ratio and half-shaft stiffness [N*m/rad] of the driveline, for speeds that are likely."""


def main() -> int:
    """Run the parts that are missing; return 0 if there are enough and no bit differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ticks", type=int, default=1_000_000, help="per type, of each")
    ticks: int = parser.parse_args().ticks
    os.chdir(ROOT)
    found = json.loads(EVIDENCE.read_text()) if EVIDENCE.exists() else {}
    for number in NUMBER_TYPES:
        sampled = estimators(number)
        for program in [*sampled, plant(number)]:
            parts = -(-ticks // (PART * (len(sampled) if program.period else 1)))
            kept = found.get(f"{program.name} {number}", {})
            if kept.get("digest") != digest(program):
                kept = {"digest": digest(program), "parts": {}}
            found[f"{program.name} {number}"] = kept
            for part in range(parts):
                if str(part) not in kept["parts"]:
                    kept["parts"][str(part)] = measured(program, part)
                    write_json(EVIDENCE, found, sort_keys=True)
                    print(f"{program.name} {number} part {part}: {kept['parts'][str(part)]}")
    return report(found, ticks)


def estimators(number: NumberType) -> list[Program]:
    """Return the sampled instances of the shipped system in a number type."""
    system = with_number_type(load("ev_driveline", "tip_out").system, number)
    automata = [instance.automaton for instance in system.instances.values()]
    return [program_of(automaton) for automaton in automata if automaton.is_sampled]


def plant(number: NumberType) -> Program:
    """Return the continuous instance of the shipped system in a number type."""
    loaded = driven(number, 0)
    return programs_of(loaded.system, loaded.scenario)["driveline"]


def driven(number: NumberType, part: int) -> Loaded:
    """Return the plant alone with a torque that steps every 0.4 s, for as many steps as a part."""
    loaded = load("ev_driveline", "tip_out")
    automaton = with_number_type(loaded.system, number).instances["plant"].automaton
    draw = random.Random(f"plant {part}")
    horizon = automaton.step * PART
    starts = [Fraction(2 * k, 5) for k in range(int(horizon * 5 / 2) + 1)]
    torque = constant_pieces([(start, Fraction(draw.randint(-60, 60))) for start in starts])
    given = {
        n: Stimulus(constant_pieces([(Fraction(0), i.default or Fraction(0))]))
        for n, i in automaton.inputs.items()
    }
    scenario = dataclasses.replace(
        loaded.scenario,
        of="driveline",
        horizon=horizon,
        initial={},
        inputs={**given, "T_em": Stimulus(torque)},
        every=Fraction(1),
    )
    return Loaded(single_instance_system(automaton), scenario)


def measured(program: Program, part: int) -> dict[str, int]:
    """Return what one tape gives."""
    tape = estimated(program, part) if program.period else moved(program, part)
    verdict = compare(tape)
    return {
        "ticks": verdict.ticks,
        "values": verdict.values,
        "differing": verdict.differing,
        "transitions": verdict.transitions,
    }


def moved(program: Program, part: int) -> TickLog:
    """Return the tape of the plant, step by step."""
    loaded, tape = driven(program.number_type, part), TickLog(program, program.name)
    run = simulate(
        loaded.system,
        loaded.scenario,
        on_tick=lambda name, used, stepper: tape.record_tick(stepper),
    )
    if run.stopped:
        raise RuntimeError(run.stopped)
    return tape


def estimated(program: Program, part: int) -> TickLog:
    """Return the tape of an estimator on seeded inputs."""
    stepper, tape = Interpreter(program), TickLog(program, program.name)
    for variable in program.variables:
        if variable.name.startswith("is_new."):
            stepper.set(variable.name, True)
    for values in drive(part, float(program.period or 0)):
        for variable in program.inputs:
            stepper.set(variable.name, values.get(variable.name, 0.0))
        stepper.run("step")
        tape.record_tick(stepper)
    return tape


def drive(part: int, period: float) -> Iterator[dict[str, float]]:
    """Yield the inputs of each tick: a torque that changes sign, speeds that follow it, noise."""
    draw = random.Random(f"lockstep {part}")
    torque, speed, twist = 20.0, 30.0, 0.0
    for tick in range(PART):
        if tick % 400 == 0:
            torque = draw.uniform(-60.0, 60.0)
        rate = (torque * RATIO / STIFFNESS - twist) * 12.0
        twist += rate * period
        speed = max(5.0, min(60.0, speed + 0.02 * torque * period))
        wheel = speed + draw.gauss(0.0, 0.02)
        rattle = 0.4 * math.sin(tick * period * 2.0 * math.pi * 7.0)
        motor = (speed + rate + rattle) * RATIO + draw.gauss(0.0, 0.2)
        yield {
            "input.y_em": motor,
            "input.y_w": wheel,
            "input.T_em": torque,
            "input.T_req": torque,
            "input.T_br": 0.0,
        }


def report(found: dict[str, dict[str, dict[str, dict[str, int]]]], ticks: int) -> int:
    """Print the sums by number type; return 0 if every bar is met."""
    fine = True
    for number in NUMBER_TYPES:
        for what, is_plant in (("estimators", False), ("plant", True)):
            kept = [
                k["parts"]
                for key, k in found.items()
                if key.endswith(number) and key.startswith("driveline ") == is_plant
            ]
            parts = [part for each in kept for part in each.values()]
            total = {name: sum(part[name] for part in parts) for name in parts[0]}
            met = total["ticks"] >= ticks and total["differing"] == 0 and total["transitions"] > 0
            fine = fine and met
            word = "met " if met else "OPEN"
            print(f"{word} differing bits of the {what}, {number}: {json.dumps(total)}")
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
