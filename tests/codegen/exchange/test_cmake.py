"""A CMakeLists.txt beside generated C: CMake builds a library that gives the bits of the engine."""

from __future__ import annotations

import shutil
import subprocess
from functools import partial
from pathlib import Path

import pytest

from codegen.exchange.cmake import CMAKE_FILE, SET_BY_CMAKE, emit_cmake_file
from codegen.toolchain.compiler import FLAGS
from modewright.api.simulation import program
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code

ROOT = Path(__file__).parents[3]
USER = """
cmake_minimum_required(VERSION 3.15)
project(user LANGUAGES C)
add_subdirectory(build)
add_executable(user main.c)
target_link_libraries(user PRIVATE estimator)
"""


def test_the_flags_that_define_the_bits_are_in_it() -> None:
    text = emit_cmake_file(program("estimator"))[CMAKE_FILE]
    for flag in set(FLAGS) - set(SET_BY_CMAKE):
        assert flag in text
    assert "C_EXTENSIONS OFF" in text
    assert "  ha_math.c\n" in text
    assert "ha_math" not in emit_cmake_file(program("contactor"))[CMAKE_FILE]


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cmake") is None, reason="no cmake: make system-packages")
def test_cmake_builds_and_installs_it_and_a_project_of_a_user_takes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    words = ["generate", "estimator", "--out", "build", "--cmake"]
    assert run_with_exit_code(partial(app, words, standalone_mode=False)) == 0
    page = (ROOT / "docs" / "c_code.md").read_text()
    (tmp_path / "main.c").write_text(page.partition("```c\n")[2].partition("```")[0])
    (tmp_path / CMAKE_FILE).write_text(USER)
    _run("cmake", "-S", ".", "-B", "made", "-DCMAKE_INSTALL_PREFIX=installed")
    _run("cmake", "--build", "made", "--target", "install", "--verbose")
    assert (tmp_path / "installed" / "include" / "estimator.h").exists()
    assert list((tmp_path / "installed").rglob("libestimator.a"))
    _run("made/user")


def test_it_goes_with_one_automaton(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["generate", "--all", "--cmake"]
    assert run_with_exit_code(partial(app, words, standalone_mode=False)) == 2
    assert "not with --all" in capsys.readouterr().err


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
