"""What is proven of larger Programs: the same as in tests/codegen, where it takes z3 long."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.proofs.fact import AtMost, Within
from codegen.proofs.infeasible import never, places_of
from codegen.proofs.invariant import invariant
from codegen.proofs.symbolic import World
from codegen.source import c_program
from modewright.api import program as program_named
from tests.codegen.test_infeasible import needs_llvm, nothing_seen_is_excluded
from tests.codegen.test_invariant import checked
from tests.verify.random_charts import programs


def test_facts_hold_in_runs_of_a_chart_without_regions(tmp_path: Path) -> None:
    ((spec, made),) = programs(range(3, 4), tmp_path)
    checked(spec, made)


@needs_llvm
def test_what_was_seen_is_never_proven_not_to_be(tmp_path: Path) -> None:
    nothing_seen_is_excluded(19, tmp_path)


def test_of_a_chart_much_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """Micro-steps, their log, histories, and which regions are left in which mode."""
    monkeypatch.setattr("codegen.proofs.invariant._last", lambda world: ())  # they take long
    world = World(c_program(program_named("supervisor")))
    facts = invariant(world, {}, most_where=1)
    said = {(f.cut.name, f.name, f.where): f.limits for f in facts if isinstance(f, Within)}
    drive = (("memory.mode", 3),)
    assert said["step", "memory.mode_operation_drive_torque", drive] == frozenset({0, 1, 2})
    assert said["step", "timer.operation_fault", ()] == (0, 3)
    counts = {fact.name for fact in facts if isinstance(fact, AtMost)}
    assert {"memory.count_of_log", "work.tail", "work.turn"} <= counts


def test_of_the_simple_estimator_twenty_conditions_never_turn() -> None:
    """Full counters, ranges of what is always inside: the other 37 are shown by libFuzzer."""
    made = c_program(program_named("estimator_simple"))
    held = {
        "latched.y_em": (-400.0, 2400.0),
        "latched.y_w": (-50.0, 300.0),
        "state.theta_d": (-0.5, 0.5),
        "state.w_em": (-400.0, 2400.0),
        "state.w_w": (-50.0, 300.0),
        "state.theta_b": (-0.2, 0.2),
    }
    places = list(places_of(made))
    found = never(made, held, [number for place in places for number in place.conditions])
    assert len(found) == 20 and not any(found.values())
    assert sum(len(place.conditions) for place in places) == 57
