"""The commands of README, tutorial and the page for users of Stateflow print what they show."""

from __future__ import annotations

import json
import re
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


def test_the_numbers_of_the_readme_are_those_of_the_measurements() -> None:
    """If a measurement is renewed, the README needs its new numbers."""
    readme = (ROOT / "README.md").read_text("utf-8")
    validation = (ROOT / "docs" / "validation.md").read_text("utf-8")
    row = r"^\| {} \|[^|]*\| ([\d.]+) % \(([\d.]+) % to ([\d.]+) %\)"
    name, low, high = (
        round(float(number)) for number in _only(row.format("first name right"), validation)
    )
    assert f"{name} % (95 % interval {low} to {high} %)" in readme
    (weak, *_), (removed, *_), (alarms, *_) = (
        _only(row.format(text), validation)
        for text in (
            "0.3 x strength: first name right",
            "effect not in the library: `unknown` or a relative, at the right place",
            "false alarms",
        )
    )
    assert f"0.3 x size ({float(weak):g} % right)" in readme
    assert f"({float(removed):g} % recognised as such)" in readme
    assert float(alarms) == 0.0 and "gave no false alarm" in readme
    for group, count in (("full", 30), ("clean", 10)):
        (cells,) = _only(rf"^\| `{group}` \|[^|]*\|(.*)\|$", validation)
        assert sum(int(cell.split()[0]) for cell in cells.split("|")) == count
        assert f"{count} " in readme
    simpler = r"^\| {}[^|]*\| ([\d.]+)% \([^|]*of (\d+) \| ([\d.]+)% \([^|]*of (\d+) \|"
    for method, text in (
        ("diagnosis", "100 %, 0 of 6 false alarms"),
        ("sparse regression", "26 %, 6 of 6 false alarms"),
    ):
        right, cases, false, clean = map(float, _only(simpler.format(method), validation))
        alarm_count = round(false * clean / 100.0)
        assert (
            text == f"{right:.0f} %, {alarm_count} of {clean:.0f} false alarms" and text in readme
        )
        assert f"{cases:.0f} drivelines" in readme
    parts = json.loads((ROOT / "docs" / "evidence" / "lockstep.json").read_text("utf-8")).values()
    runs = [run for part in parts for run in part["parts"].values()]
    assert f"{sum(run['values'] for run in runs) / 1e6:.0f} million values" in readme
    assert all(run["differing"] == 0 for run in runs)
    benchmark = (ROOT / "docs" / "benchmark.md").read_text("utf-8")
    for figure, text in (
        ("single_run.compiled_over_c", "{:.2f} of hand-written C;"),
        ("chart.generated_over_c_both_with_ranges", "{:.2f} of hand-written C with equal"),
        ("chart.interpreter_over_sismic", "{:.0f} times as fast"),
    ):
        (value,) = _only(rf"^ +{re.escape(figure)} +([\d.]+) ", benchmark)
        assert text.format(float(value)) in readme


def _only(pattern: str, text: str) -> tuple[str, ...]:
    """Return the groups of the only match of a pattern."""
    (match,) = re.finditer(pattern, text, re.MULTILINE)
    return match.groups()


def test_an_output_that_differs_is_an_error() -> None:
    assert_matches("a ... c\n...\nend\n", "a b c  \nmore\nlines\nend\n", "here")
    with pytest.raises(AssertionError, match="another output"):
        assert_matches("a ... c\n", "a b d\n", "here")
