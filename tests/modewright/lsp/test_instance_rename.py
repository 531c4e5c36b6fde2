"""Modes and regions are given anew where an automaton runs alone, and where a system holds it."""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw
from tests.modewright.lsp.client import LspClient
from tests.modewright.lsp.heater import apply_edits, position_of

LONE = """\
language: 1
automaton: lone
period: 10 ms
numbers: float64
faults: {sensor: {latched: true}}
inputs:
  go: {type: bool}
  u: {unit: 1, range: [0, 9], fault: sensor}
  word: {type: enum, values: [idle, busy]}
regions:
  charge:
    initial: idle
    modes:
      idle: {transitions: {session: {when: go and word == busy}}}
      session: {initial: cc, modes: {cc: {transitions: {cv: {when: u > 3}}}, cv: {}}}
  heat:
    initial: off_
    modes: {off_: {transitions: {warm: {when: in(charge.session.cc)}}}, warm: {}}
outputs: [mode, charge, heat, faults]
"""
CAR = """\
language: 1
system: car
inputs: {go: {type: bool}, u: {unit: 1}, word: {type: enum, values: [idle, busy]}}
instances: {lone: {of: lone}}
connections: {lone.go: go, lone.word: word, lone.u: u}
"""
RUN = """\
language: 1
scenario: run
of: lone
horizon: 1 s
inputs: {go: "true", u: 1, word: idle}
record: {every: 10 ms}
"""
TEST = """\
language: 1
test: looked
scenario: run
expect:
  one: {that: lone.charge == idle, before: 1 s}
  two: {never: in(lone.charge.session.cv) or idle != lone.charge}
  three: {modes: [idle], of: lone.charge}
  four: {event: lone.charge.session, count: 0}
  five: {never: fault(lone.sensor)}
"""
BARE = """\
  six: {always: charge == idle and heat != warm and word == idle}
  seven: {never: fault(sensor) or in(charge.session)}
  eight: {modes: [idle], of: charge}
"""


@pytest.mark.parametrize(
    ("part", "lines", "bare"),
    [
        ("charge:\n", {"lone": [11, 18, 19], "looked": [5, 6, 6, 7, 8]}, [10, 11, 12]),
        ("idle: {trans", {"lone": [12, 14], "looked": [5, 6, 7]}, [10, 12]),
        ("cv: {}", {"lone": [15, 15], "looked": [6]}, []),
        ("session: {ini", {"lone": [14, 15, 18], "looked": [6, 8]}, [11]),
        ("sensor: {lat", {"lone": [5, 8], "looked": [9]}, [11]),
    ],
)
@pytest.mark.parametrize("of", ["lone", "car"])
def test_tests_are_followed_of_an_automaton_and_of_a_system(
    talk: LspClient,
    tmp_path: Path,
    of: str,
    part: str,
    lines: dict[str, list[int]],
    bare: list[int],
) -> None:
    is_alone = of == "lone"
    texts = {
        "lone": LONE,
        "looked": TEST + BARE * is_alone,
        "run": RUN.replace("of: lone", f"of: {of}"),
    }
    folder = tmp_path / "spec"
    folder.mkdir()
    for name, text in (texts | {"car": CAR}).items():
        (folder / f"{name}.yaml").write_text(text)
    talk.open(folder / "lone.yaml", LONE)
    asked = {**talk.at(folder / "lone.yaml", *position_of(LONE, part)), "newName": "zz"}
    changes = talk.request("textDocument/rename", asked)["changes"]
    found = {
        Path(uri).stem: sorted(each["range"]["start"]["line"] + 1 for each in edits)
        for uri, edits in changes.items()
    }
    assert found == lines | {"looked": lines["looked"] + bare * is_alone}
    for uri, edits in changes.items():
        file = folder / Path(uri).name
        file.write_text(apply_edits(file.read_text(), edits))
    for file in folder.glob("*.yaml"):
        errors = [p for p in mw.check(str(file), tmp_path) if p.severity == "error"]
        assert errors == [], mw.render_all(errors)


def test_an_automaton_that_runs_alone_is_renamed_as_its_own_instance(
    talk: LspClient, tmp_path: Path
) -> None:
    folder = tmp_path / "spec"
    folder.mkdir()
    for name, text in {"lone": LONE, "looked": TEST, "run": RUN}.items():
        (folder / f"{name}.yaml").write_text(text)
    talk.open(folder / "lone.yaml", LONE)
    asked = {**talk.at(folder / "lone.yaml", *position_of(LONE, "lone\n")), "newName": "zz"}
    changes = talk.request("textDocument/rename", asked)["changes"]
    assert {Path(uri).stem: len(edits) for uri, edits in changes.items()} == {
        "lone": 1, "run": 1, "looked": 6,
    }  # fmt: skip
