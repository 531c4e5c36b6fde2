"""Rendering: templates are compiled once per user, and anew where nothing can be kept."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import jinja2
import pytest

from codegen.toolchain import templates as rendering
from codegen.toolchain.templates import TEMPLATE_CACHE, render

TEMPLATE = "coverage/words_fed.jinja"
NOTHING: dict[str, list[str]] = {"inputs": []}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    path = tmp_path / "modewright"
    monkeypatch.setenv("MODEWRIGHT_CACHE", str(path))
    rendering.template_environment.cache_clear()
    yield path
    rendering.template_environment.cache_clear()


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The templates that were compiled."""
    made: list[str] = []
    real = jinja2.Environment.compile

    def counting(self: jinja2.Environment, source: str, name: str, *more: object) -> object:
        made.append(name)
        return real(self, source, name, *more)  # type: ignore[call-overload]

    monkeypatch.setattr(jinja2.Environment, "compile", counting)
    return made


def rendered() -> str:
    """Return a template filled in as another process would do it."""
    rendering.template_environment.cache_clear()
    return render(TEMPLATE, NOTHING)


def test_a_template_is_compiled_once(folder: Path, compiled: list[str]) -> None:
    assert rendered() == rendered()
    assert compiled == [TEMPLATE]
    assert (folder / TEMPLATE_CACHE).stat().st_mode & 0o777 == 0o700


def test_one_that_is_cut_is_compiled_anew(folder: Path, compiled: list[str]) -> None:
    first = rendered()
    for path in (folder / TEMPLATE_CACHE).iterdir():
        path.write_bytes(path.read_bytes()[:40])
    assert rendered() == first
    assert len(compiled) == 2


def test_any_changed_byte_is_found_and_the_file_is_stored_anew(
    folder: Path, compiled: list[str]
) -> None:
    """Text in the bytecode is text of the C: a changed letter would be another C."""
    first = rendered()
    (path,) = (folder / TEMPLATE_CACHE).iterdir()
    stored = path.read_bytes()
    for position in range(0, len(stored), max(1, len(stored) // 60)):
        changed = bytes([stored[position] ^ 1])
        path.write_bytes(stored[:position] + changed + stored[position + 1 :])
        compiled.clear()
        assert rendered() == first
        assert compiled == [TEMPLATE]
        assert path.read_bytes() == stored


def test_a_pipe_or_a_link_in_place_of_a_template_is_not_read(
    folder: Path, tmp_path: Path, compiled: list[str]
) -> None:
    first = rendered()
    (path,) = (folder / TEMPLATE_CACHE).iterdir()
    path.rename(tmp_path / "elsewhere")
    path.symlink_to(tmp_path / "elsewhere")
    assert rendered() == first
    path.unlink()
    os.mkfifo(path)
    assert rendered() == first
    assert compiled == [TEMPLATE] * 3


def test_without_a_folder_of_the_users_own_nothing_is_kept(
    folder: Path, compiled: list[str]
) -> None:
    folder.mkdir(mode=0o755)
    assert rendered() == rendered()
    assert len(compiled) == 2 and not list(folder.iterdir())


def test_a_folder_that_goes_meanwhile_ends_nothing(folder: Path) -> None:
    first = rendered()
    rendering.template_environment.cache_clear()
    rendering.template_environment((rendering.CODEGEN,), is_html=False)
    for path in (folder / TEMPLATE_CACHE).iterdir():
        path.unlink()
    (folder / TEMPLATE_CACHE).rmdir()
    (folder / TEMPLATE_CACHE).write_text("")
    assert render(TEMPLATE, NOTHING) == first
