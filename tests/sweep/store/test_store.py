"""What lies in a store is trusted only as far as it is what was written."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

from language.text.diagnostic import SpecError
from sweep.execution.study_run import run_study
from sweep.store.block_file import block_file_fault
from sweep.store.manifest import MANIFEST_NAME, seal_of
from sweep.store.store import Store, read_store, write_atomically
from tests.sweep.example_studies import QUICK_EXECUTOR, make_study
from tests.sweep.execution.test_study_run import bytes_of

Change = Callable[[dict[str, Any]], object]


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("kept") / "out"
    run_study(make_study(), folder, QUICK_EXECUTOR, block_size=10)
    return folder


@pytest.fixture
def out(kept: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(kept, tmp_path / "out"))


def edited(folder: Path, change: Change) -> None:
    """Change the manifest of a store, as if that had been written."""
    data = json.loads((folder / MANIFEST_NAME).read_text())
    change(data)
    data["seal"] = seal_of(data)
    (folder / MANIFEST_NAME).write_text(json.dumps(data))


# The manifest.


def test_any_change_of_the_manifest_is_refused_and_nothing_is_removed(out: Path) -> None:
    before = bytes_of(out)
    text = (out / MANIFEST_NAME).read_text()
    for old, new in (('"block": 10', '"block": 20'), ('"unit": "m"', '"unit": "mm"')):
        assert old in text
        (out / MANIFEST_NAME).write_text(text.replace(old, new))
        with pytest.raises(SpecError, match=r"`study\.json` cannot be read: it is not as it was"):
            run_study(make_study(), out, QUICK_EXECUTOR)
        with pytest.raises(SpecError, match="cannot be read"):
            read_store(out)
        assert bytes_of(out) == before


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda data: data.update(block=-5), "`block` is -5, no whole number from 1 on"),
        (lambda data: data.update(block=0), "`block` is 0"),
        (lambda data: data.update(block="x"), "`block` is x"),
        (lambda data: data.update(block=True), "`block` is True"),
        (lambda data: data.update(count=-1), "`count` is -1"),
        (lambda data: data.pop("count"), "`count` is missing"),
        (lambda data: data.update(study="\x1b[2Jx"), "`study` is .* no text"),
        (lambda data: data.update(words=3), "`words` is no table"),
        (lambda data: data.update(identity=[]), "`identity` is no table"),
        (lambda data: data.update(varied=[]), "is w, not one of nothing"),
        (lambda data: data.update(varied={}), "`varied` is no list"),
        (lambda data: data["varied"][0].update(type="x"), r"`varied\.0\.type` is x, not one of"),
        (lambda data: data["measures"][0].update(name="d"), "have a name twice"),
        (lambda data: data["measures"][0].update(name="status"), "have a name twice"),
        (lambda data: data["measures"][0].update(name="../x"), r"`measures\.0\.name` is no name"),
        (lambda data: data["presentation"].update(by=["zzz"]), "`by` is zzz, not one of variant"),
        (lambda data: data["presentation"].update(confidence=2.0), "`confidence` is no share"),
        (lambda data: data["presentation"].update(confidence=float("nan")), "is nan, no real"),
        (lambda data: data["presentation"].update(plots=[]), "`plots` is no table"),
        (lambda data: plots(data).update({"../../x": {}}), r"`\.\./\.\./x` is no name of a pic"),
        (lambda data: plots(data).update(x={"kind": "nope", "of": []}), r"x\.kind` is nope"),
        (lambda data: plots(data)["heat"].update(of=[]), r"`plots\.heat\.of` is not one measure"),
        (lambda data: plots(data)["heat"].update(over=["w"]), "is not two things"),
        (lambda data: data["varied"][0].update(factor=0.0), r"factor` is 0\.0, not above zero"),
        (lambda data: data["varied"][0].update(offset="x"), r"varied\.0\.offset` is x, no real"),
        (lambda data: data["varied"][0].update(shown="\x1b"), r"varied\.0\.shown` is .* no text"),
        (lambda data: data.pop("design"), "`design` is missing"),
        (lambda data: data["design"].update(method="x"), r"`design\.method` is x, not one of"),
        (lambda data: data["design"].update(names=[]), "`design` has points of nothing, or none"),
        (lambda data: data["design"].update(names=["z"]), r"`design\.names` is z, not one of w"),
        (lambda data: data["design"].update(count=-4), r"`design\.count` is -4"),
        (lambda data: data["design"].update(method="morris"), "is 4: some are not whole"),
        (lambda data: data["design"].update(seed=-1), r"`design\.seed` is -1"),
        (lambda data: data["design"].update(replicates=0), r"`design\.replicates` is 0"),
        (lambda data: data.update(description=[]), "`description` is no table"),
        (lambda data: data["description"].update(of=3), r"`description\.of` is 3, no text"),
        (lambda data: data["description"].update(vary={"w": "\x1b"}), r"description\.vary\.w` is"),
    ],
)  # fmt: skip
def test_each_part_of_the_manifest_is_checked(change: Change, told: str, out: Path) -> None:
    before = bytes_of(out)
    edited(out, change)
    with pytest.raises(SpecError, match=told):
        run_study(make_study(), out, QUICK_EXECUTOR)
    with pytest.raises(SpecError, match=told):
        read_store(out)
    assert bytes_of(out) == before


def plots(data: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = data["presentation"]["plots"]
    return found


def test_other_columns_than_those_of_the_blocks_are_told(out: Path) -> None:
    edited(out, lambda data: data["measures"].append({**data["measures"][0], "name": "extra"}))
    with pytest.raises(SpecError, match="damaged"):
        read_store(out)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda data: data.update(modewright=1), "in a form that is not known here"),
        (lambda data: data.pop("seal"), "`seal` is missing"),
    ],
)
def test_a_manifest_of_before_there_were_seals_is_refused(
    change: Change, told: str, out: Path
) -> None:
    data = json.loads((out / MANIFEST_NAME).read_text())
    change(data)
    (out / MANIFEST_NAME).write_text(json.dumps(data))
    before = bytes_of(out)
    with pytest.raises(SpecError, match=told):
        run_study(make_study(), out, QUICK_EXECUTOR)
    assert bytes_of(out) == before


def test_blocks_that_a_manifest_does_not_have_are_refused(out: Path) -> None:
    edited(out, lambda data: data.update(block=12))
    before = bytes_of(out)
    with pytest.raises(SpecError, match="no block of the results"):
        run_study(make_study(), out, QUICK_EXECUTOR)
    assert bytes_of(out) == before


# The blocks.


def test_any_flipped_bit_of_a_block_is_seen(out: Path) -> None:
    store = read_store(out)
    path, block = store.paths()[1], store.manifest.blocks[1]
    data = path.read_bytes()
    assert block_file_fault(store.manifest, block, data) == ""
    for place in np.random.default_rng(1).integers(0, len(data), 300).tolist():
        flipped = data[:place] + bytes([data[place] ^ 4]) + data[place + 1 :]
        assert block_file_fault(store.manifest, block, flipped) == "damaged", place


def test_a_block_with_a_corrupt_body_is_told_and_computed_again(out: Path) -> None:
    before = bytes_of(out)
    path = read_store(out).paths()[2]
    data = path.read_bytes()
    path.write_bytes(data[:4] + b"\xaa" * (len(data) // 3) + data[4 + len(data) // 3 :])
    with pytest.raises(SpecError, match=rf"{path.name}:1:1: this block is damaged"):
        read_store(out)
    told: list[str] = []
    again = run_study(make_study(), out, QUICK_EXECUTOR, warn=told.append)
    assert (again.reused, again.computed) == (50, 10)
    assert told == [f"{path} is damaged: its variants are computed again"]
    assert bytes_of(out) == before


def test_a_block_without_a_digest_is_damaged(out: Path) -> None:
    store = read_store(out)
    path, block = store.paths()[0], store.manifest.blocks[0]
    table = pyarrow.parquet.read_table(path)
    kept = {key: text for key, text in table.schema.metadata.items() if key != b"digest"}
    pyarrow.parquet.write_table(table.replace_schema_metadata(kept), path, compression="zstd")
    assert block_file_fault(store.manifest, block, path.read_bytes()) == "damaged"


def test_blocks_of_another_study_are_refused_and_left_where_they_are(
    out: Path, tmp_path: Path
) -> None:
    other = run_study(
        make_study("grid", ("seed: 3", "seed: 4")),
        tmp_path / "other",
        QUICK_EXECUTOR,
        block_size=12,
    )
    for path in other.store.paths():
        shutil.copy(path, out / "blocks")
    before = bytes_of(out)
    for attempt in (lambda: read_store(out), lambda: run_study(make_study(), out, QUICK_EXECUTOR)):
        with pytest.raises(SpecError, match="no block of the results of `grid` here") as raised:
            attempt()
        assert len(raised.value.problems) == 5
    assert bytes_of(out) == before


def test_a_block_that_is_a_folder_is_told(out: Path) -> None:
    path = Store(out, read_store(out).manifest).paths()[0]
    path.unlink()
    path.mkdir()
    with pytest.raises(SpecError, match="this cannot be read: it is a folder"):
        read_store(out)


def test_results_without_their_blocks_are_told_and_made_again(out: Path) -> None:
    before = bytes_of(out)
    shutil.rmtree(out / "blocks")
    with pytest.raises(SpecError, match="the folder `blocks` is missing"):
        read_store(out)
    assert run_study(make_study(), out, QUICK_EXECUTOR).computed == 60
    assert bytes_of(out) == before


def test_a_folder_that_is_refused_keeps_no_lock(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("x")
    with pytest.raises(SpecError, match="something else"):
        run_study(make_study(), tmp_path, QUICK_EXECUTOR)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize("name", ["study.json", "block"])
def test_a_part_of_the_results_that_is_a_pipe_is_refused(name: str, out: Path) -> None:
    path = out / name if name != "block" else Store(out, read_store(out).manifest).paths()[0]
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(SpecError, match="cannot be read: it is a folder, a pipe or a device"):
        read_store(out)


def test_a_lock_that_is_a_link_is_refused_and_its_target_is_unchanged(tmp_path: Path) -> None:
    target, out = tmp_path / "target", tmp_path / "out"
    target.write_text("content")
    out.mkdir()
    (out / ".lock").symlink_to(target)
    with pytest.raises(SpecError, match=r"`\.lock` .* cannot be locked: it is a link"):
        run_study(make_study(), out, QUICK_EXECUTOR)
    (out / ".lock").unlink()
    (out / ".lock").symlink_to(tmp_path / "absent")
    with pytest.raises(SpecError, match="it is a link"):
        run_study(make_study(), out, QUICK_EXECUTOR)
    assert target.read_text() == "content" and not (tmp_path / "absent").exists()


def test_a_temporary_file_is_never_written_through_a_link(tmp_path: Path) -> None:
    target, path = tmp_path / "target", tmp_path / "file"
    target.write_text("content")
    (tmp_path / f".file.{os.getpid()}.part").symlink_to(target)
    write_atomically(path, b"new")
    assert (path.read_bytes(), target.read_text()) == (b"new", "content")
    assert not path.is_symlink()
