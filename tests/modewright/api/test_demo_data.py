"""The recordings in the wheel: who wrote them, their size, what is found in them."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest

import modewright as mw
from modewright.api.demo_data import MACHINES, demo_files, write_demo_data
from modewright.cli.app import app, expand_arguments
from modewright.cli.common.exit_codes import run_with_exit_code
from modewright.render.demo_diagnosis import repeat_command
from tests.generators.open_cases.demo_cases import demo_files as generated_files

MAX_BYTES = 300_000


def run(*arguments: str) -> int:
    return run_with_exit_code(lambda: app(expand_arguments(arguments), standalone_mode=False))


def test_the_generator_writes_the_recordings_that_are_shipped() -> None:
    shipped, generated = demo_files(), generated_files()
    assert {name: shipped[name].decode() for name in generated} == generated
    others = shipped.keys() - generated.keys()
    assert others == {"README.md", "recordings/leaf_tip_out/drive_twin.csv"}


def test_all_of_it_is_small() -> None:
    assert sum(map(len, demo_files().values())) < MAX_BYTES


def test_the_command_writes_what_the_table_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("demo", "recordings", "--out", str(tmp_path / "demo")) == 0
    assert str(tmp_path / "demo" / "recordings") in capsys.readouterr().out
    for machine in MACHINES.values():
        files = [tmp_path / "demo" / one for one in (*machine.train, machine.held_out)]
        assert all(file.is_file() for file in files)
        assert mw.check(machine.spec, root=tmp_path / "demo") == []
        checked = mw.check_recordings(files, None, machine.spec, root=tmp_path / "demo")
        assert checked.check.is_usable


@pytest.mark.parametrize("name", ["README.md", "recordings/friction/train_1.csv"])
@pytest.mark.parametrize("kind", ["file", "folder", "link"])
def test_a_file_of_the_user_is_kept_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, kind: str
) -> None:
    place = tmp_path / name
    place.parent.mkdir(parents=True, exist_ok=True)
    if kind == "file":
        place.write_text("my notes\n", "ascii")
    elif kind == "folder":
        place.mkdir()
    else:
        place.symlink_to(tmp_path / "nowhere")
    before = sorted(tmp_path.rglob("*"))
    for command in ("recordings", "diagnose"):
        assert run("demo", command, "--out", str(tmp_path)) == 1
        assert f"{place}: there is another file of this name" in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before


def test_files_are_written_again_over_themselves(tmp_path: Path) -> None:
    first = write_demo_data(tmp_path)
    assert write_demo_data(tmp_path) == first
    assert first[0].read_bytes() == demo_files()["README.md"]


def test_a_file_in_the_way_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "demo").write_text("")
    assert run("demo", "recordings", "--out", str(tmp_path / "demo")) == 1
    assert "this is a file" in capsys.readouterr().err


def test_an_option_before_the_command_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("demo", "--out", "elsewhere", "recordings") == 2
    assert "after `recordings`" in capsys.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize("name", MACHINES)
def test_the_verdict_is_the_truth_and_can_be_repeated(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "demo"
    assert run("demo", "diagnose", name, "--out", str(out), "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["format"] == "modewright-demo/1" and printed["is_right"]
    assert Path(printed["report"]).is_file()
    for signal in printed["verdict"]["fit"]["held_out"].values():
        assert signal["nrmse_after"] < signal["nrmse_before"]
    _, _, command = repeat_command(MACHINES[name], out).partition(" && ")
    monkeypatch.chdir(out)
    words = [word for text in shlex.split(command)[1:] for word in _expand(text)]
    (out / MACHINES[name].results / "verdict.json").unlink()
    assert run(*words) == 0
    again = json.loads((out / MACHINES[name].results / "verdict.json").read_text())
    assert again["effects"] == printed["verdict"]["effects"]


def _expand(word: str) -> list[str]:
    """Return the files that a pattern matches, as a shell does; other words as they are."""
    return sorted(map(str, Path().glob(word))) if "*" in word else [word]
