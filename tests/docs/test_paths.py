"""Paths in the documents exist; each sub-package is on the architecture page and in a README."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = (
    "language", "engine", "codegen", "diagnosis", "sweep", "expectation", "lockstep", "modewright",
)  # fmt: skip
READMES = [f"{package}/README.md" for package in (*PACKAGES, "spec", "tests")]
PAGES = [
    *READMES,
    "README.md",
    *sorted(page.relative_to(ROOT).as_posix() for page in ROOT.glob("docs/**/*.md")),
    *sorted(page.relative_to(ROOT).as_posix() for page in ROOT.glob("tests/*/**/README.md")),
]
PATH = re.compile(
    rf"`((?:{'|'.join((*PACKAGES, 'spec', 'tests', 'docs', 'tools'))})/[\w./-]*\w/?)`"
)
LINK = re.compile(r"\]\(([\w./-]+)(?:#[\w-]+)?\)")
NAMED_CONSTANT = re.compile(r"`([\w/]+\.py)` \(`(\w+)`\)")


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
    missing = [path for path in PATH.findall(text) if not (ROOT / path).exists()]
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
    for table in text.split("| to change | touch |")[1:]:
        rows = re.findall(r"^\| (.*) \| (.*) \|$", table, re.MULTILINE)
        assert 5 <= len(rows) <= 20
        assert [row for row, answer in rows if not PATH.search(answer)] == []


@pytest.mark.parametrize("page", READMES)
def test_a_name_beside_a_module_is_in_it(page: str) -> None:
    text = (ROOT / page).read_text("utf-8")
    missing = [
        f"{name} in {module}"
        for module, name in NAMED_CONSTANT.findall(text)
        if not re.search(rf"\b{name}\b", (ROOT / module).read_text("utf-8"))
    ]
    assert missing == []


def test_the_architecture_page_is_one_page() -> None:
    assert len((ROOT / "docs" / "ARCHITECTURE.md").read_text("utf-8").splitlines()) <= 90
