"""Invariant: what is said to hold between two steps does, in runs of random charts and specs."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from codegen.passes.pass_list import run_c_passes
from codegen.proofs.infeasible import spacer as reach
from codegen.proofs.infeasible.candidate_invariants import AtMost, Within
from codegen.proofs.infeasible.houdini import find_invariants
from codegen.proofs.infeasible.infeasible_conditions import decision_sites
from codegen.proofs.infeasible.invariant_terms import Number, holds
from codegen.proofs.infeasible.symbolic_execution import SymbolicProgram
from engine.interpreter.interpreter import Interpreter
from language.ir.program import Program
from modewright.api.simulation import program as program_named
from tests.lockstep.random_specs.engine_run import record_ticks
from tests.lockstep.random_specs.spec import Spec, program as program_of
from tests.lockstep.random_specs.spec_kinds import spec_of
from tests.validation.evidence.random_charts import programs

CHARTS, SEEDS, TICKS = (3, 6), (14, 19), 300
"""A chart without regions, one with two."""


@pytest.mark.long
@pytest.mark.parametrize("number", CHARTS)
def test_facts_hold_in_runs_of_a_random_chart(number: int, tmp_path: Path) -> None:
    ((spec, made),) = programs(range(number, number + 1), tmp_path)
    checked(spec, made)


@pytest.mark.parametrize("seed", SEEDS)
def test_facts_hold_in_runs_of_a_random_spec(seed: int, tmp_path: Path) -> None:
    spec = spec_of(seed)
    checked(spec, program_of(spec, "float64", tmp_path))


def checked(spec: Spec, made: Program) -> None:
    """Run the Program that C is printed of, and look at every fact after each tick."""
    used = run_c_passes(made)
    facts = [
        fact
        for fact in find_invariants(SymbolicProgram(used), {}, most_where=1)
        if fact.cut.loop is None
    ]
    assert facts

    def look(run: Interpreter) -> None:
        def number(name: str) -> Number:
            value = run.get(name)
            return None if isinstance(value, float) and math.isnan(value) else value

        wrong = [fact for fact in facts if not holds(fact, number)]
        assert not wrong, wrong[:3]

    record_ticks(spec, made, TICKS, run=used, look=look)


@pytest.mark.long
def test_of_a_chart_much_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """Micro-steps, their log, histories, and which regions are left in which mode."""
    monkeypatch.setattr(
        "codegen.proofs.infeasible.houdini._last", lambda world: ()
    )  # they take long
    world = SymbolicProgram(run_c_passes(program_named("supervisor")))
    facts = find_invariants(world, {}, most_where=1)
    said = {(f.cut.name, f.name, f.where): f.limits for f in facts if isinstance(f, Within)}
    drive = (("memory.mode", 3),)
    assert said["step", "memory.mode_operation_drive_torque", drive] == frozenset({0, 1, 2})
    assert said["step", "timer.operation_fault", ()] == (0, 3)
    counts = {fact.name for fact in facts if isinstance(fact, AtMost)}
    assert {"memory.count_of_log", "work.tail", "work.turn"} <= counts


@pytest.mark.long
def test_a_question_that_takes_too_long_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reach, "EFFORT", 100_000)
    made = run_c_passes(program_named("supervisor"))
    world = SymbolicProgram(made)
    asked = reach.Reachability(world, ())
    numbers = [
        n
        for place in decision_sites(made)
        if place.text == "work->is_over"
        for n in place.conditions
    ]
    assert numbers and not any(asked.never(world.visits[n], True) for n in numbers)
