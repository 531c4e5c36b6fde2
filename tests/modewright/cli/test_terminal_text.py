"""Texts of specs and names of files: no command prints what controls a terminal."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import unicodedata
from pathlib import Path

import pytest

from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code

HOSTILE = r"\e[31mred \u202e\u2066turned \x9b31m \a"
SPEC = f"""\
language: 1
automaton: NAME
about: "{HOSTILE}"
period: 10 ms
numbers: float64
inputs: {{u: {{unit: 1, range: [-5, 5], about: "in {HOSTILE}"}}}}
parameters: {{k: {{value: 1, range: [0, 2], tunable: true, about: "by {HOSTILE}"}}}}
equations: {{e: "k * u"}}
outputs: [e]
"""
CONTROLS = ("Cc", "Cf", "Cs", "Zl", "Zp")


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project with two specs whose texts have control and bidirectional characters."""
    (tmp_path / "spec").mkdir()
    for name in ("one", "two"):
        text = SPEC.replace("NAME", name).replace("in ", f"in {name} ")
        (tmp_path / "spec" / f"{name}.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments: str) -> int:
    return run_with_exit_code(lambda: app(list(arguments), standalone_mode=False))


def controls_in(text: str) -> set[str]:
    return {c for c in text if c not in "\n\t" and unicodedata.category(c) in CONTROLS}


@pytest.mark.parametrize(
    "arguments",
    [
        ("explain", "one"),
        ("explain", "one", "two"),
        *(("explain", "one", "--pass", each) for each in ("model", "lowered", "inputs", "program")),
        ("diff", "one", "two"),
        ("graph", "one"),
        ("trace", "one"),
        ("check", "one", "--github"),
    ],
)
def test_texts_of_specs_are_escaped(
    arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*arguments) == 0
    printed = capsys.readouterr()
    assert printed.out and controls_in(printed.out + printed.err) == set()


@pytest.mark.parametrize(
    "arguments",
    [
        ("check", "{}"),
        ("check", "{}", "--github"),
        ("check", "--all"),
        ("format", "{}"),
        ("explain", "no\x1b[31m"),
        ("\x1b[31m",),
        ("simulate", "one", "--\u202e"),
    ],
)
def test_names_of_files_and_arguments_are_escaped(
    project: Path, arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    path = project / "spec" / "a\x1b]0;title\x07\u202eb.yaml"
    path.write_text(SPEC.replace("NAME", "three").replace("k * u", "k * v"))
    run(*(each.format(path) for each in arguments))
    printed = capsys.readouterr()
    assert controls_in(printed.out + printed.err) == set()


@pytest.mark.parametrize(
    "command",
    [
        *(("a2l", "--out", "o.a2l"), ("dbc", "--out", "o.dbc"), ("graph", "--out", "o.svg")),
        *(("calibration export", "--out", f"o.{form}") for form in ("dcm", "cdfx", "csv")),
        ("generate", "--out", "one.c"),
    ],
)
def test_written_text_files_have_no_control_characters(
    project: Path, command: tuple[str, ...]
) -> None:
    name, option, out = command
    is_folder = name == "generate"
    assert run(*name.split(), "one", option, "." if is_folder else out) == 0
    text = (project / out).read_bytes().decode().replace("\r\n", "\n")
    assert controls_in(text) == set()


def test_a_file_with_markup_in_its_name_is_named(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "[").mkdir()
    assert run("graph", "one", "--out", "[/red].svg") == 0
    assert "wrote [/red].svg" in capsys.readouterr().out


def test_colours_of_a_terminal_stay() -> None:
    code = (
        "from modewright.cli.common.console import console\n"
        "from modewright.cli.common.exit_codes import run_with_exit_code\n"
        "run_with_exit_code(lambda: console().print('[red]\\x1btext[/]', highlight=False))\n"
    )
    environment = {**os.environ, "FORCE_COLOR": "1", "TERM": "xterm", "COLUMNS": "80"}
    environment.pop("NO_COLOR", None)
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment
    )
    assert re.fullmatch(r"\x1b\[31m\\x1btext\x1b\[0m\n", done.stdout), done


def test_the_page_of_a_difference_has_no_control_characters(project: Path) -> None:
    odd = project / "a\x1b[31m\u202eb.yaml"
    odd.write_text(SPEC.replace("NAME", "three"))
    assert run("diff", str(odd), "one", "--html", "diff.html") == 0
    text = (project / "diff.html").read_text("utf-8")
    assert controls_in(text) == set() and r"\x1b[31m\u202eb" in text
