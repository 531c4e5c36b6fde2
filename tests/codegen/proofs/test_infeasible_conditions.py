"""Infeasible: what is proven never to happen never happens, and what may happen is not proven."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path

import pytest

from codegen.coverage.mcdc import COVERAGE_EXPORTER, add_infeasibility_proofs, measure_mcdc
from codegen.passes.pass_list import run_c_passes
from codegen.proofs.infeasible.infeasible_conditions import (
    decision_sites,
    prove_infeasible,
    unshare_expressions,
)
from language.ir.program import Program
from modewright.api import code_generation as code
from modewright.api.simulation import program as program_named
from tests.language.spec_builders import program
from tests.lockstep.random_specs.engine_run import record_ticks
from tests.lockstep.random_specs.spec import program as program_of
from tests.lockstep.random_specs.spec_kinds import spec_of

needs_llvm = pytest.mark.skipif(
    not shutil.which(COVERAGE_EXPORTER), reason="no llvm-cov-19: make system-packages"
)
VALVE = """language: 1
automaton: valve
period: 10 ms
numbers: {number}
parameters: {{top: {{value: 4, tunable: true, range: [1, 9]}}, two: {{value: 2}}}}
inputs: {{u: {{unit: "1", range: [-8, 8]}}, go: {{type: bool}}}}
states: {{level: {{unit: "1", initial: 0, range: [0, 5]}}}}
initial: shut
modes:
  shut: {{transitions: {{open: {{when: go, wait: 30 ms}}}}}}
  open:
    update: {{level: "clip(level + u, 0, 4)"}}
    transitions:
      shut: {{when: level > 5 or not go}}
      spilled: {{when: "u > 100", priority: 2}}
  spilled: {{transitions: {{shut: {{when: abs(u) < top}}}}}}
outputs: [level, mode]
"""
PRESS = """language: 1
automaton: press
period: 10 ms
numbers: float64
micro_steps: 3
inputs: {held: {type: bool}}
events: {go: {from: input}, done: {}}
initial: still
modes:
  still: {transitions: {down: {event: go, raise: done}}}
  down: {transitions: {up: {event: done}}}
  up: {transitions: {still: {when: not held, wait: 20 ms}}}
outputs: [mode]
"""
TWICE = """language: 1
automaton: twice
period: 10 ms
numbers: float64
inputs: {u: {unit: "1", range: [-8, 8]}}
states: {x: {unit: "1", initial: 0, range: [-9, 9]}}
equations: {z: x + u}
initial: one
modes:
  one: {transitions: {two: {when: u > 5, reset: {x: 1}}}}
  two: {transitions: {one: {when: z > 3 and x + u <= 3}}}
outputs: [z, mode]
"""
SEEDS = (14, 19)
"""Of small specs."""
HELD = {"latched.u": (-8.0, 8.0), "state.level": (0.0, 5.0)}


def proven(made: Program, ranges: dict[str, tuple[float, float]] = HELD) -> dict[str, str]:
    """Return of each decision of which something is proven its text and `T`, `F` or `.`."""
    used = unshare_expressions(run_c_passes(made))
    places = list(decision_sites(used))
    found = prove_infeasible(
        used, ranges, [number for place in places for number in place.conditions]
    )
    marks = {None: ".", True: "F", False: "T"}
    texts = {p.text: "".join(marks[found.get(n)] for n in p.conditions) for p in places}
    return {text: marks for text, marks in texts.items() if set(marks) != {"."}}


@pytest.mark.parametrize("number", ["float64", "float32"])
def test_what_cannot_be_is_proven_and_nothing_else(number: str) -> None:
    suffix = "" if number == "float64" else "F"
    found = proven(program(VALVE.format(number=number)))
    assert found.pop("self->timer.shut_open < 4U") == "T"
    assert found.pop(f"(self->state.level > 5.0{suffix}) || (!in->go)") == "F."
    assert found.pop(f"self->latched.u > 100.0{suffix}") == "F"
    assert found.pop(f"fabs{suffix.lower()}(self->latched.u) < cal->top") == "F"  # no way there
    assert all(marks == "T" and "_level, 0" in text for text, marks in found.items()), found


@pytest.mark.long
def test_a_range_that_does_not_stay_proves_nothing() -> None:
    free = VALVE.format(number="float64").replace("clip(level + u, 0, 4)", "level + u")
    made = program(free.replace(", range: [0, 5]", ""))
    for wrong in ({"state.level": (0.0, 3.0)}, {"state.level": (1.0, 5.0)}, {}):
        assert proven(made, wrong)["self->latched.u > 100.0"] == "F"  # it is held when it is read
        assert not any(text.startswith("(self->state.level > 5.0)") for text in proven(made, wrong))


def test_what_stays_within_a_range_needs_none_declared() -> None:
    made = program(VALVE.format(number="float64"))
    assert proven(made, {})["(self->state.level > 5.0) || (!in->go)"] == "F."


def test_a_nan_is_in_no_range() -> None:
    """What is neither below 0 nor above is a number that is none: without a range it may be."""
    text = VALVE.format(number="float64").replace("level > 5 or not go", "level < 0 or level >= 0")
    guard = "(self->state.level < 0.0) || (self->state.level >= 0.0)"
    assert proven(program(text))[guard] == "FT"
    free = text.replace(", range: [0, 5]", "").replace("clip(level + u, 0, 4)", "level + u")
    assert guard not in proven(program(free), {"latched.u": (-8.0, 8.0)})


@pytest.mark.long
@needs_llvm
@pytest.mark.parametrize("seed", SEEDS)
def test_what_was_seen_is_never_proven_not_to_be(seed: int, tmp_path: Path) -> None:
    """A random spec on random inputs: of a condition that was true and false nothing is proven."""
    spec = spec_of(seed)
    made = program_of(spec, "float64", tmp_path)
    found = measure_mcdc(made, [record_ticks(spec, made, 200).inputs])
    hidden = [dataclasses.replace(d, shown=(False,) * len(d.shown)) for d in found.decisions]
    said = add_infeasibility_proofs(dataclasses.replace(found, decisions=tuple(hidden)), made, {})
    assert 0 < said.open < said.conditions
    for seen, claim in zip(found.decisions, said.decisions, strict=True):
        pairs = zip(seen.shown, claim.never, strict=True)
        assert not any(shown and outcome is not None for shown, outcome in pairs), claim


@pytest.mark.long
@needs_llvm
def test_each_condition_is_shown_or_proven() -> None:
    found = code.mcdc("contactor", 1500)
    assert found.open == 0 < found.shown < found.conditions


@pytest.mark.long
def test_of_the_simple_estimator_twenty_conditions_never_turn() -> None:
    """Full counters, ranges of what is always inside: the other 37 are shown by libFuzzer."""
    made = run_c_passes(program_named("estimator_simple"))
    held = {
        "latched.y_em": (-400.0, 2400.0),
        "latched.y_w": (-50.0, 300.0),
        "state.theta_d": (-0.5, 0.5),
        "state.w_em": (-400.0, 2400.0),
        "state.w_w": (-50.0, 300.0),
        "state.theta_b": (-0.2, 0.2),
    }
    places = list(decision_sites(made))
    found = prove_infeasible(
        made, held, [number for place in places for number in place.conditions]
    )
    assert len(found) == 20 and not any(found.values())
    assert sum(len(place.conditions) for place in places) == 57


@pytest.mark.long
def test_what_waits_in_a_queue_bounds_the_micro_steps() -> None:
    """`go` is heard at the beginning of a tick alone and `done` once: of three none are left."""
    used = unshare_expressions(run_c_passes(program(PRESS)))
    asked = [p for p in decision_sites(used) if p.text == "work->is_over"]
    assert len(asked) >= 3
    found = prove_infeasible(used, {}, [number for place in asked for number in place.conditions])
    assert all(found.get(number) is True for place in asked for number in place.conditions)


def test_each_condition_is_an_object_of_its_own() -> None:
    used = run_c_passes(program(PRESS))
    for made, is_told_apart in ((used, False), (unshare_expressions(used), True)):
        found = [n for p in decision_sites(made) if p.text == "work->is_over" for n in p.conditions]
        assert (len(set(found)) == len(found)) is is_told_apart


def test_a_case_begins_with_what_there_was_before_the_choice() -> None:
    """What mode `one` resets is not asked in mode `two`: `x + u` is what `z` was made of."""
    found = proven(program(TWICE), {})
    text = "(self->equation.z > 3.0) && ((self->state.x + self->latched.u) <= 3.0)"
    assert found[text] == ".F"
