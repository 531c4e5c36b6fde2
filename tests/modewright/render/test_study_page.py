"""The page of a study, and `modewright sensitivity`, as a user meets them."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from engine.batch.interpreted_batch import run_interpreted_batch
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from modewright.render import study_page
from sweep.definition.study import Study
from sweep.execution.executor import BlockResult, SerialExecutor
from sweep.execution.study_run import run_study
from sweep.store.row import Block
from sweep.store.store import read_store
from tests.sweep.example_studies import QUICK_EXECUTOR, make_study

DESIGN = ("sampling: {random: 4, seed: 3}", "sampling: {morris: 6, seed: 3}")


@pytest.mark.long
def test_a_study_is_one_page_that_asks_for_no_other_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, page = tmp_path / "out", tmp_path / "out.html"
    made = make_study("grid", DESIGN, ("of:", "about: a swing that is pushed\nof:"))
    run_study(made, out, QUICK_EXECUTOR)
    arguments = ["sweep", "--summary", str(out), "--report", str(page)]
    assert run_with_exit_code(lambda: app(arguments, standalone_mode=False)) == 0
    assert f"wrote {page}" in capsys.readouterr().out
    text = page.read_text()
    assert "<h1>grid: 270 of 270 variants</h1>" in text
    assert text.count("<svg ") == 4
    assert re.findall(r'(?:src|href)="(?!#|data:)[^"]*"', text) == []
    ids = re.findall(r' id="([^"]+)"', text)
    assert len(ids) == len(set(ids))
    assert read_store(out).manifest.digest in text
    for part in (
        "mu_star",
        "peak [m]: the highest",
        "peak [m]: the lowest",
        "a swing that is pushed",
        "<code>{uniform: [0.5 m, 1.5 m]}</code>",
        "x_0: <code>x_1</code>",
        "t_1: <code>{time: below}</code>",
        "6 paths of 3 points",
        "6 of 6",
        "None of those",
        "system of variant",
    ):
        assert part in text
    assert study_page.render_study_page(read_store(out)).decode() == text


def test_failed_variants_are_on_the_page_with_their_reasons(tmp_path: Path) -> None:
    run_study(make_study("failing_ways"), tmp_path, SerialExecutor(run_interpreted_batch))
    text = study_page.render_study_page(read_store(tmp_path)).decode()
    assert "fire for ever" in text
    assert "`plant.k` = 9 is outside its range [0, 5]" in text
    assert '<span class="badge unknown">3 stopped</span>' in text


def test_indices_are_told_to_people_and_machines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, table = str(tmp_path / "out"), tmp_path / "indices.csv"
    run_study(make_study("grid", DESIGN), tmp_path / "out", QUICK_EXECUTOR)
    run = ["sensitivity", out, "--csv", str(table)]
    assert run_with_exit_code(lambda: app(run, standalone_mode=False)) == 0
    told = capsys.readouterr().out
    assert "morris" in told and "mu_s" in told  # a narrow terminal cuts the rest
    assert table.read_text().startswith("w,d,measure,unit,name,mu_star,mu,sigma,")
    assert (
        run_with_exit_code(lambda: app(["sensitivity", out, "--json"], standalone_mode=False)) == 0
    )
    found = json.loads(capsys.readouterr().out)
    assert {one["name"] for one in found["indices"]} == {"x_1", "inputs.push.steps.1"}
    assert len(found["indices"][0]["intervals"]["mu_star"]) == 2
    assert (found["expected"], found["counts"]) == (270, {"done": 270})


def test_an_unfinished_study_and_what_cannot_be_told_yet_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """12 variants of a path of 3, at 15 points of the grid: 4 paths of 6 at the first of them."""

    def some(study: Study, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        yield from QUICK_EXECUTOR(study, list(blocks)[:4])

    out, table = tmp_path / "out", tmp_path / "indices.csv"
    made = make_study("grid", DESIGN)
    for count, run in ((0, lambda study, blocks: iter(())), (12, some)):
        run_study(made, out, run, block_size=3)
        command = ["sensitivity", str(out), "--csv", str(table)]
        assert run_with_exit_code(lambda: app(command, standalone_mode=False)) == 0  # noqa: B023
        told = " ".join(capsys.readouterr().out.split())
        assert f"{count} of 270 variants" in told
        assert "unfinished: the same `modewright sweep STUDY --out DIR` goes on" in told
        assert ("fewer than 4 paths are complete" in told) == (count == 0)
        rows = list(csv.DictReader(table.read_text().splitlines()))
        assert {(row["used"], row["count"]) for row in rows} == {(str(count // 3), "6")}
        assert all((row["mu_star"] == "") == (count == 0) for row in rows)


def test_a_study_without_a_design_says_what_is_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run_study(make_study(), tmp_path, QUICK_EXECUTOR)
    assert (
        run_with_exit_code(lambda: app(["sensitivity", str(tmp_path)], standalone_mode=False)) == 1
    )
    assert "sampling: {saltelli: 256, seed: 1}" in capsys.readouterr().err


def test_a_name_is_no_markup_of_the_page() -> None:
    data = b'<?xml version="1.0"?><svg width="1"><path id="p"/><use href="#p"/></svg>'
    text = study_page._embed_svg('"><script>\\1', data)
    assert "<script>" not in text
    assert text.startswith('<svg role="img" aria-label="&quot;&gt;&lt;script&gt;\\1" ')
