"""Results of a study that were begun elsewhere count, where code and cases are the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from sweep.definition.study import Presentation
from sweep.evaluation.evaluate_measures import Cell
from sweep.store.manifest import Manifest
from sweep.store.row import DONE, Block, Row
from sweep.store.store import Store, open_store
from tests.validation.study.result_store import MEASURES, VARIED
from tests.validation.study.result_transfer import export_results, import_results, rows_of

COUNT = 5
CODE = "abc"


def manifest(digest: str) -> Manifest:
    shown = Presentation(by=("variant", "strength", "rate"))
    return Manifest("some", digest, {"code": digest}, COUNT, 1, VARIED, {}, MEASURES, shown)


def row(number: int, plan: str) -> Row:
    took = {"cpu": 1.5, "compiler": 0.5, "wall": 2.5}
    texts: dict[str, Cell] = dict.fromkeys(("label", "decision", "simpler"), "{}")
    measures: dict[str, Cell] = {**texts, "verdict": f'{{"case": {number}}}', **took}
    return Row(
        number, plan, f"case_{number}", 0, 0, 7, {"strength": 1.0, "rate": 200.0}, DONE, "",
        measures,
    )  # fmt: skip


def store_of(folder: Path, plan: str, digest: str, numbers: tuple[int, ...] = ()) -> Store:
    store = open_store(folder, manifest(digest))
    for number in numbers:
        store.write_rows(Block(number, number + 1), [row(number, plan)])
    return store


@pytest.fixture
def carried(tmp_path: Path) -> Path:
    path = tmp_path / "verdicts.parquet"
    stores = {
        "full": store_of(tmp_path / "full", "full", "one", (0, 2, 3)),
        "clean": store_of(tmp_path / "clean", "clean", "two", (1,)),
    }
    assert export_results(stores, path, CODE) == 4
    return path


def test_a_study_goes_on_elsewhere_with_what_it_has(carried: Path, tmp_path: Path) -> None:
    there = store_of(tmp_path / "there", "full", "one", (2,))
    assert import_results(there, "full", carried) == 2
    assert there.finished_starts() == {0, 2, 3}
    before = list(rows_of(store_of(tmp_path / "full", "full", "one")))
    assert sorted(map(str, rows_of(there))) == sorted(map(str, before))
    assert import_results(there, "full", carried) == 0


def test_results_of_other_code_or_cases_are_none(carried: Path, tmp_path: Path) -> None:
    other = store_of(tmp_path / "other", "full", "another")
    assert import_results(other, "full", carried) == 0
    assert import_results(store_of(tmp_path / "x", "weak", "one"), "weak", carried) == 0
    assert not other.finished_starts()


def test_no_file_is_no_result(tmp_path: Path) -> None:
    store = store_of(tmp_path / "new", "full", "one")
    assert import_results(store, "full", tmp_path / "none.parquet") == 0
    assert export_results({"full": store}, tmp_path / "empty.parquet", CODE) == 0
    assert not (tmp_path / "empty.parquet").exists()


def test_results_of_other_groups_are_kept_if_the_code_is_the_same(
    carried: Path, tmp_path: Path
) -> None:
    stores = {"full": store_of(tmp_path / "more", "full", "one", (0, 1, 2, 3))}
    assert export_results(stores, carried, CODE) == 5
    there = store_of(tmp_path / "there", "clean", "two")
    assert import_results(there, "clean", carried) == 1
    assert export_results(stores, carried, "another") == 4
