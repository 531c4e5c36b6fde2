"""Tests of specs are run on the engine and in C; what is told of them."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from typer.testing import CliRunner

import modewright as mw
from engine.simulation.simulate import simulate
from modewright.api import spec_tests as tests
from modewright.cli.app import app
from modewright.render import spec_tests as show_tests
from tests.expectation.latch_project import write_project

SHIPPED = Path(__file__).parent.parent.parent


@pytest.mark.parametrize("path", tests.find_tests(SHIPPED), ids=lambda path: Path(path).stem)
def test_the_tests_that_are_shipped_pass(path: str) -> None:
    """One in C, too: `make check` runs all of them there."""
    in_c = "tip_in" in path
    (run,) = tests.run_tests([path], SHIPPED, compiled=in_c)
    assert run.passed, list(show_tests.spec_test_lines(run))
    assert run.backend.startswith("compiled") == in_c


def test_a_changed_spec_fails_the_test_that_is_shipped(tmp_path: Path) -> None:
    values = "est.t_wait: 7 ms, plant.alpha: 0.02 rad"
    text = (SHIPPED / "spec" / "ev_driveline" / "test_tip_out.yaml").read_text()
    path = tmp_path / "changed.yaml"
    path.write_text(text.replace("test: tip_out_is_detected", "test: changed")
                    + f"values: {{{values}}}\n")  # fmt: skip
    (run,) = mw.run_tests([str(path)], SHIPPED, compiled=False)
    assert {"detected", "lands", "first_loss"} <= {
        outcome.name for outcome in run.outcomes if not outcome.passed
    }


def test_another_verdict_in_c_fails_a_test(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_project(tmp_path, "low: {that: level < 3 V, at: 29 ms}", "ok: {event: high}")

    def wrong(system: object, scenario: object) -> object:
        run = simulate(system, scenario)  # type: ignore[arg-type]
        moved = {name: np.nextafter(values, 9.0) for name, values in run.signals.items()}
        return dataclasses.replace(run, signals=moved), "compiled"

    monkeypatch.setattr(tests, "run_in_c", wrong)
    (run,) = tests.run_tests([str(path)], tmp_path)
    assert all(outcome.passed for outcome in run.outcomes) and not run.passed
    assert run.difference.startswith("`level` at 0 s is")


def test_the_command_tells_what_failed_in_every_form(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_project(tmp_path, "met: {event: high, req: L-1}", "late: {event: high, at: 6 ms}")
    monkeypatch.chdir(tmp_path)
    told = CliRunner().invoke(app, ["test", "--interpreted", "--junit", "out.xml"])
    assert told.exit_code == 1
    place = "spec/test_latched.yaml:9:17"
    assert f"{place}: late: `high` happened at 0.007 s, expected at 0.006 s" in told.output
    assert "1 test, 1 failed" in told.output
    suite = ElementTree.parse("out.xml").getroot()[0]
    assert suite.attrib["tests"] == "2" and suite.attrib["failures"] == "1"
    assert [case.find("failure") is not None for case in suite] == [False, True]
    told = CliRunner().invoke(app, ["test", "latched", "--interpreted", "--json"])
    (found,) = json.loads(told.stdout)["tests"]
    assert [each["passed"] for each in found["expectations"]] == [True, False]
    assert found["expectations"][0]["requirements"] == ["L-1"]
    assert found["expectations"][1]["time"] == 0.007


def test_a_test_that_passes_leaves_with_0(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_project(tmp_path, "met: {event: high}")
    monkeypatch.chdir(tmp_path)
    assert CliRunner().invoke(app, ["test", "--interpreted"]).exit_code == 0


def test_parameters_are_set_and_rows_are_closer(tmp_path: Path) -> None:
    head = write_project(tmp_path).read_text().replace("expect:\n", "every: 0.5 ms\nexpect:\n")
    path = write_project(tmp_path, "between: {that: level > 1 V, at: 5.5 ms}", head=head)
    (run,) = tests.run_tests([str(path)], tmp_path, compiled=False)
    assert run.passed
