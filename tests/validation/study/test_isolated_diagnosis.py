"""The guard of an isolated diagnosis ends the process that looks at what is concealed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.validation.evidence.evidence_store import ROOT
from tests.validation.study.isolated_diagnosis import BROKEN, guard, is_concealed


@pytest.mark.parametrize(
    "path",
    [
        "/data/truth/brake.csv",
        "/data/cases_labels.json",
        "/data/LABELS/a.json",
        "/data/labels.pyc.json",
        ROOT / "tests" / "generators" / "blind_cases" / "physical_parameters.py",
        ROOT / "tests" / "generators" / "open_cases" / "__pycache__" / "label.pyc",
    ],
)
def test_what_is_concealed_is_seen(path: Path | str) -> None:
    assert is_concealed(path)


@pytest.mark.parametrize(
    "path",
    [
        ROOT / "modewright" / "label.py",
        "/venv/sklearn/__pycache__/_label.cpython-311.pyc.140383164160784",
        "/data/runs/rec_00.csv",
        ROOT / "spec" / "effects",
    ],
)
def test_what_the_product_reads_is_not(path: Path | str) -> None:
    assert not is_concealed(path)


def test_a_link_to_what_is_concealed_is_followed(tmp_path: Path) -> None:
    (tmp_path / "labels.json").write_text("{}")
    (tmp_path / "innocent").symlink_to(tmp_path / "labels.json")
    assert is_concealed(tmp_path / "innocent")


def test_only_compilers_are_started() -> None:
    ends: list[str] = []
    hook = guard(ends.append)
    hook("subprocess.Popen", ("/usr/bin/gcc-12", ["/usr/bin/gcc-12", "-O2"], None, None))
    assert not ends
    hook("subprocess.Popen", ("cat", ["cat", "x"], None, None))
    hook("os.system", (b"cat x",))
    assert len(ends) == 2


@pytest.mark.parametrize(
    "look", ["open({!r})", "__import__('os').listdir({!r})", "__import__('os').open({!r}, 0)"]
)
def test_a_look_ends_the_process(tmp_path: Path, look: str) -> None:
    concealed = tmp_path / "truth"
    concealed.mkdir()
    code = (
        "import sys; from tests.validation.study import isolated_diagnosis as isolated;"
        "sys.addaudithook(isolated.guard(isolated._end));"
        f"{look.format(str(concealed))}; print('went on')"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == BROKEN
    assert "what is concealed was opened" in done.stderr
    assert "went on" not in done.stdout
