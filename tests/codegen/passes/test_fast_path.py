"""Fast path: a step without an event is one block of C, and has the bits of the engine."""

from __future__ import annotations

import dataclasses
import math
import re

import pytest

from codegen.emit.c_module import emit_c_files
from codegen.passes.fast_path import FastPathMode, add_fast_path
from codegen.passes.step_restriction import restrict_to_step
from engine.interpreter.interpreter import Interpreter
from language.ir.number_type import NUMBER_TYPES, NumberType
from language.ir.ops import Branch
from language.ir.program import Program
from language.ir.traversal import block_reads, names_used, walk_ops
from lockstep.comparison import compare
from lockstep.tick_log import TickLog
from modewright.api.simulation import program as shipped
from tests.language.spec_builders import program
from tests.lockstep.heater import column
from tests.lockstep.program_strategies import record_ticks

CART = """language: 1
automaton: cart
step: 10 ms
method: {method}
numbers: {number}
parameters:
  m: {{value: 2 kg}}
  g: {{value: 9.8 m/s^2}}
  d: {{value: 3 N*s/m, tunable: true, range: [1, 5]}}
  wall: {{value: 1 m}}
inputs: {{F: {{unit: N}}, slope: {{unit: rad}}, limit: {{unit: m/s}}}}
states: {{x: {{unit: m, initial: 0 m}}, v: {{unit: m/s, initial: 0 m/s}}}}
equations:
  pull: F - m * g * sin(slope)
  drag: d * v
  gap: wall - x
flow: {{x: der(x) = v, v: m * der(v) = pull - drag}}
initial: free
modes:
  free: {{transitions: {{held: {{when: {when}{wait}}}}}}}
  held: {{flow: {{x: der(x) = -0.5 * v}}, transitions: {{free: {{when: gap > 0.5 m}}}}}}
outputs: [x, v, pull, drag, gap, mode]
"""


def cart(number: NumberType = "float64", method: str = "rk4", **more: str) -> Program:
    given = {"when": "gap <= 0 m", "wait": ""} | more
    return program(CART.format(number=number, method=method, **given))


def inputs(count: int = 400) -> list[dict[str, float | bool]]:
    """A force that turns slowly, and a slope that jumps, with zeros of both signs."""
    slopes = [0.0, 0.0, -0.0, 0.05, 0.05, -0.0, -0.02]
    return [
        {
            "input.F": 20.0 * math.sin(k / 40.0),
            "input.slope": slopes[k // 9 % len(slopes)],
            "input.limit": 0.1 if k % 50 < 25 else 9.0,
        }
        for k in range(count)
    ]


FAST_PATHS: tuple[FastPathMode, ...] = ("on", "anew")


def fast_paths(made: Program) -> set[str]:
    return {
        name
        for name in add_fast_path(restrict_to_step(made)).blocks
        if name.startswith("fast_path_")
    }


@pytest.mark.parametrize("number", NUMBER_TYPES)
@pytest.mark.parametrize("method", ["euler", "midpoint", "rk4"])
def test_a_fast_path_has_the_bits_of_the_engine(number: NumberType, method: str) -> None:
    made = cart(number, method)
    assert fast_paths(made) == {"fast_path_free", "fast_path_held"}
    tape = record_ticks(made, inputs())
    assert compare(tape).is_equal
    assert len(set(column(tape, "memory.mode"))) == 2


@pytest.mark.parametrize(
    ("when", "event"),
    [("gap <= 0 m", set()), ("gap <= 0 m and v < limit", {"limit"})],
)
def test_only_inputs_that_guards_read_are_looked_at(when: str, event: set[str]) -> None:
    made = cart(when=when)
    tape = record_ticks(made, inputs())
    assert compare(tape).is_equal
    assert len(set(column(tape, "memory.mode"))) == 2
    text = emit_c_files(made)["cart.c"]
    assert set(re.findall(r"event_end = in->(\w+) != self", text)) == event
    assert set(re.findall(r"changed_\w+_end = in->(\w+) != self", text)) == {"F", "slope"}


def test_a_mode_that_waits_takes_the_general_path() -> None:
    made = cart(wait=", wait: 35 ms")
    assert fast_paths(made) == {"fast_path_held"}
    assert compare(record_ticks(made, inputs())).is_equal


def test_an_automaton_without_guards_has_no_general_path() -> None:
    text = CART.format(number="float64", method="rk4", when="", wait="")
    made = program(text[: text.index("initial: free")] + "outputs: [x, v, pull]\n")
    blocks = add_fast_path(restrict_to_step(made)).blocks
    assert not {"segment", "limit"} & set(blocks)
    assert compare(record_ticks(made, inputs())).is_equal


@pytest.mark.parametrize(("count", "wanted"), [(1, 6), (2, 0)])
def test_regions_take_it_together_with_the_chart_unless_there_are_too_many(
    count: int, wanted: int
) -> None:
    """Of a predictor, each mode with each: two of the chart and three of each region."""
    text = CART.format(number="float64", method="rk4", when="gap <= 0 m", wait="")
    modes = "low: {transitions: {high: {when: x > 0.9 m}}}, high: {}, idle: {}"
    beside = ", ".join(f"r{k}: {{initial: low, modes: {{{modes}}}}}" for k in range(count))
    made = program(text.replace("initial: free", f"regions: {{{beside}}}\ninitial: free"))
    blocks = add_fast_path(restrict_to_step(made), "anew").blocks
    assert sum(name.startswith("fast_path_") for name in blocks) == wanted
    assert not fast_paths(made)


def test_what_a_page_may_have_turned_is_computed_again() -> None:
    """`drag` reads a tunable parameter."""
    block = add_fast_path(restrict_to_step(cart())).blocks["fast_path_free"]
    before = block[:-1]
    assert isinstance(block[-1], Branch)
    read = {name for name in names_used([before]) if name.startswith("equation.")}
    assert "equation.drag" not in read
    text = emit_c_files(cart())["cart.c"]
    function = text[text.index("void fast_path_free(") :].partition("\n}\n")[0]
    assert "cal->d * self->state.v" in function


def test_a_page_that_turns_between_two_steps_counts_at_once() -> None:
    made = cart()
    tape = TickLog(made, made.name)
    stepper = Interpreter(made)
    for number, tick in enumerate(inputs(80)):
        if number == 40:
            stepper.set("calibration.d", 5.0)
            stepper.run("derive")
        for name, value in tick.items():
            stepper.set(name, value)
        stepper.run("step")
        tape.record_tick(stepper)
    verdict = compare(tape)
    assert verdict.is_equal, str(verdict.first)


def test_a_tick_that_runs_a_model_has_one_in_float32_alone() -> None:
    blocks = add_fast_path(restrict_to_step(shipped("estimator_float32"))).blocks
    assert {name for name in blocks if name.startswith("fast_path_gap_")} == {
        "fast_path_gap_drive_contact",
        "fast_path_gap_no_contact",
        "fast_path_gap_coast_contact",
    }
    double = restrict_to_step(shipped("estimator"))
    assert add_fast_path(double) == double


def test_a_name_is_not_given_twice() -> None:
    """Of modes `gap` and `gap_no_contact` that both run: what would be called the same stays."""
    made = restrict_to_step(shipped("estimator_float32"))
    taken = dataclasses.replace(made, blocks={**made.blocks, "fast_path_gap_no_contact": ()})
    assert add_fast_path(taken) == taken


def test_what_happens_rarely_is_a_function_of_its_own() -> None:
    text = emit_c_files(shipped("estimator_float32"))["estimator_float32.c"]
    assert "static RARELY void through_events_gap(" in text
    assert "static RARELY void latch_each(" in text
    assert "RARELY" not in emit_c_files(shipped("contactor"))["contactor.c"]


def test_what_loops_alone_set_is_a_local_of_its_block() -> None:
    text = emit_c_files(shipped("estimator_float32"))["estimator_float32.c"]
    locate = text[text.index("void locate_no_contact(") :].partition("\n}\n")[0]
    assert "    float high;\n    bool is_before_end;\n    float low;\n" in locate
    assert "work->high" not in text


def test_a_sampled_automaton_without_a_run_stays_as_it_is() -> None:
    made = program(
        "language: 1\nautomaton: lamp\nperiod: 1 s\nnumbers: float64\ninputs: {lit: {type: bool}}\n"
        "initial: dark\nmodes: {dark: {transitions: {bright: {when: lit}}}, bright: {}}\n"
        "outputs: [mode]\n"
    )
    assert add_fast_path(restrict_to_step(made)) == restrict_to_step(made)


def test_what_nobody_reads_is_not_computed() -> None:
    for name, block in add_fast_path(restrict_to_step(cart())).blocks.items():
        if name.startswith("fast_path_"):
            targets = [op.target for op in walk_ops(block) if hasattr(op, "target")]
            made = {target for target in targets if target.startswith("work.")}
            assert made <= names_used([block]) and len(made) > 10


def test_of_states_that_are_set_between_steps_no_equation_is_older_than_they_are() -> None:
    made = restrict_to_step(shipped("blind_driveline"))
    older = {
        one: {
            name
            for title, block in add_fast_path(made, one).blocks.items()
            for name in block_reads(block)
            if title.startswith("fast_path_") and name.startswith("equation.")
        }
        for one in FAST_PATHS
    }
    read = {f"equation.{name}" for name in ("T_hs", "T_v", "w_d", "w_free")}
    assert older == {"on": read, "anew": set()}
    assert add_fast_path(made, "off") is made
