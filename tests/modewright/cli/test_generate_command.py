"""Command generate: all automata of a project into a folder, and which of its files are stale."""

from __future__ import annotations

from pathlib import Path

import pytest

from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code

COUNTER = """language: 1
automaton: counter
period: 10 ms
numbers: float64
discrete: {k: {type: int, initial: 0, range: [0, 9]}}
modes: {only: {update: {k: "min(k + 1, 9)"}}}
outputs: [k]
"""


@pytest.fixture(autouse=True)
def _in_a_project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "spec" / "counters").mkdir(parents=True)
    (tmp_path / "spec" / "counters" / "counter.yaml").write_text(COUNTER)


def run(*arguments: str) -> int:
    return run_with_exit_code(lambda: app(["generate", *arguments], standalone_mode=False))


def test_all_automata_are_written_below_the_folder_of_out(tmp_path: Path) -> None:
    assert run("--all", "--out", "build") == 0
    assert (tmp_path / "build" / "counters" / "counter.c").exists()
    assert not (tmp_path / "generated").exists()
    assert run("--all") == 0
    for path in (tmp_path / "build").rglob("*.[ch]"):
        other = tmp_path / "generated" / path.relative_to(tmp_path / "build")
        assert other.read_bytes() == path.read_bytes()


def test_stale_files_are_those_below_the_folder_of_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("--all", "--out", "build") == 0
    assert run("--all", "--out", "build", "--check") == 0
    (tmp_path / "build" / "counters" / "counter.c").write_text("")
    (tmp_path / "build" / "old.h").write_text("")
    capsys.readouterr()
    assert run("--all", "--out", "build", "--check") == 1
    assert capsys.readouterr().err.splitlines() == [
        "build/counters/counter.c: differs from what the specs give",
        "build/old.h: left over",
        "run `modewright generate --all --out build`",
    ]
    assert run("--all", "--check") == 1
    assert "generated/counters/counter.c: missing" in capsys.readouterr().err


@pytest.mark.parametrize(
    "arguments",
    [
        ("--all", "--set", "k=3"),
        ("--all", "--calibration", "rig"),
        ("--all", "--cmake"),
        ("counter", "--check"),
    ],
)
def test_an_option_that_would_have_no_effect_is_wrong_usage(arguments: tuple[str, ...]) -> None:
    assert run(*arguments) == 2
