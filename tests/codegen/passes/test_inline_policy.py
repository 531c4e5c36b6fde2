"""Functions that are not put into each other: less of the stack of an ECU is open at once."""

from __future__ import annotations

import shutil

import pytest

from codegen.emit.c_module import emit_c_files
from codegen.harness.stack_usage import MAX_STEP_STACK_BYTES
from codegen.passes.inline_policy import select_noinline_blocks
from codegen.passes.pass_list import run_c_passes
from codegen.toolchain.external_tools import ARM_COMPILER
from language.ir.number_type import NumberType
from modewright.api.code_generation import metrics
from modewright.api.simulation import program


def test_what_computes_much_has_a_frame_of_its_own() -> None:
    found = select_noinline_blocks(run_c_passes(program("estimator")))
    assert {"predict_drive", "half_no_contact", "series_coast_contact", "point"} <= found
    assert "rates_drive_contact" not in found, "remainder_drive_contact alone runs it, and is apart"
    assert not found & {"run_gap", "latch", "retain_inputs"}


def test_what_is_alike_in_all_modes_of_a_run_stands_once_and_apart() -> None:
    made = run_c_passes(program("hko"))
    stages = {"stage_1", "stage_2", "stage_3", "stage_4", "cubic", "saturate_states"}
    assert stages | {"rows_gap_no_contact", "columns_gap_no_contact"} <= select_noinline_blocks(
        made
    )
    assert "step_no_contact" not in select_noinline_blocks(made), "it computes nothing itself"


def test_what_a_loop_runs_is_apart() -> None:
    assert "dense_guards_drive_contact" in select_noinline_blocks(run_c_passes(program("hko")))


def test_whole_numbers_are_not_computed_in_software() -> None:
    assert "jump_drive" not in select_noinline_blocks(run_c_passes(program("hko")))


@pytest.mark.long
@pytest.mark.skipif(shutil.which(ARM_COMPILER) is None, reason="no compiler for the target")
@pytest.mark.parametrize("numbers", ["float64", "float32"])
@pytest.mark.parametrize("name", ["hko", "leaf_hko"])
def test_a_step_of_the_recursive_observer_takes_little_stack(
    name: str, numbers: NumberType
) -> None:
    assert metrics(name, numbers=numbers).stack <= MAX_STEP_STACK_BYTES


@pytest.mark.parametrize("name", ["estimator_float32", "driveline"])
def test_float32_and_continuous_automata_stay_as_they_are(name: str) -> None:
    assert select_noinline_blocks(run_c_passes(program(name))) == frozenset()
    assert "NOT_INLINED" not in emit_c_files(program(name))[f"{name}.c"]
