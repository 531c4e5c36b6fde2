"""What `modewright sweep` cannot do is told before any work, and nothing is lost."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from modewright.api import studies
from modewright.cli.app import app
from modewright.cli.commands.sweep import PLOTS
from modewright.cli.common.exit_codes import run_with_exit_code
from modewright.runtime.output_files import RESULT_NAMES, STUDY_FOLDER_NAMES, OutputError
from sweep.store.manifest import MANIFEST_NAME, seal_of
from sweep.store.store import BLOCKS_FOLDER, LOCK_NAME
from tests.sweep.example_studies import STUDIES, quick_results


@pytest.fixture(autouse=True)
def _quick_in_a_copy_of_the_project(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    shutil.copytree(STUDIES / "spec", tmp_path / "spec")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(studies, "run_block", quick_results)


def run(*arguments: str) -> int:
    return run_with_exit_code(lambda: app(["sweep", *arguments], standalone_mode=False))


def ran(*arguments: str) -> int:
    return run(*arguments, *([] if "--summary" in arguments else ["-j", "1"]))


def everything() -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}


def test_outputs_replace_neither_specs_nor_results_nor_each_other(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert ran("alone", "--out", "o") == 0
    Path("link").symlink_to("o/study.json")
    before = everything()
    for outputs, told in (
        (("--csv", "spec/study_grid.yaml"), "this is a spec"),
        (("--csv", "o/study.json"), "a part of the results"),
        (("--csv", "link"), "a part of the results"),
        (("--report", "o/blocks/x.parquet"), "a part of the results"),
        (("--csv", "both", "--report", "spec/../both"), "the name of two outputs"),
        (("--csv", "spec"), "this is a folder"),
        (("--csv", "nowhere/x.csv"), "there is no folder nowhere"),
    ):
        assert ran("--summary", "o", *outputs) == 1
        assert told in capsys.readouterr().err
        assert ran("alone", "--out", "p", *outputs) == 1
        assert everything() == before
    assert ran("--summary", "o", "--csv", "o/plots/matters.svg") == 1
    assert ran("alone", "--out", "p", "--csv", "p/study.json") == 1
    assert run_with_exit_code(lambda: app(["sensitivity", "o", "--csv", "o/study.json"])) == 1
    assert "a part of the results" in capsys.readouterr().err
    assert everything() == before


def test_an_output_may_lie_in_the_folder_that_the_run_makes() -> None:
    assert ran("alone", "--out", "o", "--csv", "o/summary.csv") == 0
    assert Path("o/summary.csv").exists()
    assert ran("alone", "--out", "o", "--csv", "o/summary.csv") == 0


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--samples", "10000000"), "would have 150000000 variants; at most 10000000"),
        (("--samples", "10000001"), "10000001 samples are not from 1 to 10000000"),
        (("--seed", str(2**31)), "seed 2147483648 is not from 0 to 2147483647"),
        (("--seed", str(10**30)), "is not from 0 to 2147483647"),
    ],
)
def test_samples_and_seed_have_the_limits_of_the_file(
    options: tuple[str, ...], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert ran("grid", "--out", "o", *options) == 2
    assert told in " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert not Path("o").exists()


def test_blocks_of_no_variants_are_wrong_use_of_the_api() -> None:
    with pytest.raises(ValueError, match="`block` is at least 0, not -5"):
        studies.sweep("alone", "o", block=-5)
    assert not Path("o").exists()


@pytest.mark.long
def test_warnings_of_a_study_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    path = Path("spec/study_grid.yaml")
    path.write_text(path.read_text().replace("{random: 4, seed: 3}", "{sobol: 3}"))
    assert ran("grid", "--out", "o") == 0
    told = capsys.readouterr().err
    assert "study_grid.yaml:11:19: warning: 3 is no power of 2" in told
    assert told.count("warning") == 1
    path.write_text(path.read_text().replace("{sobol: 3}", "{sobol: 4}"))
    assert ran("grid", "--out", "p", "--samples", "5") == 0
    assert "warning: 5 is no power of 2" in capsys.readouterr().err
    with pytest.warns(UserWarning, match="6 is no power of 2"):
        studies.sweep("grid", "q", samples=6, workers=1)


def test_pictures_that_cannot_be_written_are_told_beside_the_summary(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As on a disk that can only be read."""
    assert ran("alone", "--out", "o") == 0
    shutil.rmtree("o/plots")
    Path("o/plots").write_text("no folder")
    capsys.readouterr()
    assert ran("--summary", "o") == 0
    told = capsys.readouterr()
    assert "alone: 5 of 5 variants: 5 done" in told.out
    assert "warning: the pictures are not written: o/plots: this is a file" in told.err

    def full(*files: object) -> None:
        raise OutputError("summary.csv: No space left on device")

    monkeypatch.setattr("modewright.cli.commands.sweep.write_files", full)
    assert ran("--summary", "o", "--csv", "summary.csv") == 1
    told = capsys.readouterr()
    assert "alone: 5 of 5 variants: 5 done" in told.out
    assert "error: summary.csv: No space left" in told.err


def test_names_of_a_store_reach_the_terminal_harmless(capsys: pytest.CaptureFixture[str]) -> None:
    assert ran("alone", "--out", "o") == 0
    path = Path("o") / MANIFEST_NAME
    data = json.loads(path.read_text())
    data["study"] = "\x1b[2Jevil"
    data["seal"] = seal_of(data)
    path.write_text(json.dumps(data))
    assert ran("--summary", "o") == 1
    told = capsys.readouterr()
    assert "\x1b" not in told.out + told.err
    assert "`study` is \\x1b[2Jevil, no text" in told.err


def test_what_results_are_called_here_is_what_a_store_calls_them() -> None:
    assert RESULT_NAMES == (MANIFEST_NAME, BLOCKS_FOLDER)
    assert {PLOTS, LOCK_NAME} == set(STUDY_FOLDER_NAMES) - set(RESULT_NAMES)
