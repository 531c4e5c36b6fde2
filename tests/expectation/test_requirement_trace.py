"""Requirements are found in specs, in the C that cites them, and in tests; gaps are told."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from expectation.requirement_trace import RequirementTrace
from modewright.api import traceability as traces
from modewright.api.spec_tests import find_tests, load_test
from modewright.cli.app import app
from modewright.render import requirement_trace as show_trace
from tests.expectation.latch_project import AUTOMATON, HEAD, write_project

REQUIRED = (
    AUTOMATON.replace("wait: 2 ms}", "wait: 2 ms, req: [L-1, L-2]}")
    .replace("high: {number: 1,", "high: {number: 1, like: upper,")
    .replace("modes:\n", "templates: {upper: {req: L-3}}\nmodes:\n")
)


@pytest.fixture
def found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RequirementTrace:
    """A trace in which one requirement is untested, one unimplemented, one only listed."""
    head = HEAD.replace("expect:", "req: L-1\nexpect:")
    write_project(
        tmp_path, "met: {event: high, req: [L-3, L-4]}", "late: {event: high, at: 6 ms}", head=head
    )
    (tmp_path / "spec" / "latch.yaml").write_text(REQUIRED)
    (tmp_path / "needs.csv").write_text("L-5,nobody did it\nL-1,goes high\n\n")
    monkeypatch.chdir(tmp_path)
    return traces.trace(["latch"], Path("needs.csv"))


def test_what_is_missing_is_told(found: RequirementTrace) -> None:
    assert [each.name for each in found.requirements] == ["L-5", "L-1", "L-3", "L-2", "L-4"]
    assert found.with_state("traced") == ["L-1", "L-3"]
    assert found.with_state("untested") == ["L-2"]
    assert found.with_state("unimplemented") == ["L-5", "L-4"]
    assert show_trace.trace_summary(found) == (
        "5 requirements; 1 untested: L-2; 2 unimplemented: L-5, L-4"
    )


def test_shipped_tests_count_for_shipped_specs_in_any_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert traces.trace("ev_driveline").with_state("untested") == []
    write_project(tmp_path, "met: {event: high}")
    (own,) = find_tests()
    assert find_tests(specs=[tmp_path / "spec" / "latch.yaml"]) == [own]
    shipped = Path(str(load_test("tip_out_is_detected").scenario.span.source.name))
    assert find_tests(specs=[shipped])[0] == own
    assert len(find_tests(specs=[shipped])) > 5


def test_the_lines_of_c_are_those_that_cite_the_place(found: RequirementTrace) -> None:
    code = Path("latch.c")
    assert CliRunner().invoke(app, ["generate", "latch", "--out", "."]).exit_code == 0
    lines = code.read_text().splitlines()
    claims = {each.name: each.implementations for each in found.requirements}
    (guard,) = claims["L-1"]
    assert guard.path == "modes.low.transitions.high" and guard.place == "spec/latch.yaml:11"
    cited = [k for k, line in enumerate(lines, 1) if "modes.low.transitions.high" in line]
    assert guard.code == tuple(("latch.c", k) for k in cited) and len(cited) >= 2
    (template,) = claims["L-3"]
    assert template.path == "templates.upper"
    own = [k for k, line in enumerate(lines, 1) if "latch modes.high." in line]
    assert template.code == tuple(("latch.c", k) for k in own) and own


def test_a_trace_is_written_in_every_form(found: RequirementTrace) -> None:
    rows = list(csv.DictReader(io.StringIO(show_trace.trace_csv(found))))
    assert [(row["requirement"], row["test"], row["verdict"]) for row in rows] == [
        ("L-5", "", ""), ("L-1", "latched", "not run"), ("L-3", "latched.met", "not run"),
        ("L-2", "", ""), ("L-4", "latched.met", "not run"),
    ]  # fmt: skip
    page = show_trace.trace_html(found, "latch <1>")
    assert "Trace of latch &lt;1&gt;" in page and page.count("<tr>") == 6
    data = show_trace.trace_json(found)
    assert data["untested"] == ["L-2"] and data["requirements"][1]["text"] == "goes high"


def test_a_requirement_is_no_formula_in_csv(found: RequirementTrace) -> None:
    formula = "=cmd|' /C calc'!A0"
    first = dataclasses.replace(found.requirements[0], name=formula)
    trace = dataclasses.replace(found, requirements=(first,))
    (row,) = csv.DictReader(io.StringIO(show_trace.trace_csv(trace)))
    assert row["requirement"] == f"'{formula}"


def test_the_command_runs_tests_and_is_strict(found: RequirementTrace) -> None:
    command = ["trace", "latch", "--run", "--strict", "--out", "trace.json"]
    told = CliRunner().invoke(app, command)
    assert told.exit_code == 1
    assert "spec/test_latched.yaml:9: latched.met, passed" in told.output
    assert "spec/test_latched.yaml:2: latched, failed" in told.output
    assert json.loads(Path("trace.json").read_text())["unimplemented"] == ["L-4"]
    assert CliRunner().invoke(app, ["trace", "latch", "--out", "t.txt"]).exit_code == 1


PAIR = """\
language: 1
automaton: pair
period: 1 ms
numbers: float64
inputs: {volts: {unit: V, range: [-10, 10], default: 0 V}}
instances:
  main: {of: latch, inputs: {level: volts}, req: P-1}
  spare: {of: latch, inputs: {level: 0 V}}
outputs: [mode]
"""


def test_requirements_of_instances_are_those_of_what_has_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Everywhere in what they are of: a file, an input, a template, a transition."""
    write_project(tmp_path, "met: {event: high, req: L-3}")
    spec = REQUIRED.replace("automaton: latch\n", "automaton: latch\nreq: L-6\n").replace(
        "level: {unit: V,", "level: {unit: V, req: L-7,"
    )
    (tmp_path / "spec" / "latch.yaml").write_text(spec)
    (tmp_path / "spec" / "pair.yaml").write_text(PAIR)
    monkeypatch.chdir(tmp_path)
    found = traces.trace(["pair"])
    claims = {
        each.name: {claim.path: claim for claim in each.implementations}
        for each in found.requirements
    }
    assert {name: list(paths) for name, paths in claims.items()} == {
        "L-3": ["templates.main_upper", "templates.spare_upper"],
        "P-1": ["regions.main"],
        "L-6": ["regions.main", "regions.spare"],
        "L-7": ["regions.main", "regions.spare"],
        **{name: [f"regions.{k}.modes.low.transitions.high" for k in ("main", "spare")]
           for name in ("L-1", "L-2")},
    }  # fmt: skip
    assert all(claim.code for paths in claims.values() for claim in paths.values())
    assert claims["L-1"]["regions.main.modes.low.transitions.high"].place == "spec/latch.yaml:12"
    assert found.with_state("traced") == ["L-3"]
    assert CliRunner().invoke(app, ["trace", "pair", "--strict"]).exit_code == 1


@pytest.mark.parametrize("is_apart", [False, True])
def test_a_scenario_names_requirements_of_its_test(tmp_path: Path, is_apart: bool) -> None:
    head = HEAD.replace("  horizon", "  req: L-1\n  horizon")
    path = write_project(tmp_path, "met: {event: high}", head=head)
    if is_apart:
        inner = head.partition("scenario:\n")[2].partition("expect:")[0].replace("  ", "", 1)
        text = f"language: 1\nscenario: steps\n{inner}".replace("\n  ", "\n")
        (tmp_path / "spec" / "steps.yaml").write_text(text)
        path.write_text("language: 1\ntest: latched\nscenario: steps\nexpect: {a: {event: high}}\n")
    assert load_test(str(path), tmp_path).requirements == ("L-1",)


@pytest.mark.parametrize("heading", ["name,text", "ID, Title", "Requirement"])
def test_the_heading_of_a_list_is_no_requirement(tmp_path: Path, heading: str) -> None:
    path = tmp_path / "needs.csv"
    path.write_text(f"{heading}\nL-5,nobody did it\nname,stays\n")
    assert traces.read_requirements(path) == {"L-5": "nobody did it", "name": "stays"}
    path.write_text("L-5,nobody did it\n")
    assert traces.read_requirements(path) == {"L-5": "nobody did it"}
