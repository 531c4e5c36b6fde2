"""Generated C under tools of others, and mistakes that they have to find."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from codegen.emit.c_module import emit_c_files
from codegen.harness.stack_usage import check_stack
from codegen.proofs.acsl.mode_contract import check_contracts, prove_contracts, write_contracts
from codegen.proofs.acsl.wp import KERNEL
from codegen.proofs.misra import check_misra
from codegen.proofs.sanitizer_run import check_sanitizers
from codegen.proofs.warnings import check_compiler_warnings
from codegen.toolchain.external_tools import DEBIAN_PACKAGES, run_tool
from codegen.toolchain.tool_verdict import ToolVerdict
from language.ir.program import Program
from language.loading.load import load_automaton
from language.overlays.expand_document import Project
from modewright.api.code_generation import prove
from modewright.api.simulation import program

pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, DEBIAN_PACKAGES)), reason="a tool is missing: make system-packages"
)
CHECKS = ("warnings", "misra", "stack")
GROWS = """\
#include <stddef.h>
#include <string.h>
double grows(double x, size_t n);
double grows(double x, size_t n)
{
    char b[n];
    memset(b, 1, n);
    return (x * 3.0) + (double)b[0];
}
"""
WRONG = """\
#include <stdint.h>
float broken(float x, int32_t n);
float broken(float x, int32_t n)
{
    double y = x * 2.0;
    if (n > 0)
        return y;
    return x + broken(x, n + 1);
}
"""


def held(proofs: list[ToolVerdict]) -> list[str]:
    return [finding for proof in proofs for finding in proof.findings]


@pytest.mark.parametrize(
    "name",
    ["estimator", "estimator_float32", "estimator_simple", "hko", "supervisor", "contactor"],
)
def test_shipped_automata_pass(name: str) -> None:
    found = list(prove(name, checks=CHECKS))
    assert [proof.check for proof in found] == ["warnings", "warnings", "misra", "stack"]
    assert held(found) == []


@pytest.mark.parametrize("name", ["estimator_simple", "contactor"])
def test_no_step_of_them_leaves_the_numbers(name: str) -> None:
    (found,) = prove(name, checks=("values",))
    assert found.findings == ()
    assert "statements reached" in found.about


def test_what_guards_may_do_is_proven_of_each_mode() -> None:
    (found,) = prove("contactor", checks=("contract",))
    assert found.findings == ()
    assert re.fullmatch(r"(\d+) of \1 goals; 2 modes", found.about)


@pytest.mark.parametrize(
    "name", ["estimator", "estimator_float32", "estimator_simple", "estimator_written", "hko"]
)
def test_the_contracts_of_shipped_automata_can_be_read(name: str, tmp_path: Path) -> None:
    """To prove them takes minutes; a contract that names what is not there proves nothing."""
    made = program(name)
    functions, _ = write_contracts(made, emit_c_files(made, by_magnitude=False), tmp_path)[0]
    done = run_tool(["frama-c", *KERNEL, f"{name}.c"], tmp_path)
    assert done.returncode == 0, done.stdout
    text = (tmp_path / f"{name}.c").read_text()
    assert all(f" {function}(" in text for function in functions)


def test_what_is_plain_in_parts_has_no_contract() -> None:
    (found,) = prove("driveline", checks=("contract",))
    assert not found.is_asked and not found.findings


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize(
    ("right", "wrong", "goal"),
    [
        ("self->fired = contactor_FIRED_open_shut;", "self->fired = 2U;", "jump_open_ensures"),
        (
            "self->fired = contactor_FIRED_shut_open;",
            "self->fired = 2U;\n        self->faults = 1U;",
            "jump_shut_assigns",
        ),
    ],
)
def test_a_mode_that_breaks_its_contract_is_found(
    right: str, wrong: str, goal: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = emit_c_files(program("contactor"), by_magnitude=False)
    assert made["contactor.c"].count(right) == 1
    broken = {**made, "contactor.c": made["contactor.c"].replace(right, wrong)}
    monkeypatch.setattr(
        "codegen.proofs.acsl.mode_contract.emit_c_files", lambda program, by_magnitude: broken
    )
    found = check_contracts(
        load_automaton("contactor", Project(Path())), program("contactor"), tmp_path
    )
    assert any(goal in finding for finding in found.findings), found


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize(
    ("function", "right", "wrong", "goal"),
    [
        (
            "jump_drive",
            "self->mode = hko_MODE_gap;",
            "self->mode = hko_MODE_coast;",
            "jump_drive_ensures",
        ),
        (
            "jump_gap",
            "    if (!((self->equation.T_fast > self->equation.T_far) "
            "&& (self->timer.after_1 >= 20U))) {\n        self->timer.gap_drive_fast = 0U;",
            "    if (!((self->equation.T_fast > self->equation.T_far) "
            "&& (self->timer.after_1 >= 20U))) {\n        self->timer.gap_drive_fast += 2U;",
            "jump_gap_1_ensures",
        ),
        (
            "switch_no_contact",
            "self->run_mode = hko_RUN_drive_contact;",
            "self->run_mode = hko_RUN_drive_contact;\n        self->mode = hko_MODE_drive;",
            "switch_no_contact_assigns",
        ),
    ],
)
def test_a_mistake_in_what_transitions_run_is_found(
    function: str, right: str, wrong: str, goal: str, tmp_path: Path
) -> None:
    """Of the function that is broken alone; of all of them it is a figure of `make prove`."""
    made = emit_c_files(program("hko"), by_magnitude=False)
    text, file = made["hko.c"], "hko.c"
    place = text.index(right, text.index(f" {function}("))
    broken = text[:place] + wrong + text[place + len(right) :]
    asking = write_contracts(program("hko"), {**made, file: broken}, tmp_path)
    asked = goal.rpartition("_")[0]
    own = [([name for name in names if name == asked], options) for names, options in asking]
    found = prove_contracts(tmp_path, file, own)
    assert found.asked and any(goal in one for one in found.open), found


@pytest.mark.usefixtures("impatient")
def test_without_a_mistake_all_of_it_is_proven_as_soon(tmp_path: Path) -> None:
    """What is found above is the mistake, not a prover that had too little time."""
    (contactor,) = prove("contactor", checks=("contract",))
    assert contactor.is_asked and not contactor.findings
    asking = write_contracts(
        program("hko"), emit_c_files(program("hko"), by_magnitude=False), tmp_path
    )
    names = {"jump_drive", "jump_gap_1", "switch_no_contact"}
    own = [([name for name in known if name in names], options) for known, options in asking]
    found = prove_contracts(tmp_path, "hko.c", own)
    assert found.asked and found.open == ()


def test_each_tool_finds_a_mistake(tmp_path: Path) -> None:
    (tmp_path / "wrong.c").write_text(WRONG)
    heard = [" ".join(proof.findings) for proof in check_compiler_warnings(tmp_path, ["wrong.c"])]
    assert all("double-promotion" in text for text in heard), heard
    rules = {finding.rpartition(" ")[2] for finding in check_misra(tmp_path, ["wrong.c"]).findings}
    assert {"15.5", "15.6", "17.2"} <= rules
    assert "broken calls itself" in check_stack(tmp_path, ["wrong.c"], "broken").findings


@pytest.mark.parametrize("name", ["estimator_float32", "supervisor", "driveline"])
def test_hostile_inputs_find_nothing_undefined(name: str, tmp_path: Path) -> None:
    found = check_sanitizers(program(name), tmp_path)
    assert found.findings == ()


def test_a_store_beyond_its_array_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def torn(made: Program) -> dict[str, str]:
        files = emit_c_files(made)
        text, place = files["supervisor.c"], "self->log[self->count_of_log]"
        assert place in text
        return {**files, "supervisor.c": text.replace(place, "self->log[self->count_of_log + 24]")}

    monkeypatch.setattr("codegen.harness.harness.emit_c_files", torn)
    (finding,) = check_sanitizers(program("supervisor"), tmp_path).findings
    assert "out of bounds" in finding


def test_what_a_tool_cannot_read_does_not_pass(tmp_path: Path) -> None:
    (tmp_path / "torn.c").write_text("int torn(int a) { if (a { return 1; }\n")
    proofs = [*check_compiler_warnings(tmp_path, ["torn.c"]), check_misra(tmp_path, ["torn.c"])]
    proofs.append(check_stack(tmp_path, ["torn.c"], "torn"))
    assert [proof.check for proof in proofs if proof.holds] == []
    assert not check_misra(tmp_path, ["missing.c"]).holds


def test_stack_that_is_not_known_is_told(tmp_path: Path) -> None:
    (tmp_path / "grows.c").write_text(GROWS)
    found = check_stack(tmp_path, ["grows.c"], "grows")
    assert found.findings == ("grows takes more or less each time",)
    assert "memset" in found.about
    assert "__aeabi_dmul" in found.about
    assert check_stack(tmp_path, ["grows.c"], "other").findings == (
        "other is not in the compiled code",
    )


def test_a_state_without_its_range_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing holds w_em any more, so that it may grow without bound."""

    def loosened(program: Program, by_magnitude: bool) -> dict[str, str]:
        files = emit_c_files(program, by_magnitude)
        text, end, product = (
            files["estimator_simple.c"],
            "w_em <= 2400.0)",
            "drive_Phi_w_em__w_em * ",
        )
        assert end in text
        assert product in text
        text = text.replace(end, "w_em <= 1.7e308)").replace(product, f"{product}2.0 * ")
        return {**files, "estimator_simple.c": text}

    monkeypatch.setattr("codegen.proofs.eva.emit_c_files", loosened)
    (found,) = prove("estimator_simple", checks=("values",))
    assert any("estimator_simple.c" in finding for finding in found.findings), found
