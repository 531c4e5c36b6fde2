"""What an earlier diagnosis left in a folder goes; what a user put there stays."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

import modewright as mw
from diagnosis.report.stale_files import find_stale_files
from tests.diagnosis.rotor_project import COMMAND, run_command, write_project

VERDICT = '{"format": "modewright-verdict/1", "verdict": "effect"}'
OURS = {
    "scenario.yaml": "scenario: a_window\nof: variant.yaml\nrecording:\n  file: window.csv\n",
    "window.csv": "t_s,T,w,w_without,w_with\n",
    "thresholds.json": '{"format": "modewright-thresholds/1"}',
    "unknown_1_at_w.yaml": "effect: unknown_1_at_w\n",
    "places.svg": "<svg/>",
    "window_held_out.png": "",
}
THEIRS = {
    "scenario.yaml": "scenario: mine\nof: plant\n",
    "window.csv": "t_s,T\n",
    "thresholds.json": "{}",
    "unknown_road_at_w.yaml": "effect: other\n",
    "drive.svg": "<svg/>",
}


def filled(folder: Path, files: dict[str, str]) -> Path:
    for name, text in files.items():
        (folder / name).write_text(text, "utf-8")
    return folder


def test_what_is_ours_is_told_from_what_is_a_users(tmp_path: Path) -> None:
    filled(tmp_path, OURS)
    assert find_stale_files(tmp_path) == []  # no verdict was written here
    filled(tmp_path, {"verdict.json": VERDICT})
    assert {path.name for path in find_stale_files(tmp_path)} == set(OURS)
    for name in OURS:
        (tmp_path / name).unlink()
    filled(tmp_path, THEIRS)
    assert find_stale_files(tmp_path) == []


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = write_project(tmp_path_factory.mktemp("leftover") / "project")
    still = "\n".join(f"{k / 100:.2f},3,1" for k in range(500))
    (made / "still.csv").write_text(f"t_s,torque,speed\n{still}\n", "utf-8")
    shutil.copy(made / "run_0.csv", made / "copy.csv")
    return made


def test_a_report_has_no_files_of_an_earlier_verdict_beside_it(project: Path) -> None:
    out = project / "again"
    out.mkdir()
    filled(out, {**OURS, "verdict.json": VERDICT, "notes.txt": "mine"})
    assert (
        run_command(project, "diagnose", "spinner", "--train", "still.csv", "--out", "again") == 0
    )
    assert json.loads((out / "verdict.json").read_text())["verdict"] == "unknown"
    kept = {path.name for path in out.iterdir()}
    assert kept == {"report.html", "variant.yaml", "verdict.json", "notes.txt"}


def test_thresholds_are_beside_the_report_though_nothing_gained(project: Path) -> None:
    text = '{"format": "modewright-thresholds/1", "usual": 45, "effects": {}, "origin": "a try"}'
    filled(project, {"none.json": text})
    words = ("--train", "still.csv", "--thresholds", "none.json", "--out", "none")
    assert run_command(project, "diagnose", "spinner", *words) == 0
    assert json.loads((project / "none" / "thresholds.json").read_text())["origin"] == "a try"


def _stages_is_a_file(folder: Path) -> None:
    folder.mkdir()
    (folder / "stages").write_text("mine", "utf-8")


def _link_to_nothing(folder: Path) -> None:
    folder.symlink_to("nowhere")


def _a_file(folder: Path) -> None:
    folder.write_text("mine", "utf-8")


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (_stages_is_a_file, "out/stages: this is a file"),
        (_link_to_nothing, "out: this is a link to what is not there"),
        (_a_file, "out: this is a file; name a folder"),
    ],
)
def test_a_folder_that_cannot_be_used_is_told_before_any_work(
    make: Callable[[Path], None],
    told: str,
    project: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    make(tmp_path / "out")
    assert run_command(project, *COMMAND, "--out", str(tmp_path / "out")) == 1
    error = capsys.readouterr().err
    assert told in error
    assert "looked at" not in error


def test_an_empty_name_is_no_folder(project: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = set(os.listdir(project))
    assert run_command(project, *COMMAND, "--out", "") == 2
    assert "name a folder" in capsys.readouterr().err
    assert set(os.listdir(project)) == before


def test_a_copy_is_no_other_recording(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(project)
    with pytest.raises(ValueError, match=r"copy.csv, a copy of run_0.csv, is named twice"):
        mw.diagnose("spinner", ["run_0.csv", "copy.csv"])


def test_a_copy_that_is_held_out_is_found_when_it_is_opened(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(project)
    held_out = ["copy.csv@5..9", "run_2.csv"]
    verdict = mw.diagnose("spinner", ["run_0.csv@0..6"], held_out, effects="library").verdict
    told = "copy.csv@5..9 was held out and cannot be used: it is a copy of run_0.csv@0..6"
    assert told in verdict.messages
    assert verdict.fit["held_out"]


def test_thresholds_nested_too_deeply_are_told(
    project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    filled(project, {"deep.json": 100_000 * "["})
    assert run_command(project, *COMMAND, "--thresholds", "deep.json", "--out", "deep") == 1
    assert "cannot be read as thresholds" in " ".join(capsys.readouterr().err.split())
