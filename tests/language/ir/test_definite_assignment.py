"""Work values: only what may be read before it is set is set when a step begins."""

from __future__ import annotations

import re
import subprocess
from fractions import Fraction
from pathlib import Path

import pytest

from codegen.emit.c_module import emit_c_files
from codegen.toolchain.compiler import WARNINGS, find_compiler, flags_at_level
from language.ir.definite_assignment import find_unassigned_reads
from language.ir.number_type import NUMBER_TYPES, NumberType
from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Compare,
    Expr,
    Item,
    Loop,
    Ref,
    RunBlock,
    Store,
    Switch,
    integer,
    real,
)
from language.ir.program import Program, Variable
from modewright.api.simulation import program as shipped

A, B = Ref("work.a"), Ref("work.b")
SET_A = Assign("work.a", real(1.0))
USE_A = Assign("state.x", A)
SET_FIRST = Store("work.list", integer(0), real(1.0))
IS_HIGH = Compare(">", Ref("state.x"), real(0.0))


def use_item(index: Expr) -> Assign:
    return Assign("state.x", Item("work.list", index))


def early(*step: object, **blocks: Block) -> frozenset[str]:
    made = Program(
        name="made",
        number_type="float64",
        period=Fraction(1),
        major_step=Fraction(1),
        constants=(),
        variables=(Variable("work.list", "real", size=2),),
        outputs=(),
        modes=(),
        transitions=(),
        faults=(),
        functions=(),
        blocks={"step": step, **blocks},  # type: ignore[dict-item]
    )
    return find_unassigned_reads(made, "step", frozenset({"work.a", "work.b", "work.list"}))


@pytest.mark.parametrize(
    ("step", "found"),
    [
        ((SET_A, USE_A), set()),
        ((USE_A, SET_A), {"work.a"}),
        ((Branch(IS_HIGH, (SET_A,)), USE_A), {"work.a"}),
        ((Branch(IS_HIGH, (SET_A,), (SET_A,)), USE_A), set()),
        ((Switch("memory.mode", ((0, (SET_A,)), (1, (SET_A,)))), USE_A), {"work.a"}),
        ((Loop(3, "work.k", (SET_A,)), USE_A), set()),
        ((Loop(3, "work.k", (Branch(IS_HIGH, (SET_A,)),)), USE_A), {"work.a"}),
        ((RunBlock("sets"), USE_A), set()),
        ((Branch(IS_HIGH, (RunBlock("sets"),)), RunBlock("uses")), {"work.a"}),
        ((SET_FIRST, use_item(integer(0))), set()),
        ((SET_FIRST, use_item(integer(1))), {"work.list"}),
        ((SET_FIRST, use_item(B)), {"work.b", "work.list"}),
    ],
)
def test_what_may_be_read_before_it_is_set_is_found(step: Block, found: set[str]) -> None:
    assert early(*step, sets=(SET_A,), uses=(USE_A,)) == found


def test_a_tick_that_runs_a_model_sets_three_of_its_work_values_when_it_begins() -> None:
    text = emit_c_files(shipped("estimator"))["estimator.c"]
    begin = text[text.index("*const work = &self->work;") : text.index("work->left = 0.001;")]
    assert begin.count(" = ") == 4  # the pointer, then these
    for line in ("guard_0 = false;", "elapsed = 0.0;", "crossed = false;"):
        assert f"work->{line}" in begin


def test_where_all_modes_are_cases_a_choice_is_always_made() -> None:
    text = emit_c_files(shipped("driveline"))["driveline.c"]
    begin = text[text.index("*const work = &self->work;") : text.index("    if (self->started)")]
    assert begin.count(" = ") == 1


def test_a_loop_ends_where_its_condition_does() -> None:
    text = emit_c_files(shipped("driveline"))["driveline.c"]
    loop = "for (int32_t piece = 0; piece < 101; piece++) {"
    assert re.search(rf"{re.escape(loop)}\s+if \(!\(work->left > 0.0\)\) {{\s+break;", text)
    assert "for (int32_t halving = 0; halving < 44; halving++) {" in text


EVENTS = """\
language: 1
automaton: events
step: 10 ms
numbers: {numbers}
states: {{x: {{unit: m, initial: 0 m}}}}
flow: {{x: der(x) = 1 m/s}}
initial: low
modes:
  low: {{transitions: {{high: {{when: x > 0.5 m{low}}}}}}}
  high: {{transitions: {{last: {{when: x > 1 m, reset: {{x: 0 m}}}}}}}}
  last: {{{last}}}
outputs: [x, mode]
"""
LAST_MODES = {"without a guard": "", "waits": "transitions: {low: {when: after(0.1 s)}}"}


@pytest.mark.parametrize("number", NUMBER_TYPES)
@pytest.mark.parametrize("low", ["", ", wait: 30 ms"])
@pytest.mark.parametrize("last", LAST_MODES)
def test_no_compiler_warns_of_work_values_on_the_stack(
    last: str, low: str, number: NumberType, tmp_path: Path
) -> None:
    """A compiler assumes that a mode can be none of the cases of a switch."""
    text = EVENTS.format(numbers=number, low=low, last=LAST_MODES[last])
    (tmp_path / "events.yaml").write_text(text)
    files = emit_c_files(shipped(str(tmp_path / "events.yaml")))
    assert "Work scratch;" in files["events.c"], "this is not about work values on the stack"
    for name, content in files.items():
        (tmp_path / name).write_text(content)
    for level in ("O1", "O2", "O3"):
        command = [*find_compiler(), *flags_at_level(level), *WARNINGS, "-Werror"]
        done = subprocess.run(
            [*command, "-c", "events.c", "-o", "events.o"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr


def test_a_switch_over_all_modes_may_still_take_none() -> None:
    events = shipped("driveline")
    shared = frozenset({"work.elapsed", "work.crossed"})
    assert not find_unassigned_reads(events, "step", shared)
    assert find_unassigned_reads(events, "step", shared, are_modes_known=False)
