"""The documents say what is true: specs in them are read, commands in them exist."""

from __future__ import annotations

import re
import shlex
import subprocess
import tomllib
from functools import partial
from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

import modewright as mw
from codegen.toolchain.compiler import compile_program
from modewright.cli.app import COMMANDS, app
from modewright.cli.common.exit_codes import run_with_exit_code

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()


def test_the_spec_in_the_readme_has_15_lines_and_no_problem(tmp_path: Path) -> None:
    text = re.findall(r"```yaml \S+\n(.*?)```", README, re.DOTALL)[0]
    spec = tmp_path / "readme.yaml"
    spec.write_text(text)
    assert len(text.splitlines()) == 15
    assert mw.check(str(spec)) == []


def test_the_study_on_its_page_has_no_problem(tmp_path: Path) -> None:
    text = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs/studies.md").read_text(), re.DOTALL)[0]
    spec = tmp_path / "study.yaml"
    spec.write_text(text)
    assert mw.check(str(spec)) == []


def test_the_test_on_its_page_has_no_problem(tmp_path: Path) -> None:
    text = re.findall(r"```yaml\n(.*?)```", (ROOT / "docs/testing.md").read_text(), re.DOTALL)[0]
    spec = tmp_path / "test.yaml"
    spec.write_text(text)
    assert mw.check(str(spec)) == []


def test_the_excerpts_on_the_language_page_have_no_unknown_key(tmp_path: Path) -> None:
    """Names that an excerpt leaves out are missing in it; whole files have no problem at all."""
    page = (ROOT / "docs" / "language.md").read_text()
    found: dict[str, set[str]] = {}
    for text in re.findall(r"```yaml\n(.*?)```", page, re.DOTALL):
        is_named = re.match(r"(language|system|scenario|variant|map|effect|calibration): ", text)
        head = "" if text.startswith("language") else "language: 1\n"
        head += "" if is_named else "automaton: a\nperiod: 1 ms\nnumbers: float64\n"
        spec = tmp_path / "spec.yaml"
        spec.write_text(head + re.sub(r"^(period|numbers): .*\n", "", text, flags=re.M))
        found[text.partition("\n")[0]] = {problem.kind for problem in mw.check(str(spec))}
    assert not {kind for kinds in found.values() for kind in kinds} - {"name", "missing", "run"}
    whole = ("system: ", "variant: drive", "map: ", "effect: ", "calibration: ")
    assert not set().union(*(found[first] for first in found if first.startswith(whole)))


def test_the_citation_has_the_version_and_the_licence_of_the_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    for key in ("version", "license"):
        assert str(citation[key]) == project[key]
    assert citation["title"] == project["name"] and citation["authors"] and citation["message"]


def test_every_command_has_a_row_on_its_page() -> None:
    page = (ROOT / "docs" / "commands.md").read_text()
    named = set(re.findall(r"`modewright (\w+)", page))
    own = {command.__name__ for command in COMMANDS} | {"recording", "calibration", "demo"}
    assert named == own
    for name in named:
        assert CliRunner().invoke(app, [name, "--help"]).exit_code == 0


def test_every_name_of_the_walkthrough_is_in_the_code_that_it_walks_through() -> None:
    page = (ROOT / "docs" / "walkthrough.md").read_text()
    folder = ROOT / "generated" / "ev_driveline"
    files = ("estimator.c", "estimator.h", "ha_math.c")
    code = "".join((folder / file).read_text() for file in files)
    named = re.findall(r"`([A-Za-z_][\w.]*(?:->\w+)?\*?)`", page)
    assert len(named) > 30
    beside = {*files, "equations"}
    missing = [name for name in named if name.rstrip("*") not in code and name not in beside]
    assert missing == []


@pytest.mark.long
def test_what_is_shipped_is_replayed_as_the_page_on_recordings_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("modewright", "tests"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(
        r"```sh\n(.*?)```", (ROOT / "docs" / "recordings.md").read_text(), re.DOTALL
    )
    for line in block.splitlines():
        command = partial(app, shlex.split(line)[1:], standalone_mode=False)
        assert run_with_exit_code(command) == 0, line
    assert (tmp_path / "replay.png").exists()


@pytest.mark.long
def test_the_commands_and_the_python_of_the_guide_work_as_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    guide = (ROOT / "docs" / "guide.md").read_text()
    lines = [
        line
        for block in re.findall(r"```sh\n(.*?)```", guide, re.DOTALL)
        for line in block.splitlines()
    ]
    assert len(lines) > 12
    for line in lines:
        words = shlex.split(line, comments=True)
        if words[0] == "cd":
            monkeypatch.chdir(words[1])
            continue
        assert words[0] == "modewright"
        told = re.search(r"# exit code (\d+)$", line)
        expected = int(told[1]) if told else 0
        command = partial(app, words[1:], standalone_mode=False)
        assert run_with_exit_code(command) == expected, line
    for block in re.findall(r"```python\n(.*?)```", guide, re.DOTALL):
        exec(compile(block, "guide.md", "exec"), {})
    for name in re.findall(r"--(?:out|plot) ([\w./]+)", guide):
        assert Path(name).exists(), name


def test_the_program_on_the_page_on_c_compiles_and_runs(tmp_path: Path) -> None:
    (program,) = re.findall(r"```c\n(.*?)```", (ROOT / "docs" / "c_code.md").read_text(), re.DOTALL)
    files = {**mw.generate("estimator", root=ROOT), "main.c": program}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    sources = [tmp_path / name for name in files if name.endswith(".c")]
    compile_program(sources, tmp_path / "run")
    assert subprocess.run([tmp_path / "run"], timeout=60, check=False).returncode == 0


def test_the_commands_and_the_page_on_calibration_are_as_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "calibration.md").read_text()
    for block in re.findall(r"```sh\n(.*?)```", page, re.DOTALL):
        for line in block.splitlines():
            command = partial(app, shlex.split(line)[1:], standalone_mode=False)
            assert run_with_exit_code(command) == 0, line
    (told,) = re.findall(r"```\n(\d+ of \d+ solved.*?)```", page, re.DOTALL)
    assert told in capsys.readouterr().out
    written = Path("page.dcm").read_text()
    assert written == Path("resolved.dcm").read_text()
    shown = re.findall(r"^FESTWERT .*?^END$", page, re.DOTALL | re.MULTILINE)
    assert len(shown) == 2 and all(text in written for text in shown)
    assert written.count("FESTWERT ") == int(re.findall(r"writes (\d+) numbers", page)[0])
