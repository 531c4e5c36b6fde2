"""Predictor: without a gain it moves as the interpreter does, bit for bit, and says less."""

from __future__ import annotations

import numpy as np
import pytest

from codegen.passes.step_restriction import restrict_to_step
from codegen.predictor.predictor import Predictor, build_predictor, columns_of, slice_to_outputs
from codegen.predictor.predictor_arrays import StackedRecordings
from codegen.predictor.simd_predictor import simd_recordings_context
from codegen.toolchain.compiler import has_gcc_vectors
from engine.interpreter.interpreter import Interpreter
from language.ir.program import Program
from tests.language.spec_builders import program

TEXT = """language: 1
automaton: slider
method: rk4
step: 10 ms
numbers: {number}
parameters: {{c: {{value: 3, tunable: true, range: [0, 9]}}, only_shown: {{{only}}}}}
inputs: {{u: {{unit: 1/s, range: [-99, 99]}}}}
states: {{x: {{initial: 1, range: [-99, 99]}}}}
equations:
  drag: c * tanh(x * 9)
  shown: only_shown * tanh(drag)
flow: {{x: 1 * der(x) = u - drag * (1 / 1 s)}}
initial: low
modes:
  low: {{transitions: {{high: {{when: x > 2}}}}}}
  high: {{transitions: {{low: {{when: x < -2, reset: {{x: x + 0.5}}}}}}}}
outputs: [x]
"""
FIXED = "value: 2"
HELD = np.zeros(1, dtype=np.int64)
"""The input is constant between samples."""


def slider(number: str = "float64", only: str = FIXED) -> Program:
    return program(TEXT.format(number=number, only=only))


@pytest.mark.parametrize("number", ["float64", "float32"])
def test_without_a_gain_it_moves_as_the_interpreter(number: str) -> None:
    """Through both modes, and where tanh is 1: x * 9 > 20."""
    made = slider(number)
    inputs = np.repeat([0.0, 9.0, -20.0, 2.0, 30.0], 40)[:, np.newaxis]
    columns = columns_of(made, ("x",))
    no_gain = np.zeros((2, 1, 1))
    page = np.array(list(columns.page.values()))
    with build_predictor(made, columns) as library:
        run = Predictor(columns, library).predict(
            page, inputs, np.zeros((200, 1)), no_gain[:0], no_gain, 1, linear_inputs=HELD
        )
    theirs = Interpreter(made)
    found = []
    for (value,) in inputs:
        theirs.set("input.u", value)
        theirs.run("step")
        found.append(theirs.get("state.x"))
    assert run.completed == 200
    assert set(run.modes) == {0, 1}
    assert max(found) * 9 > 20 and min(found) < 0
    assert run.states[:, 0].tolist() == found


def test_what_no_output_reads_is_not_computed() -> None:
    made = slider()
    assert "shown" in str(restrict_to_step(made).blocks)
    assert "shown" not in str(slice_to_outputs(made).blocks)
    assert "tanh" in str(slice_to_outputs(made).blocks)


def test_parameters_stay_though_nothing_that_is_left_reads_them() -> None:
    """The page of a fit has a column for each."""
    made = slider(only="value: 2, tunable: true, range: [0, 9]")
    assert "only_shown" in columns_of(slice_to_outputs(made), ("x",)).page


TABLE_TEXT = """language: 1
automaton: looked_up
step: 10 ms
parameters:
  gain: {value: 1, tunable: true, range: [0, 9]}
  curve: {table: {over: u, points: {-1: 0, 0: 1, 2: 4}}}
inputs: {u: {unit: "1", range: [-99, 99]}}
states: {x: {unit: "1", initial: 1, range: [-99, 99]}}
flow: {x: "1 s * der(x) = -gain * x + pull"}
initial: low
modes:
  low:
    equations: {pull: "0 + lookup(curve, u)"}
    transitions: {high: {when: u > 1}}
  high:
    equations: {pull: "0 + u"}
    transitions: {low: {when: u < -2}}
outputs: [x]
"""


def test_a_table_that_one_mode_reads_is_no_vector() -> None:
    """The other mode is followed in vectors."""
    made = program(TABLE_TEXT)
    columns = columns_of(made, ("x",))
    page = np.array(list(columns.page.values()))
    no_gain = np.zeros((1, 1, 1))
    with build_predictor(made, columns) as library:
        run = Predictor(columns, library).predict(
            page,
            np.full((9, 1), -0.5),
            np.zeros((9, 1)),
            no_gain[:0],
            no_gain,
            1,
            linear_inputs=HELD,
        )
    assert run.states[-1, 0] == pytest.approx(0.5 + 0.5 * np.exp(-0.08), rel=1e-6)


@pytest.mark.skipif(not has_gcc_vectors(), reason="no vectors on this machine")
def test_large_angles_have_the_same_bits_in_lanes() -> None:
    """Lanes with small and with large angles side by side, and each recording alone."""
    text = TEXT.format(number="float64", only=FIXED)
    made = program(text.replace("tanh(x * 9)", "sin(x * 90000 rad) * cos(x * 1.0e9 rad)"))
    columns = columns_of(made, ("x",))
    context = simd_recordings_context(slice_to_outputs(made), ("x",), ("x",))
    assert context is not None
    assert "each_reduced_head" in str(context["functions"]["sin"])
    draw = np.random.default_rng(3)
    starts = np.array([0, 40, 90, 100, 170, 200], dtype=np.int64)
    inputs = draw.uniform(-9.0, 9.0, (200, 1))
    page = np.array(list(columns.page.values()))
    gains = np.zeros((5, 1, 1)), np.zeros((2, 1, 1))
    recordings = StackedRecordings(
        inputs, np.zeros((200, 1)), starts, np.full(5, 9), np.zeros((5, 1), dtype=np.int64)
    )
    with build_predictor(made, columns) as library:
        predictor = Predictor(columns, library)
        whole = predictor.predict_recordings(
            np.tile(page, (5, 1)), recordings, *gains, 1, np.full(1, np.inf)
        ).split()
        for r, one in enumerate(whole):
            low, high = starts[r : r + 2]
            alone = predictor.predict(
                page, inputs[low:high], np.zeros((high - low, 1)), *gains, 1, linear_inputs=HELD
            )
            assert one.states.tolist() == alone.states.tolist()
    assert np.abs(np.concatenate([one.states for one in whole])).max() * 90000.0 > 1e5
