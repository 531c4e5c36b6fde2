"""Watching: each change of a spec is seen once, whatever it is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from modewright.cli.commands import check as command
from modewright.cli.common.watch import spec_folders, watch_changes

GOOD = """language: 1
automaton: slide
states: {x: {unit: m, initial: 0 m}}
flow: {x: der(x) = 1 m/s}
outputs: [x]
"""


class Edits:
    """What happens while nobody looks: one edit at each wait, then Ctrl-C."""

    def __init__(self, *edits: Callable[[], object]) -> None:
        self.edits = list(edits)

    def __call__(self) -> None:
        if not self.edits:
            raise KeyboardInterrupt
        self.edits.pop(0)()


def test_each_change_is_seen_once(tmp_path: Path) -> None:
    first, second = tmp_path / "first.yaml", tmp_path / "deep" / "second.yaml"
    second.parent.mkdir()
    first.write_text("a")
    edits = Edits(
        lambda: None,
        lambda: first.write_text("ab"),
        lambda: None,
        lambda: second.write_text("c"),
        lambda: (tmp_path / "notes.txt").write_text("d"),
        lambda: first.unlink(),
    )
    seen = []
    with pytest.raises(KeyboardInterrupt):
        for changed in watch_changes([tmp_path], edits):
            seen.append(changed)
    assert seen == [[first], [second], [first]]


def test_the_projects_specs_and_the_folders_of_named_files_are_watched() -> None:
    assert spec_folders([]) == [Path("spec")]
    assert spec_folders(["plant", "spec/a/b.yaml"]) == [Path("spec")]
    assert spec_folders(["spec/b.yaml", "../c/d.yaml", "e.yaml"]) == [
        Path("spec"),
        Path(),
        Path("../c"),
    ]


def test_a_watched_check_tells_what_an_edit_breaks_and_mends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = tmp_path / "spec" / "slide.yaml"
    spec.parent.mkdir()
    spec.write_text(GOOD)
    monkeypatch.chdir(tmp_path)
    broken = GOOD.replace("1 m/s", "1 m")
    edits = Edits(lambda: spec.write_text(broken), lambda: spec.write_text(GOOD))
    monkeypatch.setattr("modewright.cli.common.watch.wait_for_poll", edits)
    with pytest.raises(KeyboardInterrupt):
        command.check([], every=True, watch=True)
    told = capsys.readouterr()
    lines = [line for line in told.out.splitlines() if line]
    changed = "spec/slide.yaml changed"
    assert lines == [
        "1 spec checked, 0 problems",
        changed,
        "1 spec checked, 1 problem",
        changed,
        "1 spec checked, 0 problems",
    ]
    assert told.err.count("[MW305]") == 1
