"""Definitions are found and names given anew, in all files of a project."""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw
from tests.lsp.heating import applied, where
from tests.lsp.talk import Talk

CHART = """\
language: 1
automaton: chart
period: 1 ms
numbers: float64
events: {go: {from: input}, trip: {}}
regions:
  chart:
    initial: idle
    modes: {idle: {}, busy: {}}
    transition_table:
      columns: {start: {event: go}, stop: {event: trip}}
      rows: {idle: {start: busy, stop: stay}, busy: {start: stay, stop: idle}}
  other:
    initial: idle
    modes: {idle: {transitions: {busy: {event: [go, trip], raise: trip}}}, busy: {}}
outputs: [mode]
"""


def test_a_definition_is_found_in_another_file(talk: Talk, driveline: Path) -> None:
    estimator = driveline.with_name("estimator.yaml")
    text = estimator.read_text()
    talk.open(estimator, text)
    for part, inside, target in (
        ("k_hs * (theta_d", 2, "k_hs:  {value"),
        ("in(driveline.no_contact)", 16, "  no_contact:\n    number"),
        ("in(driveline.no_contact)", 5, "driveline\n"),
    ):
        place = where(text, part, inside)
        (found,) = talk.ask("textDocument/definition", talk.at(estimator, *place))
        assert found["uri"] == driveline.as_uri()
        line = where(driveline.read_text(), target)[0]
        assert found["range"]["start"]["line"] in (line - 1, line)


@pytest.mark.parametrize("old", ["k_hs:", "no_contact:\n"])
def test_a_rename_reaches_all_files_of_the_project_and_changes_no_meaning(
    talk: Talk, driveline: Path, old: str
) -> None:
    files = sorted(driveline.parent.glob("*.yaml"))
    name = old.strip(":\n")
    text = driveline.read_text()
    asked = {**talk.at(driveline, *where(text, f"  {old}", 3)), "newName": "renamed"}
    changes = talk.ask("textDocument/rename", asked)["changes"]
    assert len(changes) > 3
    for path in files:
        path.write_text(applied(path.read_text(), changes.get(path.as_uri(), [])))
    root = driveline.parent.parent
    for checked in ("ev_driveline", "hko", "estimator_written", "study_tip_out"):
        path = next(p for p in files if p.stem == checked or f": {checked}\n" in p.read_text())
        errors = [p for p in mw.check(str(path), root=root) if p.severity == "error"]
        assert errors == [], mw.render_all(errors)
    assert f"{name}:" not in driveline.read_text().replace("gap: ", "")


def test_a_name_that_cannot_be_given_is_refused_with_the_reason(
    talk: Talk, driveline: Path
) -> None:
    place = where(driveline.read_text(), "  k_hs:", 3)
    for name, reason in (
        ("c_hs", "is a name already"),
        ("while", "word of C"),
        ("1k", "not a name"),
    ):
        answer = talk.answer("textDocument/rename", {**talk.at(driveline, *place), "newName": name})
        assert reason in answer["error"]["message"]
    outside = driveline.with_name("worn.yaml")
    text = "language: 1\nvariant: worn\nextends: emps\nparameters: {M: {value: 1 kg}}\n"
    talk.open(outside, text)
    asked = {**talk.at(outside, *where(text, "M:")), "newName": "mass"}
    assert "not here" in talk.answer("textDocument/rename", asked)["error"]["message"]


@pytest.mark.parametrize(
    ("part", "new", "changed"),
    [
        ("trip: {}", "halt", [("trip", "halt")]),
        ("start: {event", "begin", [("start", "begin")]),
        ("idle: {start", "rest", [("idle: {start", "rest: {start"), ("stop: idle", "stop: rest")]),
    ],
)
def test_events_columns_and_rows_of_tables_are_renamed(
    talk: Talk, tmp_path: Path, part: str, new: str, changed: list[tuple[str, str]]
) -> None:
    path = tmp_path / "spec" / "chart.yaml"
    path.parent.mkdir()
    errors = [each for each in talk.open(path, CHART) if each["severity"] == 1]
    assert errors == []
    asked = {**talk.at(path, *where(CHART, part, 1)), "newName": new}
    (edits,) = talk.ask("textDocument/rename", asked)["changes"].values()
    wanted = CHART
    for old, text in changed:
        wanted = wanted.replace(old, text)
    if new == "rest":  # of the region `chart` alone
        before, sign, after = wanted.partition("  other:")
        wanted = before.replace("initial: idle", "initial: rest").replace("{idle: {}", "{rest: {}")
        wanted += sign + after
    assert applied(CHART, edits) == wanted


NESTED = """\
language: 1
automaton: nested
period: 1 ms
numbers: float64
inputs: {u: {unit: 1, range: [0, 9]}}
discrete: {n: {initial: 0, range: [0, 9]}}
initial: busy
modes:
  busy:
    initial: slow
    transitions: {rest: {when: u < 1, priority: 1}}
    modes:
      slow: {update: {n: u}, transitions: {fast: {when: u > 5}}}
      fast: {transitions: {slow: {when: u < 5}, rest: {when: u > 8}}}
  rest:
    transitions: {fast: {to: busy.fast, when: u > 2}, slow: {to: busy.slow, when: u > 1}}
outputs: [n, mode]
"""


def test_a_mode_inside_a_mode_is_found_and_renamed(talk: Talk, tmp_path: Path) -> None:
    path = tmp_path / "spec" / "nested.yaml"
    path.parent.mkdir()
    talk.open(path, NESTED)
    place = where(NESTED, "      slow:", 7)
    found = talk.ask(
        "textDocument/references",
        {**talk.at(path, *place), "context": {"includeDeclaration": True}},
    )
    assert [each["range"]["start"]["line"] + 1 for each in found] == [10, 13, 14, 16]
    asked = {**talk.at(path, *place), "newName": "low"}
    (edits,) = talk.ask("textDocument/rename", asked)["changes"].values()
    renamed = applied(NESTED, edits)
    assert renamed == NESTED.replace("slow", "low").replace("low: {to: busy", "slow: {to: busy")
