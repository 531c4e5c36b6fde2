"""The language server: what an editor is told, asked through the real protocol."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from lsprotocol import types

from language.text.diagnostic import Source, Span
from modewright.lsp import diagnostics as problems
from modewright.lsp.completion import complete
from modewright.lsp.hover import hover as hover_at
from modewright.lsp.positions import column_of, range_of
from modewright.lsp.rename import definition
from modewright.lsp.workspace import Workspace
from tests.modewright.lsp.client import LspClient
from tests.modewright.lsp.heater import (
    HEATER,
    ROOT,
    apply_edits,
    completion_labels,
    hover,
    position_of,
)


def test_problems_are_those_of_the_editors_text(talk: LspClient, heater: Path) -> None:
    (told,) = talk.change(heater, HEATER.replace("when: T_room > T_on", "when: T_rom > T_on"))
    line, column = position_of(HEATER, "T_room > T_on")
    assert told["range"]["start"] == {"line": line - 1, "character": column}
    assert told["range"]["end"] == {"line": line - 1, "character": column + len("T_rom")}
    assert "did you mean `T_room`?" in told["message"]
    assert (told["code"], told["severity"], told["source"]) == ("MW115", 1, "modewright")
    assert talk.change(heater, HEATER) == []


def test_what_a_help_names_is_written_at_a_key_press(talk: LspClient, heater: Path) -> None:
    wrong = HEATER.replace("when: T_room > T_on", "when: T_rom > T_on")
    told = talk.change(heater, wrong)
    uri = heater.as_uri()
    asked = {"range": told[0]["range"], "context": {"diagnostics": told}}
    found = talk.request("textDocument/codeAction", {"textDocument": {"uri": uri}, **asked})
    (action,) = found
    assert action["title"] == "Write `T_room`"
    assert apply_edits(wrong, action["edit"]["changes"][uri]) == HEATER


def test_a_text_that_is_no_yaml_is_told_of(talk: LspClient, heater: Path) -> None:
    (told,) = talk.change(heater, HEATER + "regions: {a: [\n")
    assert "this is not YAML" in told["message"]


def test_a_defect_of_ours_is_told_in_the_file_that_shows_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(problems, "check_without_proofs", lambda *_: 1 // 0)
    (told,) = problems.check_quickly(Workspace(tmp_path, "utf-16"), tmp_path / "heater.yaml")
    assert told.message.startswith("a defect of modewright: ZeroDivisionError")
    assert told.severity == types.DiagnosticSeverity.Error


@pytest.mark.long
def test_what_has_to_be_proven_follows_and_stays_while_its_line_stays(
    talk: LspClient, heater: Path
) -> None:
    dead = HEATER.replace("when: T_room > T_on", "when: T_room > 100 degC")
    assert talk.change(heater, dead) == []
    told = talk.problem(heater, "MW211")
    assert "T_room > 100 degC" in dead.splitlines()[told["range"]["start"]["line"]]
    assert told in talk.change(heater, dead + "\n")
    assert told not in talk.change(heater, HEATER)


def test_a_mistake_in_a_base_is_told_in_the_variant(
    talk: LspClient, heater: Path, tmp_path: Path
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


def test_columns_are_counted_as_the_editor_asked_for(talk: LspClient, heater: Path) -> None:
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


def test_hover_tells_unit_value_meaning_and_who_reads_it(talk: LspClient, heater: Path) -> None:
    told = hover(talk, heater, position_of(HEATER, "T_room > T_on", 10))
    assert told.startswith("**T_on** - parameter")
    assert "below this it heats" in told and "- value: `18 degC`" in told
    assert "`modes.idle.transitions.heating.when`, `modes.heating.transitions.idle.when`" in told
    assert "- value: `500` in SI" in hover(talk, heater, position_of(HEATER, "P_low"))
    assert "the guard must hold" in hover(talk, heater, position_of(HEATER, "wait:", 1))
    assert hover(talk, heater, position_of(HEATER, "heating:")).startswith("**heating** - mode")
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
    talk: LspClient, heater: Path, text: str, some: list[str], never: list[str]
) -> None:
    beside = heater.with_name("heater_on_disk.yaml")
    beside.write_text(HEATER.replace("automaton: heater", "automaton: heater_on_disk"))
    found = completion_labels(talk, heater, text)
    assert set(some) <= set(found)
    assert not set(never) & set(found)
    assert len(found) == len(set(found))


def test_a_text_is_laid_out(talk: LspClient, heater: Path) -> None:
    talk.change(heater, HEATER.replace("{P: 0 W}", "{  P: 0 W }"))
    asked = {**talk.at(heater, 1, 0), "options": {"tabSize": 2, "insertSpaces": True}}
    (edit,) = talk.request("textDocument/formatting", asked)
    assert edit["newText"] == HEATER
    talk.change(heater, HEATER)
    assert talk.request("textDocument/formatting", asked) == []


def test_a_test_is_helped_with_the_names_of_what_it_tests(
    talk: LspClient, heater: Path, tmp_path: Path
) -> None:
    path = tmp_path / "spec" / "test_warm.yaml"
    scenario = "{of: heater, horizon: 1 s, inputs: {T_room: 15 degC}}"
    text = f"language: 1\ntest: warm\nscenario: {scenario}\nexpect:\n  so: {{always: P < 3 kW}}\n"
    path.write_text(text)
    assert talk.open(path, text) == []
    (told,) = talk.change(path, text.replace("3 kW", "3 kg"))
    assert "`<` joins" in told["message"] and told["range"]["start"]["line"] == 4
    talk.change(path, text)
    assert "W" in hover(talk, path, position_of(text, "P < 3"))
    offered = completion_labels(talk, path, text.replace("P < 3", "| < 3"))
    assert {"P", "T_room"} <= set(offered)
    assert {"every", "values"} <= set(completion_labels(talk, path, text + "|"))


@pytest.mark.parametrize("seed", range(2))
def test_no_text_makes_the_server_fail(seed: int) -> None:
    chance = random.Random(seed)
    files = sorted((ROOT / "spec").rglob("*.yaml"))
    world = Workspace(ROOT)
    for _ in range(12):
        path = chance.choice(files)
        text = path.read_text("utf-8")
        if chance.random() < 0.8:
            k = chance.randrange(len(text))
            text = text[:k] + chance.choice(("", "{", ": ", "'", "\n- ", "\u00e9")) + text[k + 2 :]
        world.set_text(path, text)
        lines = text.split("\n")
        line = chance.randrange(len(lines))
        position = types.Position(line, chance.randint(0, len(lines[line])))
        assert len(complete(world, path, text, position)) >= 0
        hover_at(world, path, position)
        definition(world, path, position)
        world.set_text(path, None)


def test_places_that_no_text_has_are_taken_for_its_end(talk: LspClient, heater: Path) -> None:
    for line, character in ((2**31 - 1, 0), (2**31 - 1, 2**31 - 1)):
        place = talk.at(heater, line + 1, character)
        for question in ("hover", "definition", "prepareRename"):
            assert not talk.request(f"textDocument/{question}", place)
    assert talk.request("textDocument/completion", talk.at(heater, 2**31, 0))["items"]


def test_half_a_character_is_no_end_of_the_server(talk: LspClient, heater: Path) -> None:
    talk.begin_change(heater, HEATER.replace("this it", "\ud800   it") + "\n\n")
    layout = {"tabSize": 2, "insertSpaces": True}
    asked = {"textDocument": {"uri": heater.as_uri()}, "options": layout}
    (edit,) = talk.request("textDocument/formatting", asked)
    assert "\ufffd   it" in edit["newText"]


def test_a_refused_rename_is_no_failure_of_the_server(capfd: pytest.CaptureFixture[str]) -> None:
    with LspClient() as talk:
        asked = {**talk.at(ROOT / "spec" / "absent.yaml", 1, 0), "newName": "b"}
        assert "nothing here" in talk.request_raw("textDocument/rename", asked)["error"]["message"]
    assert "Traceback" not in capfd.readouterr().err
