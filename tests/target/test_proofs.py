"""Generated C under tools of others, and mistakes that they have to find."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from codegen.proofs.misra import misra
from codegen.proofs.proof import PACKAGES, Proof
from codegen.proofs.stack import stack
from codegen.proofs.strict import strict
from codegen.source import c_files
from language.program import Program
from modewright.api import prove

pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, PACKAGES)), reason="a tool is missing: make system-packages"
)
CHECKS = ("warnings", "misra", "stack")
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


def held(proofs: list[Proof]) -> list[str]:
    return [finding for proof in proofs for finding in proof.findings]


@pytest.mark.parametrize(
    "name", ["estimator_float32", "estimator_simple", "supervisor", "contactor"]
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


def test_each_tool_finds_a_mistake(tmp_path: Path) -> None:
    (tmp_path / "wrong.c").write_text(WRONG)
    heard = [" ".join(proof.findings) for proof in strict(tmp_path, ["wrong.c"])]
    assert all("double-promotion" in text for text in heard), heard
    rules = {finding.rpartition(" ")[2] for finding in misra(tmp_path, ["wrong.c"]).findings}
    assert {"15.5", "15.6", "17.2"} <= rules
    with pytest.raises(ValueError, match="broken calls itself"):
        stack(tmp_path, ["wrong.c"], "broken")


def test_a_state_without_its_range_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing holds w_em any more, so that it may grow without bound."""

    def loosened(program: Program, by_amount: bool) -> dict[str, str]:
        files = c_files(program, by_amount)
        text, end, product = (
            files["estimator_simple.c"],
            "w_em <= 2400.0)",
            "drive_Phi_w_em_w_em * ",
        )
        assert end in text
        assert product in text
        text = text.replace(end, "w_em <= 1.7e308)").replace(product, f"{product}2.0 * ")
        return {**files, "estimator_simple.c": text}

    monkeypatch.setattr("codegen.proofs.values.c_files", loosened)
    (found,) = prove("estimator_simple", checks=("values",))
    assert any("estimator_simple.c" in finding for finding in found.findings), found
