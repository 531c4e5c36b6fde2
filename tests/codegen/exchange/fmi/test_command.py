"""The command fmu: it writes what the API returns, and says so."""

from __future__ import annotations

import zipfile
from functools import partial
from pathlib import Path

import pytest

import modewright as mw
from codegen.exchange.fmi.archive import binary_path
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code


def told(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    """Return exit code, output and messages of a command."""
    code = run_with_exit_code(partial(app, list(words), standalone_mode=False))
    heard = capsys.readouterr()
    return code, heard.out, heard.err


def test_the_command_writes_an_fmu_and_tells_where(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert told(capsys, "fmu", "contactor")[:2] == (0, "wrote contactor.fmu\n")
    names = zipfile.ZipFile("contactor.fmu").namelist()
    assert binary_path("contactor", 3) in names
    words = ("fmu", "contactor", "--version", "2", "--source-only", "--out", "c2.fmu")
    assert told(capsys, *words)[:2] == (0, "wrote c2.fmu\n")
    assert (tmp_path / "c2.fmu").read_bytes() == mw.fmu("contactor", 2, is_source_only=True)


def test_values_are_laid_over_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ("fmu", "supervisor", "--source-only", "--set", "T_creep=12 N*m")
    assert told(capsys, *words)[0] == 0
    text = zipfile.ZipFile("supervisor.fmu").read("modelDescription.xml").decode()
    assert 'max="50.0" start="12.0"' in text


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("contactor", "--version", "1"), 2, "--version"),
        (("contactor", "--out", "nowhere/x.fmu"), 1, "there is no folder nowhere"),
        (("contactro",), 1, "contactro"),
    ],
)
def test_what_cannot_be_packed_leaves_no_file(
    words: tuple[str, ...],
    code: int,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    found = told(capsys, "fmu", *words)
    assert found[0] == code
    assert message in found[2]
    assert list(tmp_path.iterdir()) == []
