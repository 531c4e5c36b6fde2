"""Check of the intermediate representation: `check --ir`, its output and its exit code."""

from __future__ import annotations

import json

import pytest

from language.ircheck.violation import Violation
from modewright.api import ir_check
from modewright.api.ir_check import check_ir
from modewright.cli.app import app
from modewright.cli.commands.explain import PASSES
from tests.language.spec_builders import ROOT

BROKEN = Violation("type", "block step, `x := y`", "`x` is real, the value truth")


@pytest.fixture
def broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the checker find something in every Program."""
    monkeypatch.setattr(ir_check, "check_program", lambda program, properties: (BROKEN,))


def run(*arguments: str) -> int:
    """Return the exit code of the command."""
    return int(app(["check", *arguments], standalone_mode=False) or 0)


def test_each_automaton_of_a_spec_is_checked_after_each_pass() -> None:
    (found,) = check_ir("contactor", ROOT)
    assert tuple(found.violations) == ("lowered", *PASSES)
    assert found.is_valid
    assert {one.automaton for one in check_ir("ev_driveline", ROOT)} >= {"driveline", "estimator"}
    assert check_ir("tip_out", ROOT) == ()


def test_the_command_counts_the_programs(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("contactor", "--ir") == 0
    assert "10 Programs checked, 0 violations" in capsys.readouterr().out


def test_the_programs_are_a_part_of_the_json(capsys: pytest.CaptureFixture[str]) -> None:
    run("contactor", "--ir", "--json")
    report = json.loads(capsys.readouterr().out)
    assert report["problems"] == []
    (entry,) = report["ir"]
    assert entry == {
        "automaton": "contactor",
        "passes": ["lowered", *PASSES],
        "violations": [],
    }


@pytest.mark.usefixtures("broken")
def test_a_violation_is_reported_with_its_pass(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("contactor", "--ir") == 1
    printed = capsys.readouterr()
    assert "10 Programs checked, 10 violations" in printed.out
    assert (
        "contactor, after `lowered`: [type] block step, `x := y`: `x` is real, the value truth"
        in printed.err
    )
    assert run("contactor", "--ir", "--json") == 1
    first, *_ = json.loads(capsys.readouterr().out)["ir"][0]["violations"]
    assert first == {
        "pass": "lowered",
        "rule": "type",
        "place": "block step, `x := y`",
        "message": "`x` is real, the value truth",
    }


def test_a_spec_with_errors_has_no_programs(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("no_such_spec", "--ir") == 1
    assert "0 Programs checked, 0 violations" in capsys.readouterr().out
