"""What functions of generated C say of themselves, and what their parts are called."""

from __future__ import annotations

import pytest

from codegen.emit.c_module import emit_c_files, fault_reason
from codegen.emit.c_names import c_member, transition_constants
from codegen.emit.function_comments import describe_function
from codegen.passes.pass_list import run_c_passes
from language.ir.program import ENTRY_BLOCKS
from modewright.api.simulation import program

SHIPPED = ("estimator", "estimator_float32", "hko", "driveline", "supervisor", "contactor")


@pytest.mark.parametrize("name", SHIPPED)
def test_each_function_of_a_shipped_automaton_says_what_it_is_for(name: str) -> None:
    blocks = [block for block in run_c_passes(program(name)).blocks if block not in ENTRY_BLOCKS]
    assert blocks
    for block in blocks:
        assert describe_function(block)
        assert not set("[]{}") & set(describe_function(block))


def test_a_purpose_names_the_mode_where_there_is_one() -> None:
    assert describe_function("rates_no_contact") == "Rates of the states in mode no_contact"
    assert describe_function("equations") == "Equations"
    assert describe_function("latch_each").startswith("Inputs one by one")
    assert describe_function("what_nobody_knows") == ""
    both = describe_function("fast_path_gap_no_contact", ("gap", "drive"), ("no_contact",))
    assert both.startswith("The whole step in mode gap with the model in no_contact,")


def test_rows_and_columns_of_a_solved_matrix_are_apart() -> None:
    assert c_member("solved.drive_L.w_em.y_w") == "drive_L_w_em__y_w"
    assert c_member("solved.stamp_J_em") == "stamp_J_em"
    assert c_member("state.w_em") == "w_em"


@pytest.mark.parametrize("name", SHIPPED)
def test_transitions_have_names_of_their_own(name: str) -> None:
    made = program(name)
    names = transition_constants(made)
    assert sorted(names) == [info.number for info in made.transitions]
    assert len(set(names.values())) == len(names) > 0


def test_a_transition_is_called_by_its_source_and_its_name() -> None:
    assert transition_constants(program("contactor"))[1] == "contactor_FIRED_open_shut"
    names = transition_constants(program("supervisor"))
    assert names[9] == "supervisor_FIRED_operation_drive_torque_creep_pull"


@pytest.mark.parametrize("name", SHIPPED)
def test_each_fault_bit_says_why_it_is_set(name: str) -> None:
    made = program(name)
    header = emit_c_files(made)[f"{name}.h"]
    for bit, fault in enumerate(made.faults):
        why = fault_reason(made, fault)
        assert why
        assert f"#define {name}_FAULT_{fault} (1UL << {bit}) /* {why} */\n" in header


def test_a_count_says_when_its_transition_is_due() -> None:
    text = emit_c_files(program("estimator"))["estimator.c"]
    assert "/* due at 2 in a row: estimator modes.drive.transitions.gap.wait, 0.7 ms */" in text
