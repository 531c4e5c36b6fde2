"""The recipes on the page of studies, run by DuckDB on a store of the columns that they read."""

from __future__ import annotations

import re
from pathlib import Path

import duckdb
import pytest

from sweep.execution.study_run import run_study
from tests.sweep.example_studies import QUICK_EXECUTOR, make_study

PAGE = Path(__file__).parents[3] / "docs" / "studies.md"
NAMES = {
    "k_hs": "w", "alpha": "d", "peak_T": "final", '"gaps.delays"': '"seen.delays"', "late": "t_1",
}  # fmt: skip
"""Columns of the shipped study and those of the one that is quick."""


def test_every_recipe_of_the_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("tip_out", "other"):
        run_study(make_study(), tmp_path / "build" / name, QUICK_EXECUTOR, block_size=7)
    matched = "seen: {match: below, truth: below, before: 100 ms}"
    made = make_study("grid", ("twice: {value: 2 * t_1}", matched))
    run_study(made, tmp_path / "build" / "lists", QUICK_EXECUTOR)
    (text,) = re.findall(r"```sql\n(.*?)```", PAGE.read_text(), re.DOTALL)
    found = []
    for recipe in text.strip().split("\n\n"):
        for old, new in NAMES.items():
            recipe = re.sub(rf"(?<!\w){re.escape(old)}(?!\w)", new, recipe)
        folder = "lists" if "unnest" in recipe else "tip_out"
        found.append(duckdb.sql(recipe.replace("build/tip_out", f"build/{folder}")).fetchall())
    assert found[0] == [("done", "", 60)]
    assert [len(rows) for rows in found] == [1, 5, 5, 60, 60]
    assert {later for _, later in found[4]} == {0.0}
    magnitudes = [abs(row[3]) for row in found[1]]
    assert magnitudes == sorted(magnitudes, reverse=True)
