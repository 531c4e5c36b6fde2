"""What functions write that a mode's transitions run, as contracts; parts that set no mode."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from codegen.emit.c_module import emit_c_files
from codegen.passes.pass_list import run_c_passes
from codegen.proofs.acsl.assigns_contract import (
    add_effect_contracts,
    add_loop_assigns,
    called_by,
    places_of,
)
from codegen.proofs.acsl.function_outlining import function_of, outline_except
from codegen.proofs.acsl.mode_contract import write_contracts
from language.ir.program import Program
from modewright.api.simulation import program

JUMPS = ("jump_drive", "jump_gap", "jump_coast")


@cache
def printed() -> tuple[Program, str]:
    made = program("hko")
    return run_c_passes(made, by_magnitude=False), emit_c_files(made, by_magnitude=False)["hko.c"]


def contract_of(text: str, name: str) -> str:
    found = re.search(rf"/\*@((?:(?!\*/).)*)\*/\nstatic \w+ void {name}\(", text, re.DOTALL)
    assert found, name
    return found[1]


def test_what_transitions_run_has_a_contract_and_a_spread_has_none() -> None:
    made, text = printed()
    called = called_by(made, JUMPS)
    assert {"rollback_drive_0", "rest_gap", "run_gap", "step_no_contact", "saturate_states"} <= set(
        called
    )
    assert not {*JUMPS, "rows_gap_no_contact", "correct_gap"} & set(called)
    told = add_effect_contracts(made, text, called)
    assert len(re.findall(r"^/\*@", told, re.M)) == len(called)


def test_a_contract_names_what_is_written_and_nothing_else() -> None:
    made, text = printed()
    told = add_effect_contracts(made, text, called_by(made, JUMPS))
    assert "assigns *work;" in contract_of(told, "guards_drive_contact")
    assert "assigns self->run_mode;" in contract_of(told, "switch_drive_contact")
    back = contract_of(told, "rollback_drive_0")
    assert "requires work == &self->work;" in back
    assert "self->mode" not in back and "self->fired" not in back
    assert "self->state.w_w" in back and not re.search(r"\blow\b", back), "it lives inside"


def test_values_of_a_step_that_live_in_a_function_are_not_seen_by_its_caller(
    tmp_path: Path,
) -> None:
    made = program("estimator_simple")
    write_contracts(made, emit_c_files(made, by_magnitude=False), tmp_path)
    text = (tmp_path / "estimator_simple.c").read_text()
    function = function_of(text, "jump_gap")
    assert "work" not in function.parameters and "Work scratch;" in function.body
    assert "self->state.theta_b" in contract_of(text, "jump_gap")
    assert "*work" not in contract_of(text, "jump_gap")


def test_an_array_is_written_from_end_to_end() -> None:
    made, _ = printed()
    assert "self->past_w_w[0 .. 2]" in places_of(made, "record_history")


def test_turns_of_a_loop_may_write_what_the_function_may_and_what_lives_in_it() -> None:
    made, text = printed()
    told = add_loop_assigns(
        function_of(text, "locate_no_contact"), places_of(made, "locate_no_contact")
    )
    assert (
        "/*@ loop invariant 0 <= halving <= 24; loop assigns halving, high, is_before_end, low"
        in (told)
    )
    assert ", *work; loop variant 24 - halving; */\n    for (int32_t halving" in told


def test_choices_that_set_no_mode_stand_in_functions_of_their_own() -> None:
    _, text = printed()
    function = function_of(text, "jump_gap")
    *parts, whole = outline_except(function, ("self->mode", "self->fired"))
    assert len(parts) == 12, "four counts, two ranges of each of four transitions"
    assert all("self->mode" not in part.body for part in parts)
    assert whole.body.count("self->mode =") == 6
    body = whole.body
    for part in parts:
        call = re.search(rf"^ *{part.name}\(self, work\);\n", body, re.MULTILINE)
        assert call
        body = body[: call.start()] + part.body + body[call.end() :]
    assert body == function.body


@pytest.mark.parametrize("name", ["contactor", "estimator_float32"])
def test_modes_whose_transitions_run_nothing_stay_whole(name: str, tmp_path: Path) -> None:
    made = program(name)
    asking = write_contracts(made, emit_c_files(made, by_magnitude=False), tmp_path)
    assert [options[0] for _, options in asking] == ["-wp-rte", "-wp-rte"]
    assert all(names == [f"jump_{mode.name}" for mode in made.modes] for names, _ in asking)


TERMINAL = """\
language: 1
automaton: terminal
period: 10 ms
numbers: float64
inputs: {u: {unit: 1, range: [0, 9]}}
initial: a
modes:
  a: {transitions: {b: {when: u > 3, wait: 50 ms}}}
  b: {}
outputs: [mode]
"""


def test_a_mode_without_transitions_has_no_contract(tmp_path: Path) -> None:
    """Its function has no argument that a contract could name."""
    (tmp_path / "terminal.yaml").write_text(TERMINAL)
    made = program(str(tmp_path / "terminal.yaml"))
    asking = write_contracts(made, emit_c_files(made, by_magnitude=False), tmp_path)
    assert {name for names, _ in asking for name in names} == {"jump_a"}
    assert (tmp_path / "terminal.c").read_text().count("/*@") == 1
