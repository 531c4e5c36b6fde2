"""Compile cache: different texts have different keys; a stored candidate is not compiled again."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from codegen.predictor.predictor import PredictorColumns
from diagnosis.model import compile_cache
from diagnosis.model.compile_cache import CompiledModel, cache_key, load_or_compile
from diagnosis.model.parameter import FreeParameter


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (("a", "b"), ("ab",)),
        (("a", "b"), ("b", "a")),
        (("a", "b"), ("a\\0b",)),  # a backslash and a 0 are no NUL byte
        (("a",), ("a", "")),
    ],
)
def test_keys_of_different_texts_differ(first: tuple[str, ...], second: tuple[str, ...]) -> None:
    assert cache_key(*first) != cache_key(*second)
    assert cache_key(*first) == cache_key(*first)


def test_a_stored_candidate_is_read_with_all_its_metadata(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compile_cache, "_cache_folder", lambda: tmp_path)
    page = {"J": 1.0}
    columns = PredictorColumns("plant", ("w", "drift_w"), ("T",), ("double",), ("w",), (0, 1), page)
    free = FreeParameter("J", 1.0, 0.5, 2.0, 0.2, True, True, (1.0, 1.5), "kg*m^2")
    model = CompiledModel(
        columns, 2, (600.0, 1.0), (free,), ("drift_w",), (0.5,), ("T_d",), (False, True)
    )
    compiled: list[str] = []

    def compile_model() -> tuple[CompiledModel, bytes]:
        compiled.append("once")
        return model, b"library"

    first, library = load_or_compile("key", compile_model)
    again, same = load_or_compile("key", compile_model)
    assert (first, again) == (model, model)
    assert library == same and library.read_bytes() == b"library"
    assert compiled == ["once"]
    library.write_bytes(b"damaged")
    load_or_compile("key", compile_model)
    assert compiled == ["once", "once"]
    recipe = tmp_path / "key.json"
    recipe.write_bytes(recipe.read_bytes().replace(b"600.0", b"700.0"))
    assert load_or_compile("key", compile_model)[0] == model
    assert compiled == ["once"] * 3
    recipe.unlink()
    os.mkfifo(recipe)
    assert load_or_compile("key", compile_model)[0] == model
    assert compiled == ["once"] * 4
