"""Build: which compiler, what happens where there is none or it fails, nothing left behind."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest

from codegen.harness.harness import build_executable, compared_variables, tick_inputs
from codegen.harness.sanitizers import run_sanitised
from codegen.simulator.compiled_stepper import CompiledStepper
from codegen.simulator.simulator_library import build_library
from codegen.toolchain.compiler import (
    FLAGS,
    BuildError,
    compile_program,
    compiler_version,
    find_compiler,
    run_executable,
)
from codegen.toolchain.external_tools import run_tool
from language.text.diagnostic import BrokenToolError, MissingToolError
from lockstep.comparison import compare
from tests.lockstep.heater import heater, heater_tape

FAILING = """\
#!/bin/sh
echo 'engine.c:1:2: error: no more ink' >&2
exit 1
"""
SILENT = """\
#!/bin/sh
exit 3
"""


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which temporary folders are made."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


def script(path: Path, text: str) -> Path:
    path.write_text(text)
    path.chmod(0o755)
    return path


def test_cc_names_the_compiler_with_its_arguments(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "sh -c 'a b'")
    assert find_compiler() == ["sh", "-c", "a b"]


def test_without_cc_the_first_of_cc_gcc_clang_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    for name in ("clang", "gcc", "cc"):
        script(tmp_path / name, SILENT)
        assert find_compiler() == [name]


def test_a_compiler_that_is_missing_comes_with_the_line_that_installs_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("CC", "no-such-compiler -m64")
    with pytest.raises(MissingToolError) as caught:
        compare(heater_tape())
    assert str(caught.value) == (
        "the C compiler `no-such-compiler` is missing: apt-get install gcc libc6-dev"
    )


def test_no_compiler_at_all_is_missing_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(MissingToolError, match="`cc` is missing: apt-get install gcc"):
        find_compiler()


@pytest.mark.parametrize(
    ("text", "message"),
    [(FAILING, "engine.c:1:2: error: no more ink"), (SILENT, "it ended with 3")],
    ids=["with a message", "without"],
)
def test_a_compiler_that_compiles_no_program_is_broken_and_nothing_is_left_behind(
    tmp_path: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch, text: str, message: str
) -> None:
    monkeypatch.setenv("CC", str(script(tmp_path / "cc", text)))
    with pytest.raises(BrokenToolError) as caught:
        compare(heater_tape())
    assert f"cc` compiles no program: {message}" in str(caught.value)
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("false", "the C compiler `false` compiles no program: it ended with 1"),
        ("true", "the C compiler `true` ended without an error, but made no file"),
        ('"', "is no command: No closing quotation; set CC to a command like `gcc`"),
        ("gcc 'a", "is no command: No closing quotation"),
    ],
)
def test_a_command_that_is_no_compiler_is_broken(
    monkeypatch: pytest.MonkeyPatch, command: str, message: str
) -> None:
    monkeypatch.setenv("CC", command)
    with pytest.raises(BrokenToolError, match=re.escape(message)):
        compare(heater_tape())


WRITES_NO_PROGRAM = """\
#!/bin/sh
while [ $# -gt 1 ]; do [ "$1" = -o ] && { echo text > "$2"; chmod +x "$2"; }; shift; done
"""


def test_what_a_broken_compiler_writes_is_no_defect_of_the_c(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiler = script(tmp_path / "cc", WRITES_NO_PROGRAM)
    monkeypatch.setenv("CC", str(compiler))
    with pytest.raises(BrokenToolError, match=r"does not run: .*Exec format error"):
        compare(heater_tape())
    with pytest.raises(BrokenToolError, match="what the C compiler made cannot be loaded"):
        CompiledStepper(heater())


def test_a_full_disk_of_the_compiler_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "#!/bin/sh\necho 'error: cannot write: No space left on device' >&2\nexit 1\n"
    monkeypatch.setenv("CC", str(script(tmp_path / "cc", text)))
    with pytest.raises(BrokenToolError, match=r"cannot write its files: .*No space left on device"):
        compare(heater_tape())


def test_c_that_is_wrong_is_quoted_with_file_and_line(tmp_path: Path) -> None:
    source = tmp_path / "wrong.c"
    source.write_text("int main(void)\n{\n    return wrong;\n}\n")
    with pytest.raises(BuildError, match=r"wrong\.c:3:12: error: .*wrong"):
        compile_program([source], tmp_path / "program")


def test_a_compiled_program_that_fails_is_an_error(tmp_path: Path) -> None:
    target = script(tmp_path / "program", SILENT)
    with pytest.raises(BuildError, match="the compiled program ended with 3"):
        run_executable(target, b"")


HANGING = """\
#!/bin/sh
case "$*" in *--version*) echo slow; exit;; esac
exec sleep 60
"""


def compile_a_program(folder: Path) -> None:
    compile_program([folder / "any.c"], folder / "program")


def compile_a_library(folder: Path) -> None:
    sources = [folder / "one.c", folder / "two.c"]
    build_library(sources, folder / "library.so", FLAGS, None)


def step_a_program(folder: Path) -> None:
    CompiledStepper(heater(), (*FLAGS, "-DHANGING"))


def run_a_program(folder: Path) -> None:
    run_executable(folder / "cc", b"")


def run_under_sanitizers(folder: Path) -> None:
    run_sanitised(folder / "cc", timeout=0.2)


@pytest.mark.parametrize(
    "call",
    [
        compile_a_program,
        compile_a_library,
        step_a_program,
        lambda folder: run_tool([str(folder / "cc")], folder),
    ],
)
def test_a_tool_that_hangs_is_broken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Callable[[Path], object]
) -> None:
    monkeypatch.setenv("CC", str(script(tmp_path / "cc", HANGING)))
    monkeypatch.setattr("codegen.toolchain.compiler.TIMEOUT", 0.2)
    monkeypatch.setattr("codegen.toolchain.external_tools.TOOL_TIMEOUT", 0.2)
    with pytest.raises(BrokenToolError, match=r"was not done after 0\.2 s"):
        call(tmp_path)


@pytest.mark.parametrize("call", [run_a_program, run_under_sanitizers])
def test_a_program_that_hangs_is_a_build_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Callable[[Path], object]
) -> None:
    monkeypatch.setenv("CC", str(script(tmp_path / "cc", HANGING)))
    monkeypatch.setattr("codegen.toolchain.compiler.TIMEOUT", 0.2)
    monkeypatch.setattr("codegen.toolchain.external_tools.TOOL_TIMEOUT", 0.2)
    with pytest.raises(BuildError, match=r"was not done after 0\.2 s"):
        call(tmp_path)


@pytest.mark.parametrize(
    "call",
    [
        compile_a_program,
        run_a_program,
        run_under_sanitizers,
        lambda folder: compiler_version(),
        lambda folder: run_tool([str(folder / "cc")], folder),
    ],
)
def test_a_program_that_does_not_start_is_a_broken_tool(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: Callable[[Path], object]
) -> None:
    monkeypatch.setenv("CC", str(script(tmp_path / "cc", "neither a script nor a program")))
    with pytest.raises(BrokenToolError, match=r"does not run: .*Exec format error"):
        call(tmp_path)


def test_the_message_of_a_compiler_may_have_any_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = "#!/bin/sh\nprintf 'error: \\344\\n' >&2\nexit 1\n"
    monkeypatch.setenv("CC", str(script(tmp_path / "cc", text)))
    with pytest.raises(BrokenToolError, match="error: \ufffd"):
        compile_a_program(tmp_path)


def test_the_folder_of_an_executable_goes_away(temporary: Path) -> None:
    with build_executable(heater()) as target:
        (folder,) = temporary.iterdir()
        assert {path.name for path in folder.iterdir()} >= {"heater.c", "main.c"}
        assert run_executable(target, b"") == b""
    assert list(temporary.iterdir()) == []
    assert compare(heater_tape()).is_equal
    assert list(temporary.iterdir()) == []


def test_an_error_while_it_is_used_leaves_nothing_either(temporary: Path) -> None:
    with pytest.raises(RuntimeError), build_executable(heater()):
        raise RuntimeError
    assert list(temporary.iterdir()) == []


def test_all_that_an_instance_carries_is_observed() -> None:
    program = heater()
    groups = {item.name.partition(".")[0] for item in compared_variables(program)}
    assert groups == {"state", "latched", "equation", "timer", "memory"}
    kinds = {item.name: item.kind for item in compared_variables(program)}
    assert kinds["equation.P"] == "real"
    assert kinds["equation.low"] == kinds["memory.mode"] == kinds["timer.rest_heating"] == "whole"
    assert [variable.name for variable in tick_inputs(program)] == ["input.T", "input.request"]
