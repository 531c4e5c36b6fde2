"""Resting: of a state whose rate is 0 in a mode nothing is computed, and nothing is held there."""

from __future__ import annotations

from pathlib import Path

import pytest

from engine.interpreter.interpreter import Interpreter
from language.ir.ops import Assign, Ref
from language.ir.program import Program
from language.ir.traversal import block_writes, reachable_blocks
from language.model.constant_states import ever_varying_states, varying_states, written_states
from language.programs.model_run import SATURATION_BLOCK
from tests.language.spec_builders import automaton, load_shipped, program, project_of

CART = """\
language: 1
automaton: cart
inputs: {u: {unit: 1/s, default: 1 1/s}}
states: {a: {unit: "1", initial: 0}, b: {unit: "1", initial: 0.3}, c: {unit: "1", initial: 0.7}}
equations: {idle: zero}
flow: {a: der(a) = u, b: der(b) = idle, c: der(c) = 0}
initial: still
modes:
  still:
    equations: {zero: 0 1/s}
    transitions: {both: {when: a > 1.5}}
  both:
    equations: {zero: u - 0 1/s}
outputs: [a]
"""
BESIDE = """\
language: 1
automaton: oven
states: {a: {unit: "1", initial: 0}, h: {unit: "1", initial: 0}}
flow: {a: der(a) = 0}
regions:
  heat:
    initial: cold
    modes:
      cold: {flow: {h: der(h) = 0}, transitions: {warm: {when: a > 1}}}
      warm: {flow: {h: der(h) = 1 1/s}}
initial: only
modes: {only: {}}
outputs: [a]
"""
CLOCK = """\
language: 1
automaton: clock
period: 1 s
numbers: float64
model: cart
inputs: {{u: {{unit: 1/s, default: 1 1/s}}}}
states:
  a: {{initial: 0, range: [-9, 9]}}
  b: {{initial: 0.3, range: [-9, 9]}}
  c: {{initial: 0.7, range: [-9, 9]}}
initial: go
modes:
  go: {{runs: {{of: cart.still, method: {method}, events: 2}}}}
outputs: [a, b, c]
"""
BACK = CLOCK.replace(
    "  go: {{runs: {{of: cart.still, method: {method}, events: 2}}}}\n",
    """\
  go:
    runs: {{of: cart.still, follow: false, method: {method}}}
    transitions: {{went: {{when: a > 2.2, rewind: {{until: a > 0.5, within: 4 s}}}}}}
  went:
    runs: {{of: cart.both, follow: false, method: {method}}}
""",
)
METHODS = ("euler", "midpoint", "rk4")


def clock(folder: Path, text: str, method: str) -> Program:
    return program(text.format(method=method), project_of(folder, cart=CART))


def written(made: Program, block: str) -> set[str]:
    """Return what a block and those that it runs write."""
    return {
        name
        for run in reachable_blocks(block, made.blocks)
        for name in block_writes(made.blocks[run])
    }


def test_a_state_rests_by_its_balance_or_by_an_equation() -> None:
    cart = automaton(CART)
    assert varying_states(cart, "still") == ("a",)
    assert varying_states(cart, "both") == ("a", "b")
    assert ever_varying_states(cart) == ("a", "b")


def test_what_a_region_beside_balances_may_move() -> None:
    oven = automaton(BESIDE)
    assert varying_states(oven, "only") == ever_varying_states(oven) == ("h",)


def test_the_angle_of_the_gap_rests_in_contact_and_the_load_everywhere() -> None:
    driveline = load_shipped("driveline_load")
    contact, gap = (
        set(varying_states(driveline, mode)) for mode in ("drive_contact", "no_contact")
    )
    assert gap - contact == {"theta_b"}
    assert set(driveline.states) - set(ever_varying_states(driveline)) == {"T_l"}


@pytest.mark.parametrize("method", METHODS)
def test_of_what_rests_the_end_of_a_step_is_its_start(tmp_path: Path, method: str) -> None:
    made = clock(tmp_path, CLOCK, method)
    stages = {
        state: {name for name in written(made, f"step_{mode}") if name.endswith(f"_{state}")}
        for state, mode in (("a", "both"), ("b", "still"), ("c", "both"))
    }
    alone = {"work.at_", "work.rate_", "work.end_"}
    assert {name[:-1] for name in stages["c"]} <= alone
    if method != "rk4":  # whose stages are blocks of their own, for all modes
        assert {name[:-1] for name in stages["b"]} <= alone
    last = made.blocks["step_still"][-2:]
    assert last == tuple(Assign(f"work.end_{n}", Ref(f"state.{n}")) for n in "bc")
    assert {v.name for v in made.variables if "series" in v.name} == {
        "work.series_a",
        "work.series_b",
    }


@pytest.mark.parametrize("method", METHODS)
def test_what_rests_stays_to_the_last_bit(tmp_path: Path, method: str) -> None:
    """From a = 1.5 on, inside a tick, b rises as fast as a does."""
    inside = Interpreter(clock(tmp_path, CLOCK, method))
    inside.set("input.u", 1.0)
    a = 0.0
    for _ in range(6):
        inside.run("step")
        a, b, c = (float(inside.get(f"state.{name}")) for name in "abc")
        assert c == 0.7
        assert b == 0.3 if a < 1.5 else b == pytest.approx(a - 1.2, rel=1e-6)
    assert a > 3


@pytest.mark.parametrize("method", METHODS)
def test_what_rests_is_held_where_a_transition_resets_it(tmp_path: Path, method: str) -> None:
    """The run writes it all the same: rule 18."""
    reset = "both: {when: a > 1.5, reset: {c: 20}}"
    cart = CART.replace("both: {when: a > 1.5}", reset)
    made = program(CLOCK.format(method=method), project_of(tmp_path, cart=cart))
    assert written_states(automaton(cart)) == ("a", "b", "c")
    inside = Interpreter(made)
    inside.set("input.u", 1.0)
    for _ in range(6):
        inside.run("step")
    assert inside.get("state.c") == 9
    bit = made.faults.index("range_c")
    assert int(inside.get("memory.faults")) >> bit & 1


@pytest.mark.parametrize("method", METHODS)
def test_at_a_crossing_only_what_moves_is_held_in_its_range(tmp_path: Path, method: str) -> None:
    """What rests is there what it was at a tick."""
    made = clock(tmp_path, BACK, method)
    (back,) = [name for name in made.blocks if name.startswith("rollback_")]
    assert "state.c" in written(made, back)
    told = repr(made.blocks[back] if method == "euler" else made.blocks[SATURATION_BLOCK])
    moves = [True, method != "euler", False]  # what is held by the block of all runs moves in one
    assert [f"range_{name}" in told for name in "abc"] == moves
    inside = Interpreter(made)
    inside.set("input.u", 1.0)
    for _ in range(6):
        inside.run("step")
    a, b, c = (float(inside.get(f"state.{name}")) for name in "abc")
    assert a > 3
    assert b == pytest.approx(a - 0.2, rel=1e-6)
    assert c == 0.7
