"""The cache of compiled programs: compiled once, never run when it could be another's."""

from __future__ import annotations

import dataclasses
import os
import stat
import tempfile
import time
from pathlib import Path

import pytest

from codegen.harness import harness
from codegen.harness.harness import build_executable
from codegen.toolchain import build_cache as cache
from codegen.toolchain.compiler import FLAGS, find_compiler, run_compiler, run_executable
from codegen.toolchain.object_cache import object_of
from lockstep.comparison import compare
from tests.lockstep.heater import heater, heater_tape

PARTS = ["ha_math.c", "stdio.c"]
"""What does not follow from a Program."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "cache" / "modewright"
    monkeypatch.setenv("MODEWRIGHT_CACHE", str(path))
    return path


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """What was compiled, call by call."""
    made: list[Path] = []

    def counting(command: list[str], target: Path) -> None:
        made.append(target)
        run_compiler(command, target)

    monkeypatch.setattr(harness, "run_compiler", counting)
    return made


def files(folder: Path) -> list[Path]:
    return [path for path in folder.iterdir() if path.is_file()]


def programs(folder: Path) -> list[Path]:
    return [path for path in folder.iterdir() if len(path.name) == 64]


def test_the_second_lockstep_run_compiles_nothing(folder: Path, compiled: list[Path]) -> None:
    first, second = compare(heater_tape()), compare(heater_tape())
    assert first == second and first.is_equal
    assert len(compiled) == 1
    assert folder.stat().st_mode & 0o777 == 0o700


def test_other_flags_another_compiler_and_another_program_are_compiled(
    folder: Path, compiled: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    for flags in (FLAGS, (*FLAGS, "-O1")):
        with build_executable(heater(), flags):
            pass
    monkeypatch.setattr(harness, "compiler_version", lambda named: "another")
    with build_executable(heater()):
        pass
    assert len(compiled) == len(programs(folder)) == 3


def damage_truncated(target: Path) -> None:
    target.write_bytes(target.read_bytes()[:100])


def damage_replaced(target: Path) -> None:
    target.write_text("#!/bin/sh\nexit 7\n")


def damage_open(target: Path) -> None:
    target.chmod(0o722)


def damage_link(target: Path) -> None:
    other = target.parent.parent / "other"
    other.write_bytes(target.read_bytes())
    other.chmod(0o700)
    target.unlink()
    target.symlink_to(other)


def damage_seal(target: Path) -> None:
    target.with_name(target.name + ".sha256").unlink()


def damage_no_run(target: Path) -> None:
    target.chmod(0o600)


@pytest.mark.parametrize(
    "damage",
    [damage_truncated, damage_replaced, damage_open, damage_link, damage_seal, damage_no_run],
    ids=lambda damage: damage.__name__,
)
def test_a_damaged_program_is_compiled_anew(
    damage: object, folder: Path, compiled: list[Path]
) -> None:
    compare(heater_tape())
    (target,) = programs(folder)
    assert callable(damage)
    damage(target)
    assert compare(heater_tape()).is_equal
    assert len(compiled) == 2
    assert compare(heater_tape()).is_equal
    assert len(compiled) == 2, "what was damaged is replaced"


def test_a_folder_that_others_may_write_is_not_used(folder: Path, compiled: list[Path]) -> None:
    folder.mkdir(parents=True)
    folder.chmod(0o777)
    assert compare(heater_tape()).is_equal
    assert compare(heater_tape()).is_equal
    assert len(compiled) == 2
    assert list(folder.iterdir()) == []
    assert "open to other users" in cache.cache_fault(folder)


def test_a_folder_of_another_user_is_not_used(
    folder: Path, compiled: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.mkdir(parents=True, mode=0o700)
    uid = os.getuid()
    monkeypatch.setattr(os, "getuid", lambda: uid + 1)
    assert compare(heater_tape()).is_equal
    assert list(folder.iterdir()) == []
    assert "another user" in cache.cache_fault(folder)


def test_a_link_and_a_file_are_no_cache_folder(folder: Path, tmp_path: Path) -> None:
    folder.parent.mkdir()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    folder.symlink_to(elsewhere)
    assert "is not a folder" in cache.cache_fault(folder)
    folder.unlink()
    folder.write_text("")
    assert cache.cache_fault(folder)
    with build_executable(heater()) as target:
        assert run_executable(target, b"") == b""


def test_the_oldest_programs_go_after_a_day(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "MAX_PROGRAMS", 1)
    with build_executable(heater()):
        pass
    (old,) = programs(folder)
    (seal,) = (path for path in files(folder) if path.name == f"{old.name}.sha256")
    for path in (old, seal, folder / cache.CLEANUP_STAMP):
        os.utime(path, (1.0, 1.0))
    with build_executable(heater(), (*FLAGS, "-O1")) as new:
        assert programs(folder) == [new]
    assert len(files(folder)) == 3, "its seal has gone too; the new one's and the stamp are there"


def test_a_folder_is_looked_through_once_an_hour(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cache, "MAX_PROGRAMS", 0)
    cache.remove_old_programs(tmp_path)
    old, other = tmp_path / f"{'a' * 64}.so", tmp_path / "a file of another kind"
    thresholds = tmp_path / f"{'d' * 64}.json"
    for path in (old, other, thresholds):
        path.write_text("")
        os.utime(path, (1.0, 1.0))
    cache.remove_old_programs(tmp_path)
    assert old.exists()
    os.utime(tmp_path / cache.CLEANUP_STAMP, (time.time() - cache.HOUR - 1.0,) * 2)
    cache.remove_old_programs(tmp_path)
    assert not old.exists() and other.exists()
    assert thresholds.exists(), "no program belongs to it"


def test_what_was_read_today_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cache, "MAX_PROGRAMS", 0)
    library, recipe = (tmp_path / f"{'b' * 64}.{ending}" for ending in ("so", "json"))
    for path in (library, recipe):
        path.write_text("")
        os.utime(path, (1.0, 1.0))
    os.utime(library, (time.time(), 1.0))
    cache.remove_old_programs(tmp_path)
    assert library.exists() and recipe.exists(), "they belong together"


def test_folders_inside_are_looked_through_but_no_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compiled candidates of a diagnosis have a folder of their own there."""
    monkeypatch.setattr(cache, "MAX_PROGRAMS", 0)
    inside, elsewhere = tmp_path / "kept" / "candidates", tmp_path / "elsewhere"
    for folder in (inside, elsewhere):
        folder.mkdir(parents=True)
        (folder / f"{'c' * 64}.so").write_text("")
        os.utime(folder / f"{'c' * 64}.so", (1.0, 1.0))
    (tmp_path / "kept" / "link").symlink_to(elsewhere)
    cache.remove_old_programs(tmp_path / "kept")
    assert [path.name for path in inside.iterdir()] == [cache.CLEANUP_STAMP]
    assert (elsewhere / f"{'c' * 64}.so").exists()


@pytest.fixture
def objects(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The sources that were compiled to an object, call by call."""
    made: list[str] = []

    def counting(command: list[str], target: Path) -> None:
        made.append(Path(command[-1]).name)
        run_compiler(command, target)

    monkeypatch.setattr("codegen.toolchain.object_cache.run_compiler", counting)
    return made


def test_what_is_the_same_in_many_programs_is_compiled_once(
    folder: Path, compiled: list[Path], objects: list[str]
) -> None:
    for name in ("room", "other"):
        with build_executable(dataclasses.replace(heater(), name=name)):
            pass
    assert (len(compiled), objects) == (2, PARTS)
    with build_executable(heater(), (*FLAGS, "-O1")):
        pass
    assert (len(compiled), objects) == (3, PARTS * 2)
    assert (folder / "objects").stat().st_mode & 0o777 == 0o700


def test_a_damaged_object_is_compiled_anew(folder: Path, objects: list[str]) -> None:
    assert compare(heater_tape()).is_equal
    for target in programs(folder / "objects"):
        target.write_bytes(target.read_bytes()[:100])
    (program,) = programs(folder)
    program.unlink()
    assert compare(heater_tape()).is_equal
    assert objects == PARTS * 2


def test_an_object_follows_from_what_is_read(tmp_path: Path, objects: list[str]) -> None:
    """The mathematics have one header; what is beside them is of one program."""
    source, header = tmp_path / "ha_math.c", tmp_path / "ha_math.h"
    source.write_text('#include "ha_math.h"\nint ha_one(void)\n{\n    return ONE;\n}\n')
    for one, beside, count in ((1, "a", 1), (1, "b", 1), (2, "b", 2)):
        header.write_text(f"#define ONE {one}\nint ha_one(void);\n")
        (tmp_path / "beside.h").write_text(beside)
        object_of(source, [*find_compiler(), *FLAGS], "here", tmp_path / "room")
        assert objects == ["ha_math.c"] * count


def test_the_cache_is_below_the_users_cache_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("MODEWRIGHT_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache.cache_folder() == tmp_path / "modewright"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache.cache_folder() == tmp_path / ".cache" / "modewright"


def test_a_user_without_a_home_folder_has_a_private_temporary_cache(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("MODEWRIGHT_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", no_home)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    cache._temporary_cache.cache_clear()
    try:
        folder = cache.cache_folder()
        assert folder.parent == tmp_path and cache.cache_folder() == folder
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700
        assert cache.cache_fault(folder) == ""
    finally:
        cache._temporary_cache.cache_clear()


@pytest.mark.parametrize("name", ["program", "digest"])
def test_a_pipe_in_the_cache_is_no_program(folder: Path, tmp_path: Path, name: str) -> None:
    def build(target: Path) -> None:
        target.write_bytes(b"built")
        target.chmod(0o700)

    target = cache.get_or_build("a" * 64, build, tmp_path)
    path = target if name == "program" else target.with_name(f"{target.name}.sha256")
    path.unlink()
    os.mkfifo(path)
    assert cache.get_or_build("a" * 64, build, tmp_path).read_bytes() == b"built"
