"""The language server: what an editor is told, asked through the real protocol."""

from __future__ import annotations

import random
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from lsprotocol import types

import modewright as mw
from language.problem import Source, Span
from modewright.lsp.completion import complete
from modewright.lsp.hover import hover as hover_at
from modewright.lsp.positions import column_of, range_of
from modewright.lsp.rename import definition
from modewright.lsp.world import World
from tests.lsp.talk import Message, Talk

ROOT = Path(__file__).parent.parent.parent
HEATER = """\
language: 1
automaton: heater
period: 10 ms
numbers: float64
parameters:
  T_on: {value: 18 degC, about: "below this it heats"}
  P_on: {value: 2 kW}
  P_low: {derived: P_on / 4, unit: W}
inputs: {T_room: {unit: degC, range: [-40, 80]}}
discrete: {P: {unit: W, initial: 0 W, range: [0, 5000]}}
initial: idle
modes:
  idle:
    entry: {P: 0 W}
    transitions: {heating: {when: T_room < T_on, wait: 50 ms}}
  heating:
    entry: {P: P_on}
    exit: {P: P_low}
    transitions: {idle: {when: T_room > T_on}}
outputs: [P, mode]
"""


@pytest.fixture(scope="module")
def talk() -> Iterator[Talk]:
    with Talk(("utf-8", "utf-16")) as made:
        yield made


@pytest.fixture
def heater(talk: Talk, tmp_path: Path) -> Path:
    path = tmp_path / "spec" / "heater.yaml"
    path.parent.mkdir()
    path.write_text("language: 1\nautomaton: heater\n")  # the editor's text counts, not this
    told = talk.open(path, HEATER)
    assert told == [], told
    return path


def where(text: str, part: str, inside: int = 0) -> tuple[int, int]:
    """Return line (from 1) and column (from 0) of the first place of a part of a text."""
    before = text[: text.index(part) + inside]
    return before.count("\n") + 1, len(before.rpartition("\n")[2])


def labels(talk: Talk, path: Path, text: str) -> list[str]:
    """Return what is offered at the sign `|` of a text."""
    before, _, after = text.partition("|")
    talk.begin_change(path, before + after)
    place = (before.count("\n") + 1, len(before.rpartition("\n")[2]))
    found = talk.ask("textDocument/completion", talk.at(path, *place))
    return [item["label"] for item in found["items"]]


def hover(talk: Talk, path: Path, place: tuple[int, int]) -> str:
    told: Message | None = talk.ask("textDocument/hover", talk.at(path, *place))
    return told["contents"]["value"] if told else ""


def applied(text: str, edits: list[dict[str, Any]]) -> str:
    lines = text.split("\n")
    for edit in sorted(edits, key=lambda e: str(e["range"]["start"]), reverse=True):
        start, end = edit["range"]["start"], edit["range"]["end"]
        assert start["line"] == end["line"]
        line = lines[start["line"]]
        lines[start["line"]] = (
            line[: start["character"]] + edit["newText"] + line[end["character"] :]
        )
    return "\n".join(lines)


def test_problems_are_those_of_the_editors_text(talk: Talk, heater: Path) -> None:
    (told,) = talk.change(heater, HEATER.replace("when: T_room > T_on", "when: T_rom > T_on"))
    line, column = where(HEATER, "T_room > T_on")
    assert told["range"]["start"] == {"line": line - 1, "character": column}
    assert told["range"]["end"] == {"line": line - 1, "character": column + len("T_rom")}
    assert "did you mean `T_room`?" in told["message"]
    assert (told["code"], told["severity"], told["source"]) == ("MW115", 1, "modewright")
    assert talk.change(heater, HEATER) == []


def test_what_a_help_names_is_written_at_a_key_press(talk: Talk, heater: Path) -> None:
    wrong = HEATER.replace("when: T_room > T_on", "when: T_rom > T_on")
    told = talk.change(heater, wrong)
    uri = heater.as_uri()
    asked = {"range": told[0]["range"], "context": {"diagnostics": told}}
    found = talk.ask("textDocument/codeAction", {"textDocument": {"uri": uri}, **asked})
    (action,) = found
    assert action["title"] == "Write `T_room`"
    assert applied(wrong, action["edit"]["changes"][uri]) == HEATER


def test_a_text_that_is_no_yaml_is_told_of(talk: Talk, heater: Path) -> None:
    (told,) = talk.change(heater, HEATER + "regions: {a: [\n")
    assert "this is not YAML" in told["message"]


def test_what_has_to_be_proven_follows_and_stays_while_its_line_stays(
    talk: Talk, heater: Path
) -> None:
    dead = HEATER.replace("when: T_room > T_on", "when: T_room > 100 degC")
    assert talk.change(heater, dead) == []
    told = talk.problem(heater, "MW211")
    assert "T_room > 100 degC" in dead.splitlines()[told["range"]["start"]["line"]]
    assert told in talk.change(heater, dead + "\n")
    assert told not in talk.change(heater, HEATER)


def test_a_mistake_in_a_base_is_told_in_the_variant(
    talk: Talk, heater: Path, tmp_path: Path
) -> None:
    variant = tmp_path / "spec" / "weak.yaml"
    text = "language: 1\nvariant: weak\nextends: heater\nparameters: {P_on: {value: 1 kW}}\n"
    assert talk.open(variant, text) == []
    talk.change(heater, HEATER.replace("when: T_room > T_on", "when: T_rom > T_on"))
    talk.versions[variant.as_uri()] = 1
    (told,) = talk.change(variant, text + "\n")
    assert "heater.yaml:19:" in told["message"]
    assert told["range"]["start"] == {"line": 0, "character": 0}
    (related,) = told["relatedInformation"]
    assert related["location"]["uri"] == heater.as_uri()


def test_columns_are_counted_as_the_editor_asked_for(talk: Talk, heater: Path) -> None:
    assert talk.capabilities["positionEncoding"] == "utf-8"
    text = HEATER.replace('"below this it heats"}', '"\U0001f525", vlaue: 1}')
    (told,) = talk.change(heater, text)
    line = next(line for line in text.splitlines() if "vlaue" in line)
    assert told["range"]["start"]["character"] == len(line[: line.index("vlaue")].encode())


@pytest.mark.parametrize(("encoding", "units"), [("utf-8", 4), ("utf-16", 2), ("utf-32", 1)])
def test_a_character_has_the_width_of_its_encoding(encoding: str, units: int) -> None:
    span = Span(Source("a.yaml", ("\U0001f525 a",)), 1, 3)
    found = range_of(span, encoding)
    assert (found.start.character, found.end.character) == (units + 1, units + 2)
    assert column_of("\U0001f525 a", found.start, encoding) == 2


def test_hover_tells_unit_value_meaning_and_who_reads_it(talk: Talk, heater: Path) -> None:
    told = hover(talk, heater, where(HEATER, "T_room > T_on", 10))
    assert told.startswith("**T_on** - parameter")
    assert "below this it heats" in told and "- value: `18 degC`" in told
    assert "`modes.idle.transitions.heating.when`, `modes.heating.transitions.idle.when`" in told
    assert "- value: `500` in SI" in hover(talk, heater, where(HEATER, "P_low"))
    assert "how long the guard must hold" in hover(talk, heater, where(HEATER, "wait:", 1))
    assert hover(talk, heater, where(HEATER, "heating:")).startswith("**heating** - mode")
    assert hover(talk, heater, (1, 11)) == ""


@pytest.mark.parametrize(
    ("text", "some", "never"),
    [
        ("|", ["language", "automaton", "study"], ["modes"]),
        ("language: 1\nautomaton: a\npa|", ["parameters", "modes"], ["automaton", "kalman"]),
        (HEATER.replace("wait: 50 ms", "p|"), ["priority", "wait", "reset"], ["when", "number"]),
        (HEATER.replace("T_room < T_on, wait: 50 ms}}", "|"), ["T_room", "P", "abs"], ["idle"]),
        (HEATER.replace("{heating: {when: T_room < T_on, wait: 50 ms}}", "{h|"), ["heating"], []),
        (HEATER.replace("initial: idle", "initial: |"), ["idle", "heating"], ["P"]),
        (HEATER.replace("entry: {P: 0 W}", "entry: {|"), ["P"], ["T_room", "T_on"]),
        (HEATER.replace("unit: degC", "unit: |"), ["degC", "N*m", "ms"], ["T_room"]),
        (HEATER.replace("2 kW", "2 |"), ["kW", "W"], ["P_on"]),
        (HEATER.replace("numbers: float64", "numbers: f|"), ["float64", "float32"], ["P"]),
        (
            HEATER.replace("  heating:\n", "  heating:\n    en|\n"),
            ["update"],
            ["transitions", "to"],
        ),
        ("language: 1\nsystem: s\ninstances: {h: {of: heat|", ["heater_on_disk"], ["plot"]),
        (
            "language: 1\nsystem: s\ninstances: {h: {of: heater_on_disk}}\nconnections: {h.|",
            ["h.T_room"],
            ["h.P", "h.T_on"],
        ),
        (
            "language: 1\nsystem: s\ninstances: {h: {of: heater_on_disk}}\noutputs: {p: 2 * h|}\n",
            ["h.P"],
            [],
        ),
    ],
)
def test_what_fits_at_a_place_is_offered(
    talk: Talk, heater: Path, text: str, some: list[str], never: list[str]
) -> None:
    beside = heater.with_name("heater_on_disk.yaml")
    beside.write_text(HEATER.replace("automaton: heater", "automaton: heater_on_disk"))
    found = labels(talk, heater, text)
    assert set(some) <= set(found)
    assert not set(never) & set(found)
    assert len(found) == len(set(found))


@pytest.fixture
def driveline(talk: Talk, tmp_path: Path) -> Path:
    shutil.copytree(ROOT / "spec" / "ev_driveline", tmp_path / "spec")
    path = tmp_path / "spec" / "plant.yaml"
    assert talk.open(path, path.read_text()) == []
    return path


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


def test_a_text_is_laid_out(talk: Talk, heater: Path) -> None:
    talk.change(heater, HEATER.replace("{P: 0 W}", "{  P: 0 W }"))
    asked = {**talk.at(heater, 1, 0), "options": {"tabSize": 2, "insertSpaces": True}}
    (edit,) = talk.ask("textDocument/formatting", asked)
    assert edit["newText"] == HEATER
    talk.change(heater, HEATER)
    assert talk.ask("textDocument/formatting", asked) == []


def test_a_test_is_helped_with_the_names_of_what_it_tests(
    talk: Talk, heater: Path, tmp_path: Path
) -> None:
    path = tmp_path / "spec" / "test_warm.yaml"
    scenario = "{of: heater, horizon: 1 s, inputs: {T_room: 15 degC}}"
    text = f"language: 1\ntest: warm\nscenario: {scenario}\nexpect:\n  so: {{always: P < 3 kW}}\n"
    path.write_text(text)
    assert talk.open(path, text) == []
    (told,) = talk.change(path, text.replace("3 kW", "3 kg"))
    assert "`<` joins" in told["message"] and told["range"]["start"]["line"] == 4
    talk.change(path, text)
    assert "W" in hover(talk, path, where(text, "P < 3"))
    offered = labels(talk, path, text.replace("P < 3", "| < 3"))
    assert {"P", "T_room"} <= set(offered)
    assert {"every", "values"} <= set(labels(talk, path, text + "|"))


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


@pytest.mark.parametrize("seed", range(2))
def test_no_text_makes_the_server_fail(seed: int) -> None:
    chance = random.Random(seed)
    files = sorted((ROOT / "spec").rglob("*.yaml"))
    world = World(ROOT)
    for _ in range(12):
        path = chance.choice(files)
        text = path.read_text("utf-8")
        if chance.random() < 0.8:
            k = chance.randrange(len(text))
            text = text[:k] + chance.choice(("", "{", ": ", "'", "\n- ", "\u00e9")) + text[k + 2 :]
        world.open(path, text)
        lines = text.split("\n")
        line = chance.randrange(len(lines))
        position = types.Position(line, chance.randint(0, len(lines[line])))
        assert len(complete(world, path, text, position)) >= 0
        hover_at(world, path, position)
        definition(world, path, position)
        world.open(path, None)
