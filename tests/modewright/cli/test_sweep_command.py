"""`modewright sweep` as a user meets it: results, interruptions, refusals."""

from __future__ import annotations

import errno
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from engine.batch.batch import Batch, BatchResult
from modewright.api import studies
from modewright.cli.app import app
from modewright.cli.common.console import progress_bar
from modewright.cli.common.exit_codes import run_with_exit_code
from sweep.execution.dask_error import ClusterError
from sweep.store import store as store_module
from sweep.store.store import read_store
from tests.sweep.example_studies import STUDIES, quick_results


@pytest.fixture(autouse=True)
def _quick_in_the_project(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(STUDIES)
    monkeypatch.setattr(studies, "run_block", quick_results)


def run(*arguments: str) -> int:
    one = [] if "--summary" in arguments else ["-j", "1"]
    return run_with_exit_code(lambda: app(["sweep", *arguments, *one], standalone_mode=False))


def test_a_study_is_run_summed_up_and_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, table = str(tmp_path / "out"), str(tmp_path / "summary.csv")
    assert run("alone", "--out", out, "--csv", table) == 0
    told = capsys.readouterr().out
    assert "5 variants computed" in told
    assert "alone: 5 of 5 variants: 5 done" in told
    assert [path.name for path in (tmp_path / "out" / "plots").iterdir()] == ["matters.svg"]
    assert Path(table).read_text().startswith("measure,unit,count,draws,mean,")
    assert run("alone", "--out", out) == 0
    assert "0 variants computed, 5 were there" in capsys.readouterr().out
    assert run("--summary", out, "--json", "--format", "png") == 0
    assert json.loads(capsys.readouterr().out)["counts"] == {"done": 5}
    assert (tmp_path / "out" / "plots" / "matters.png").exists()


def test_what_was_interrupted_is_kept_and_gone_on_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "out")
    batches = []

    def interrupted(batch: Batch) -> BatchResult:
        batches.append(batch)
        if len(batches) == 6:
            raise KeyboardInterrupt
        return quick_results(batch)

    monkeypatch.setattr(studies, "run_block", interrupted)
    assert run("grid", "--out", out, "--block", "4") == 130
    assert "20 of 60 variants are kept" in capsys.readouterr().err
    monkeypatch.setattr(studies, "study_pictures", lambda folder: {})
    assert run("grid", "--out", out) == 0
    assert "40 variants computed, 20 were there" in capsys.readouterr().out


def test_a_full_disk_says_what_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The message when a write fails; the write is in tests/sweep/execution/test_study_run.py."""
    write = store_module.write_atomically

    def filling(path: Path, data: bytes) -> None:
        if path.name.startswith("0000000012"):
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        write(path, data)

    out = str(tmp_path / "out")
    monkeypatch.setattr(store_module, "write_atomically", filling)
    assert run("grid", "--out", out, "--block", "4") == 1
    told = capsys.readouterr().err
    assert "No space left on device; 12 of 60 variants are kept" in told
    assert len(read_store(tmp_path / "out").paths()) == 3


def test_values_of_the_command_line_belong_to_the_results(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "out")
    assert run("alone", "--out", out, "--set", "x_0=2 m") == 0
    assert run("alone", "--out", out) == 1
    assert "system of variant `base`" in capsys.readouterr().err
    assert run("alone", "--out", out, "--set", "x_0=2 m") == 0
    assert read_store(tmp_path / "out").manifest.count == 5
    assert run("alone", "--out", str(tmp_path / "other"), "--set", "x_9=2 m") == 1
    assert "`x_0`" in capsys.readouterr().err
    assert not (tmp_path / "other").exists()


def turned_bit(path: Path) -> bytes:
    """The last bit of the last page of the last column turned: only the digest shows that."""
    import pyarrow.parquet

    group = pyarrow.parquet.read_metadata(path).row_group(0)
    column = group.column(group.num_columns - 1)
    begin = column.dictionary_page_offset or column.data_page_offset
    data = bytearray(path.read_bytes())
    data[begin + column.total_compressed_size - 1] ^= 1
    return bytes(data)


def cut_off(path: Path) -> bytes:
    """As of a disk that lost the end."""
    return path.read_bytes()[:-100]


def test_a_value_for_what_the_study_varies_is_refused_with_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "out")
    for value, told in (
        ("d=0.3 1/s", "`d` varies in this study"),
        ("x_0=2 m", "`x_0` follows from `set` in this study"),
    ):
        assert run("grid", "--out", out, "--set", value) == 2
        assert told in " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert not (tmp_path / "out").exists()
    assert run("alone", "--out", out, "--set", "w=2.5 rad/s") == 0  # that of all others


@pytest.mark.parametrize("damage", [turned_bit, cut_off])
def test_a_damaged_block_is_told_and_computed_again(
    damage: Callable[[Path], bytes], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "out")
    assert run("alone", "--out", out, "--block", "2") == 0
    path = read_store(tmp_path / "out").paths()[1]
    good = path.read_bytes()
    path.write_bytes(damage(path))
    capsys.readouterr()
    assert run("--summary", out) == 1
    told = capsys.readouterr().err
    assert f"{path}:1:1: error: this block is damaged: its bytes" in told
    assert "[MW704]" in told and "computes them again: the same command" in told
    assert run("alone", "--out", out) == 0
    again = capsys.readouterr()
    assert f"warning: {path} is damaged: its variants are computed again" in again.err
    assert "2 variants computed, 3 were there" in again.out
    assert path.read_bytes() == good


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ((), 2),
        (("grid",), 2),
        (("grid", "--summary", "x"), 2),
        (("grid", "--out", "x", "--format", "bmp"), 2),
        (("--summary", "nothing_there"), 1),
        (("--summary", "x", "--out", "y"), 2),
        (("--summary", "x", "--set", "w=2 rad/s"), 2),
        (("--summary", "x", "--workers", "0"), 2),
        (("--summary", "x", "--block", "3"), 2),
        (("--summary", "x", "--cluster", "local:2"), 2),
        (("--summary", "x", "--seed", "0"), 2),
        (("grid", "--out", "x", "--set", "w=2 rad/s"), 2),
        (("swing", "--out", "x"), 1),
    ],
)
def test_wrong_usage_is_told(arguments: tuple[str, ...], code: int, tmp_path: Path) -> None:
    assert run(*arguments) == code
    assert not Path("x").exists()


def test_samples_and_seed_of_the_command_line_replace_those_of_the_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(studies, "study_pictures", lambda folder: {})
    out = str(tmp_path / "out")
    assert run("grid", "--out", out, "--samples", "1", "--seed", "9") == 0
    assert "15 variants computed" in capsys.readouterr().out
    assert run("grid", "--out", out, "--samples", "1") == 1
    assert "sampling changed" in capsys.readouterr().err
    assert run("alone", "--out", str(tmp_path / "other"), "--seed", "9") == 2


def test_progress_has_a_rate_on_a_terminal_and_nothing_elsewhere(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with progress_bar("sweep", "variants") as tell:
        tell(3, 0, 10)
    assert capsys.readouterr().err == ""
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with progress_bar("sweep", "variants") as tell:
        tell(2, 2, 10)
        tell(5, 2, 10)
    shown = capsys.readouterr().err
    assert "5/10" in shown and "variants/s" in shown


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (("--cluster", "here"), 2, "is no cluster"),
        (("--cluster", "local:2", "-j", "2"), 2, "says itself how many"),
        (("--tls-ca", "ca.pem"), 2, "are for a cluster"),
        (("--cluster", "tcp://localhost:1", "--tls-ca", "ca.pem"), 2, "are for tls"),
        (("--cluster", "tls://localhost:1", "--tls-ca", "ca.pem"), 1, "ca.pem: there is no such"),
        (("--cluster", "tls://localhost:1"), 1, "TLS takes an authority"),
    ],
)
def test_a_cluster_that_cannot_be_is_told_and_nothing_is_stored(
    arguments: tuple[str, ...], code: int, told: str, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    out = tmp_path / "out"
    given = ["sweep", "alone", "--out", str(out), *arguments]
    assert run_with_exit_code(lambda: app(given, standalone_mode=False)) == code
    assert told in " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert not out.exists()


def test_a_connection_that_others_can_read_is_warned_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*arguments: object) -> None:
        raise ClusterError("nobody answers")

    monkeypatch.setattr(studies, "_cluster_executor", refuse)
    for cluster, is_open in (("tcp://head:8786", True), ("tcp://127.0.0.1:8786", False)):
        given = ["sweep", "alone", "--out", str(tmp_path / "out"), "--cluster", cluster]
        assert run_with_exit_code(lambda: app(given, standalone_mode=False)) == 1  # noqa: B023
        told = capsys.readouterr().err
        assert ("is not encrypted" in told) == is_open
        assert "error: nobody answers" in told
