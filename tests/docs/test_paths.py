"""Paths in the documents exist; each sub-package is on the architecture page and in a README."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from modewright.cli.app import COMMANDS
from modewright.editing.key_shape import shapes
from tests.docs.page_blocks import read_blocks

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = (
    "language", "engine", "codegen", "diagnosis", "sweep", "expectation", "lockstep", "modewright",
)  # fmt: skip
READMES = [f"{package}/README.md" for package in (*PACKAGES, "spec", "tests")]
PAGES = [
    *READMES,
    "README.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
    *sorted(page.relative_to(ROOT).as_posix() for page in ROOT.glob("docs/**/*.md")),
    *sorted(page.relative_to(ROOT).as_posix() for page in ROOT.glob("tests/*/**/README.md")),
]
PATH = re.compile(
    rf"`((?:{'|'.join((*PACKAGES, 'spec', 'tests', 'docs', 'tools'))})/[\w./-]*\w/?)`"
)
LINK = re.compile(r"\]\(([\w./-]+)(?:#[\w-]+)?\)")
NAMED_THINGS = re.compile(r"`([\w./-]+)` \(([^)]*`[^)]*)\)")
"""A file and, in parentheses behind it, names that it contains."""
CHANGES = "docs/changes.md"


def _sub_packages(package: str, depth: int | None = None) -> set[str]:
    """Return the folders of a package that are sub-packages, down to a depth."""
    folders = {path.parent for path in (ROOT / package).rglob("__init__.py")} - {ROOT / package}
    names = {folder.relative_to(ROOT).as_posix() for folder in folders}
    return {name for name in names if depth is None or name.count("/") <= depth}


def _table(page: str) -> set[str]:
    """Return the folders in the first column of the tables of a page."""
    text = (ROOT / page).read_text("utf-8")
    return set(re.findall(r"^\| `([\w/]+)` \|", text, re.MULTILINE))


@pytest.mark.parametrize("page", PAGES)
def test_every_path_on_a_page_exists(page: str) -> None:
    text = (ROOT / page).read_text("utf-8")
    written = {block.argument for block in read_blocks(ROOT / page)}
    paths = [path for path in PATH.findall(text) if path not in written]
    missing = [path for path in paths if not (ROOT / path).exists()]
    missing += [link for link in LINK.findall(text) if not ((ROOT / page).parent / link).exists()]
    assert missing == []


def test_the_architecture_page_names_the_sub_packages_that_exist() -> None:
    expected = {"expectation", "lockstep"}.union(*(_sub_packages(name, 1) for name in PACKAGES))
    assert _table("docs/ARCHITECTURE.md") == expected


@pytest.mark.parametrize("package", PACKAGES)
def test_the_readme_of_a_package_names_its_sub_packages(package: str) -> None:
    assert _table(f"{package}/README.md") == _sub_packages(package)


def test_the_readme_of_the_tests_names_their_folders() -> None:
    folders = (path for path in (ROOT / "tests").iterdir() if path.is_dir())
    names = {f"tests/{path.name}" for path in folders if path.name != "__pycache__"}
    assert _table("tests/README.md") == names


@pytest.mark.parametrize("page", READMES)
def test_a_readme_says_what_to_touch(page: str) -> None:
    text = (ROOT / page).read_text("utf-8").partition("## To change X, touch Y")[2]
    assert "(../docs/changes.md)" in text
    for table in text.split("| to change | touch |")[1:]:
        rows = re.findall(r"^\| (.*) \| (.*) \|$", table, re.MULTILINE)
        assert 5 <= len(rows) <= 20
        assert [row for row, answer in rows if not PATH.search(answer)] == []


@pytest.mark.parametrize("package", PACKAGES)
def test_a_change_that_crosses_packages_is_on_the_page_of_changes_alone(package: str) -> None:
    text = (ROOT / package / "README.md").read_text("utf-8").partition("## To change X")[2]
    assert [path for path in PATH.findall(text) if not path.startswith(f"{package}/")] == []


def test_each_change_has_its_files() -> None:
    tables = _change_tables("| to add or change")
    assert len(tables) >= 20
    for rows in tables:
        assert [cells[0] for cells in rows if len(cells) != 3] == []
        assert [cells[0] for cells in rows if not PATH.search(cells[1])] == []


def test_each_command_has_the_chain_of_an_option() -> None:
    (rows,) = _change_tables("| command |")
    commands = {cells[0].strip("`"): cells[1] for cells in rows}
    known = {command.__name__ for command in COMMANDS} | {"recording", "calibration", "demo"}
    assert set(commands) == known
    for name, module in commands.items():
        assert module.startswith(f"`modewright/cli/commands/{name}.py`")


def test_each_mapping_with_keys_has_a_row() -> None:
    page = (ROOT / CHANGES).read_text("utf-8")
    assert [name for name in shapes() if f"`{name}`" not in page] == []


@pytest.mark.parametrize("page", [*READMES, CHANGES])
def test_a_name_beside_a_module_is_in_it(page: str) -> None:
    text = (ROOT / page).read_text("utf-8")
    missing = [
        f"{name} in {module}"
        for module, note in NAMED_THINGS.findall(text)
        if (ROOT / module).is_file()
        for name in re.findall(r"`(\w+)`", note)
        if not re.search(rf"\b{name}\b", (ROOT / module).read_text("utf-8"))
    ]
    assert missing == []


def _change_tables(head: str) -> list[list[list[str]]]:
    """Return the rows of each table of the page of changes that begins with a head, in cells."""
    page = (ROOT / CHANGES).read_text("utf-8")
    blocks = [block.splitlines()[2:] for block in page.split("\n\n") if block.startswith(head)]
    return [[line.strip("| ").split(" | ") for line in block] for block in blocks]


def test_the_architecture_page_is_one_page() -> None:
    assert len((ROOT / "docs" / "ARCHITECTURE.md").read_text("utf-8").splitlines()) <= 90
