"""What functions of generated C say of themselves, and what their parts are called."""

from __future__ import annotations

import pytest

from codegen.names import c_member, transition_constants
from codegen.purpose import purpose
from codegen.source import ENTRIES, c_program
from modewright.api import program

SHIPPED = ("estimator", "estimator_float32", "hko", "driveline", "supervisor", "contactor")


@pytest.mark.parametrize("name", SHIPPED)
def test_each_function_of_a_shipped_automaton_says_what_it_is_for(name: str) -> None:
    blocks = [block for block in c_program(program(name)).blocks if block not in ENTRIES]
    assert blocks
    for block in blocks:
        assert purpose(block)
        assert not set("[]{}") & set(purpose(block))


def test_a_purpose_names_the_mode_where_there_is_one() -> None:
    assert purpose("rates_no_contact") == "Rates of the states in mode no_contact"
    assert purpose("equations") == "Equations"
    assert purpose("latch_apart").startswith("Inputs one by one")
    assert purpose("what_nobody_knows") == ""


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
