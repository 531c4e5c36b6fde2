"""Mention: what a name of one spec stands for in others of its project."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from language.text.diagnostic import MissingToolError
from modewright.cli.commands.lsp import lsp
from modewright.lsp.reference import references_to
from modewright.lsp.symbol_table import load_symbol_table
from modewright.lsp.workspace import Workspace

SPECS = {
    "contactor": """\
language: 1
automaton: contactor
period: 1 ms
numbers: float64
parameters: {t_close: {value: 20 ms}}
inputs: {command: {type: bool}}
modes:
  open: {number: 0, transitions: {closed: {when: command, wait: t_close}}}
  closed: {number: 1, transitions: {open: {when: not command}}}
initial: open
outputs: [mode]
""",
    "pack": """\
language: 1
automaton: pack
period: 1 ms
numbers: float64
inputs: {command: {type: bool}}
instances: {main: {of: contactor, inputs: {command: command}, values: {t_close: 30 ms}}}
modes: {waiting: {transitions: {ready: {when: main.closed}}}, ready: {}}
initial: waiting
outputs: [mode]
""",
    "closing": """\
language: 1
test: closing
scenario: {of: pair, horizon: 1 s}
expect:
  first: {modes: [open, closed], of: right}
  late: {that: right.mode == closed, at: end}
""",
    "pair": """\
language: 1
system: pair
instances: {right: {of: contactor}}
connections: {right.command: "true"}
""",
    "slow": """\
language: 1
variant: slow
extends: contactor
parameters: {t_close: {value: 50 ms}}
modes: {closed: {transitions: {open: {wait: t_close}}}}
""",
    "measured": """\
language: 1
calibration: measured
of: contactor
parameters: {t_close: 21 ms}
""",
}


@pytest.mark.parametrize(
    ("group", "name", "places"),
    [
        ("value", "t_close", {"contactor": 2, "pack": 1, "slow": 2, "measured": 1}),
        ("value", "command", {"contactor": 3, "pack": 1, "pair": 1}),
        ("mode", "closed", {"contactor": 2, "pack": 1, "closing": 2, "slow": 1}),
        ("mode", "open", {"contactor": 3, "closing": 1, "slow": 1}),
        ("spec", "contactor", {"contactor": 1, "pack": 1, "pair": 1, "slow": 1, "measured": 1}),
    ],
)
def test_a_name_is_followed_through_instances_variants_and_calibrations(
    tmp_path: Path, group: str, name: str, places: dict[str, int]
) -> None:
    (tmp_path / "spec").mkdir()
    for file, text in SPECS.items():
        (tmp_path / "spec" / f"{file}.yaml").write_text(text)
    world = Workspace(tmp_path)
    space = load_symbol_table(world, tmp_path / "spec" / "contactor.yaml")
    assert space
    found: dict[str, int] = {}
    for mention in references_to(world, space.names[group, name]):
        file = Path(mention.span.source.name).stem
        found[file] = found.get(file, 0) + 1
    assert found == places


def test_what_the_server_needs_is_told_where_it_is_absent(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "modewright.lsp.server", raising=False)
    monkeypatch.setitem(sys.modules, "pygls", None)
    monkeypatch.setitem(sys.modules, "pygls.exceptions", None)
    with pytest.raises(MissingToolError, match=r"pip install 'modewright\[lsp\]'"):
        lsp()


def test_a_loop_of_links_is_no_document_of_the_project(tmp_path: Path) -> None:
    (tmp_path / "spec").mkdir()
    (tmp_path / "spec" / "here.yaml").write_text("language: 1\nautomaton: here\n")
    (tmp_path / "spec" / "loop.yaml").symlink_to("back.yaml")
    (tmp_path / "spec" / "back.yaml").symlink_to("loop.yaml")
    found = [path.name for path, _ in Workspace(tmp_path).documents()]
    assert found == ["here.yaml"]
