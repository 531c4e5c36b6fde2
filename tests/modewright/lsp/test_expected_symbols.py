"""Where one sort of name is asked for, nothing else is offered; an outline shows all of a spec."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.modewright.lsp.client import LspClient
from tests.modewright.lsp.heater import completion_labels
from tests.modewright.lsp.test_instance_rename import LONE, RUN, TEST

CHART = LONE.replace(
    "faults:",
    """\
events: {go_on: {from: input}, trip: {}}
parameters: {t_far: {value: 2 s}, far: {value: 2}, t_near: {value: 0.1, unit: s}}
discrete: {why: {type: enum, values: [none, lost], initial: none}}
faults:""",
)
MODES = ["charge.idle", "charge.session", "charge.session.cc", "charge.session.cv"]
HEAT = ["heat.off_", "heat.warm"]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("word == busy", "word == |", ["idle", "busy"]),
        ("word == busy", "word != b|", ["idle", "busy"]),
        ("in(charge.session.cc)", "in(|)", MODES + HEAT),
        ("in(charge.session.cc)", "in(charge.|", MODES + HEAT),
        ("u > 3}", "u > 3, raise: |}", ["trip"]),
        ("when: u > 3}", "event: |}", ["go_on", "trip"]),
        ("u > 3}", "u > 3, wait: |}", ["t_far", "t_near"]),
        ("u > 3}", "u > 3, reset: {why: |}}", ["none", "lost"]),
        ("initial: none", "initial: |", ["none", "lost"]),
    ],
)
def test_a_chart_is_offered_what_alone_fits(
    talk: LspClient, tmp_path: Path, old: str, new: str, expected: list[str]
) -> None:
    path = tmp_path / "spec" / "lone.yaml"
    path.parent.mkdir()
    talk.open(path, CHART)
    assert old in CHART
    assert completion_labels(talk, path, CHART.replace(old, new)) == expected


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("word: idle", "word: |", ["idle", "busy"]),
        ("word: idle", "word: {start: |}", ["idle", "busy"]),
    ],
)
def test_a_scenario_is_offered_the_words_of_an_input(
    talk: LspClient, tmp_path: Path, old: str, new: str, expected: list[str]
) -> None:
    path = tmp_path / "spec" / "run.yaml"
    path.parent.mkdir()
    path.with_name("lone.yaml").write_text(LONE)
    talk.open(path, RUN)
    assert completion_labels(talk, path, RUN.replace(old, new)) == expected


@pytest.mark.parametrize(
    ("new", "expected"),
    [
        ("lone.charge == |", ["idle", "session", "session.cc", "session.cv"]),
        ("lone.heat != |", ["off_", "warm"]),
        ("fault(|)", ["sensor", "lone.sensor"]),
        ("in(|)", [*MODES, *HEAT, *(f"lone.{mode}" for mode in MODES + HEAT)]),
    ],
)
def test_a_test_is_offered_the_modes_of_a_region_and_faults(
    talk: LspClient, tmp_path: Path, new: str, expected: list[str]
) -> None:
    path = tmp_path / "spec" / "looked.yaml"
    path.parent.mkdir()
    path.with_name("lone.yaml").write_text(LONE)
    path.with_name("run.yaml").write_text(RUN)
    talk.open(path, TEST)
    text = TEST.replace("lone.charge == idle, before", f"{new}, before")
    assert sorted(completion_labels(talk, path, text)) == sorted(expected)
    listed = TEST.replace("modes: [idle]", "modes: [idle, |]")
    assert completion_labels(talk, path, listed) == ["idle", "session.cc", "session.cv"]


def test_a_dotted_name_is_replaced_as_a_whole(talk: LspClient, tmp_path: Path) -> None:
    path = tmp_path / "spec" / "lone.yaml"
    path.parent.mkdir()
    text = LONE.replace("in(charge.session.cc)", "in(charge.se)")
    talk.open(path, text)
    line = text[: text.index("in(charge.se)")].count("\n")
    start = text.split("\n")[line].index("charge.se")
    found = talk.request("textDocument/completion", talk.at(path, line + 1, start + 9))
    edits = {item["label"]: item["textEdit"] for item in found["items"]}
    assert edits["charge.session.cv"]["newText"] == "charge.session.cv"
    ends = edits["charge.session.cv"]["range"]
    assert [ends[end] for end in ("start", "end")] == [
        {"line": line, "character": start},
        {"line": line, "character": start + 9},
    ]


def shown(symbol: dict[str, Any]) -> Any:
    inner = symbol.get("children")
    return {symbol["name"]: [shown(each) for each in inner]} if inner else symbol["name"]


def test_an_outline_shows_sections_and_modes_inside_modes(talk: LspClient, tmp_path: Path) -> None:
    path = tmp_path / "spec" / "lone.yaml"
    path.parent.mkdir()
    talk.open(path, LONE)
    (whole,) = talk.request("textDocument/documentSymbol", {"textDocument": {"uri": path.as_uri()}})
    inner = [{"cc": ["cv"]}, "cv"]
    charge = {"charge": [{"idle": ["session"]}, {"session": inner}]}
    heat = {"heat": [{"off_": ["warm"]}, "warm"]}
    assert shown(whole) == {
        "lone": [
            {"faults": ["sensor"]},
            {"inputs": ["go", "u", "word"]},
            {"regions": [charge, heat]},
        ]
    }
    regions = whole["children"][2]
    lines = LONE.split("\n")
    for symbol in (whole, regions, *regions["children"], *regions["children"][0]["children"]):
        start, end = symbol["selectionRange"]["start"], symbol["selectionRange"]["end"]
        assert lines[start["line"]][start["character"] : end["character"]] == symbol["name"]
    assert (regions["range"]["start"]["line"], regions["range"]["end"]["line"]) == (9, 17)
    assert regions["children"][0]["range"]["end"]["line"] == 14
