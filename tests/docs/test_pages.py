"""The commands of README, tutorial and the page for users of Stateflow print what they show."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs.page_blocks import RUN_ELSEWHERE, assert_matches, read_blocks, run_page

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "docs/tutorial.md", "docs/from_stateflow.md")


@pytest.mark.parametrize("page", PAGES)
def test_the_fast_commands_of_a_page_print_what_it_shows(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    run_page(ROOT / page, monkeypatch, capfd, is_long=False)


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES[:2])
def test_all_commands_of_a_page_print_what_it_shows(
    page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    run_page(ROOT / page, monkeypatch, capfd, is_long=True)


def test_what_is_run_elsewhere_is_on_a_page() -> None:
    text = "".join(block.text for page in PAGES for block in read_blocks(ROOT / page))
    assert [command for command in RUN_ELSEWHERE if command not in text] == []


def test_the_readme_has_at_most_120_lines() -> None:
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= 120


def test_an_output_that_differs_is_an_error() -> None:
    assert_matches("a ... c\n...\nend\n", "a b c  \nmore\nlines\nend\n", "here")
    with pytest.raises(AssertionError, match="another output"):
        assert_matches("a ... c\n", "a b d\n", "here")
