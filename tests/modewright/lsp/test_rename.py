"""Definitions are found and names given anew, in all files of a project."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from lsprotocol import types

import modewright as mw
from modewright.lsp.reference import Reference, references_to
from modewright.lsp.rename import rename
from modewright.lsp.rename_check import RenameRefused
from modewright.lsp.symbol_table import Symbol
from modewright.lsp.workspace import Workspace
from tests.modewright.lsp.client import LspClient
from tests.modewright.lsp.heater import apply_edits, position_of

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


def test_a_definition_is_found_in_another_file(talk: LspClient, driveline: Path) -> None:
    estimator = driveline.with_name("estimator.yaml")
    text = estimator.read_text()
    talk.open(estimator, text)
    for part, inside, target in (
        ("k_hs * (theta_d", 2, "k_hs:  {value"),
        ("in(driveline.no_contact)", 16, "  no_contact:\n    number"),
        ("in(driveline.no_contact)", 5, "driveline\n"),
    ):
        place = position_of(text, part, inside)
        (found,) = talk.request("textDocument/definition", talk.at(estimator, *place))
        assert found["uri"] == driveline.as_uri()
        line = position_of(driveline.read_text(), target)[0]
        assert found["range"]["start"]["line"] in (line - 1, line)


@pytest.mark.long
@pytest.mark.parametrize("old", ["k_hs:", "no_contact:\n"])
def test_a_rename_reaches_all_files_of_the_project_and_changes_no_meaning(
    talk: LspClient, driveline: Path, old: str
) -> None:
    files = sorted(driveline.parent.glob("*.yaml"))
    name = old.strip(":\n")
    text = driveline.read_text()
    asked = {**talk.at(driveline, *position_of(text, f"  {old}", 3)), "newName": "renamed"}
    changes = talk.request("textDocument/rename", asked)["changes"]
    assert len(changes) > 3
    for path in files:
        path.write_text(apply_edits(path.read_text(), changes.get(path.as_uri(), [])))
    root = driveline.parent.parent
    for checked in ("ev_driveline", "hko", "estimator_written", "study_tip_out"):
        path = next(p for p in files if p.stem == checked or f": {checked}\n" in p.read_text())
        errors = [p for p in mw.check(str(path), root=root) if p.severity == "error"]
        assert errors == [], mw.render_all(errors)
    assert f"{name}:" not in driveline.read_text().replace("gap: ", "")


def test_a_name_that_cannot_be_given_is_refused_with_the_reason(
    talk: LspClient, driveline: Path
) -> None:
    place = position_of(driveline.read_text(), "  k_hs:", 3)
    for name, reason in (
        ("c_hs", "is a name already"),
        ("while", "word of C"),
        ("1k", "not a name"),
    ):
        answer = talk.request_raw(
            "textDocument/rename", {**talk.at(driveline, *place), "newName": name}
        )
        assert reason in answer["error"]["message"]
    outside = driveline.with_name("worn.yaml")
    text = "language: 1\nvariant: worn\nextends: emps\nparameters: {M: {value: 1 kg}}\n"
    talk.open(outside, text)
    asked = {**talk.at(outside, *position_of(text, "M:")), "newName": "mass"}
    assert "not here" in talk.request_raw("textDocument/rename", asked)["error"]["message"]


@pytest.mark.parametrize(
    ("part", "new", "changed"),
    [
        ("trip: {}", "halt", [("trip", "halt")]),
        ("start: {event", "begin", [("start", "begin")]),
        ("idle: {start", "rest", [("idle: {start", "rest: {start"), ("stop: idle", "stop: rest")]),
    ],
)
def test_events_columns_and_rows_of_tables_are_renamed(
    talk: LspClient, tmp_path: Path, part: str, new: str, changed: list[tuple[str, str]]
) -> None:
    path = tmp_path / "spec" / "chart.yaml"
    path.parent.mkdir()
    errors = [each for each in talk.open(path, CHART) if each["severity"] == 1]
    assert errors == []
    asked = {**talk.at(path, *position_of(CHART, part, 1)), "newName": new}
    (edits,) = talk.request("textDocument/rename", asked)["changes"].values()
    wanted = CHART
    for old, text in changed:
        wanted = wanted.replace(old, text)
    if new == "rest":  # of the region `chart` alone
        before, sign, after = wanted.partition("  other:")
        wanted = before.replace("initial: idle", "initial: rest").replace("{idle: {}", "{rest: {}")
        wanted += sign + after
    assert apply_edits(CHART, edits) == wanted


QUOTED = """\
language: 1
automaton: 'quoted'
step: 1 ms
parameters: {"lim": {value: 5 1/s, about: "a limit"}, "k": {derived: "2 * lim", unit: 1/s}}
initial: "up"
modes: {"up": {transitions: {"down": {when: x > 1}}}, 'down': {}}
states: {x: {initial: 0}}
flow: {x: "der(x) = k - lim * x"}
outputs: ["x"]
"""


@pytest.mark.parametrize("part", ["'quoted'", '"lim"', '"up"', "'down'", '"x"'])
def test_what_is_quoted_is_renamed_inside_its_quotes(
    talk: LspClient, tmp_path: Path, part: str
) -> None:
    path = tmp_path / "spec" / "quoted.yaml"
    path.parent.mkdir()
    assert [each for each in talk.open(path, QUOTED) if each["severity"] == 1] == []
    name = part.strip("\"'")
    asked = {**talk.at(path, *position_of(QUOTED, part, 1)), "newName": "other"}
    (edits,) = talk.request("textDocument/rename", asked)["changes"].values()
    assert apply_edits(QUOTED, edits) == re.sub(rf"\b{name}\b", "other", QUOTED)


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


def test_a_mode_inside_a_mode_is_found_and_renamed(talk: LspClient, tmp_path: Path) -> None:
    path = tmp_path / "spec" / "nested.yaml"
    path.parent.mkdir()
    talk.open(path, NESTED)
    place = position_of(NESTED, "      slow:", 7)
    found = talk.request(
        "textDocument/references",
        {**talk.at(path, *place), "context": {"includeDeclaration": True}},
    )
    assert [each["range"]["start"]["line"] + 1 for each in found] == [10, 13, 14, 16]
    asked = {**talk.at(path, *place), "newName": "low"}
    (edits,) = talk.request("textDocument/rename", asked)["changes"].values()
    renamed = apply_edits(NESTED, edits)
    assert renamed == NESTED.replace("slow", "low").replace("low: {to: busy", "slow: {to: busy")


DEEP = """\
language: 1
automaton: deep
period: 10 ms
numbers: float64
micro_steps: 3
inputs: {u: {unit: 1, range: [0, 9]}}
discrete: {x: {unit: 1, initial: 0, range: [0, 9]}}
events: {go: {from: input}}
tables: {tab: {if: {c: u > 1}, rows: {"T": {x: 1}, "F": {x: 0}}}}
initial: a
modes:
  a: {transitions: {s: {event: go, priority: 1}, l2: {to: par.l.q, when: in(par.l.q), priority: 2}}}
  s:
    initial: p
    modes: {p: {transitions: {q: {when: u > 3}}}, q: {}}
    transitions: {a: {when: in(s.q), wait: 20 ms}}
  par: {regions: {l: {initial: p, modes: {p: {}, q: {}}}, r: {initial: p, modes: {p: {}}}}}
transition_table:
  columns: {lo: {when: u < 2, priority: 3}, hi: {when: u > 5, priority: 4}}
  rows: {a: {lo: s.q, hi: par.l.q}, s: {lo: stay, hi: stay}, par: {lo: a, hi: stay}}
outputs: [mode, x]
"""
AROUND = """\
language: 1
system: around
inputs: {go: {type: bool}}
instances: {d: {of: deep}}
connections: {d.u: 2, d.go: go}
"""
SEEN = """\
language: 1
test: seen
scenario: {of: around, horizon: 1 s, inputs: {go: "false"}}
expect:
  s: {never: in(d.par.l.q) or in(d.s.q)}
  t: {event: d.s.q, count: 0}
  u: {never: d.mode == s.q}
  v: {modes: [a, s.p], of: d}
"""


@pytest.fixture
def deep(talk: LspClient, tmp_path: Path) -> Path:
    path = tmp_path / "spec" / "deep.yaml"
    path.parent.mkdir()
    for name, text in (("around", AROUND), ("seen", SEEN), ("deep", DEEP)):
        path.with_name(f"{name}.yaml").write_text(text)
    assert [each for each in talk.open(path, DEEP) if each["severity"] == 1] == []
    return path


@pytest.mark.parametrize(
    ("part", "inside", "old", "lines"),
    [
        ("  s:\n", 2, "s", {"deep": [12, 13, 16, 20, 20], "seen": [5, 6, 7, 8]}),
        ("  par: {", 2, "par", {"deep": [12, 12, 17, 20, 20], "seen": [5]}),
        ("{l: {initial", 1, "l", {"deep": [12, 12, 17, 20], "seen": [5]}),
        ("{x: {unit", 1, "x", {"deep": [7, 9, 9, 21]}),
        ("{go: {from", 1, "go", {"deep": [8, 12], "around": [5]}),
    ],
)
def test_what_has_something_inside_is_renamed_in_paths_tables_systems_and_tests(
    talk: LspClient, deep: Path, part: str, inside: int, old: str, lines: dict[str, list[int]]
) -> None:
    asked = {**talk.at(deep, *position_of(DEEP, part, inside)), "newName": "zz"}
    changes = talk.request("textDocument/rename", asked)["changes"]
    found = {
        Path(uri).stem: sorted(each["range"]["start"]["line"] + 1 for each in edits)
        for uri, edits in changes.items()
    }
    assert found == lines
    for uri, edits in changes.items():
        file = deep.with_name(Path(uri).name)
        file.write_text(apply_edits(file.read_text(), edits))
    for file in deep.parent.glob("*.yaml"):
        errors = [p for p in mw.check(str(file), deep.parent.parent) if p.severity == "error"]
        assert errors == [], mw.render_all(errors)


@pytest.mark.parametrize(
    ("part", "name", "reason"),
    [
        ("s:\n    initial", "par", "is a name already"),
        ("l: {initial", "chart", "would mean something else"),
        ("x: {unit", "go", "would mean something else"),
    ],
)
def test_a_rename_that_changes_a_meaning_is_refused(
    talk: LspClient, deep: Path, part: str, name: str, reason: str
) -> None:
    asked = {**talk.at(deep, *position_of(DEEP, part)), "newName": name}
    assert reason in talk.request_raw("textDocument/rename", asked)["error"]["message"]


def test_a_rename_that_leaves_an_old_name_behind_is_refused(
    deep: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def without_tables(world: Workspace, declared: Symbol) -> list[Reference]:
        return [each for each in references_to(world, declared) if each.path[0] != "tables"]

    monkeypatch.setattr("modewright.lsp.rename.references_to", without_tables)
    monkeypatch.setattr("modewright.lsp.rename_check.references_to", without_tables)
    line, column = position_of(DEEP, "x: {unit")
    world = Workspace(deep.parent.parent)
    with pytest.raises(RenameRefused, match=r"not recognised: .*deep.yaml:9:"):
        rename(world, deep, types.Position(line - 1, column), "zz")
