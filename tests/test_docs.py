"""The documents say what is true: specs in them are read, commands in them exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import modewright as mw
from modewright.cli import app

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()


def test_the_spec_in_the_readme_has_15_lines_and_no_problem(tmp_path: Path) -> None:
    text = re.findall(r"```yaml\n(.*?)```", README, re.DOTALL)[0]
    spec = tmp_path / "readme.yaml"
    spec.write_text(text)
    assert len(text.splitlines()) == 15
    assert mw.check(str(spec)) == []


def test_every_command_in_the_readme_exists() -> None:
    used = set(re.findall(r"`modewright (\w+) ", README))
    assert used == set(re.findall(r"\| `modewright (\w+)", README))
    for name in used:
        assert CliRunner().invoke(app, [name, "--help"]).exit_code == 0


@pytest.mark.parametrize("page", ["README.md", "docs/ARCHITECTURE.md", "docs/recordings.md"])
def test_every_file_that_a_page_names_exists(page: str) -> None:
    text = (ROOT / page).read_text()
    named = re.findall(r"`((?:spec|tests|docs|engine|language|codegen)/[\w./-]+)`", text)
    links = re.findall(r"\]\(([\w./-]+)\)", text)
    missing = [name for name in named if not (ROOT / name).exists()]
    missing += [name for name in links if not (ROOT / page).parent.joinpath(name).exists()]
    assert missing == []


def test_the_architecture_page_is_short_enough_to_be_read() -> None:
    assert len((ROOT / "docs" / "ARCHITECTURE.md").read_text().splitlines()) <= 120
