"""Every verdict that a test of the diagnosis makes has its form, and its probabilities sum to 1.

Predictors are compiled sooner than those of a user, who follows hours with one: of the same bits.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import jsonschema
import pytest

from codegen.predictor import predictor
from codegen.toolchain.build_cache import cache_folder
from diagnosis.model import compile_cache as recipe
from diagnosis.result.verdict import Verdict
from tests.language.spec_builders import ROOT

SCHEMA = json.loads((ROOT / "spec" / "verdict.schema.json").read_text("utf-8"))
VALIDATOR = jsonschema.Draft7Validator(SCHEMA)
SOON = tuple("-Og" if flag.startswith("-O") else flag for flag in predictor.LIBRARY_FLAGS)
"""Flags under which a test compiles and follows its short recordings in the least time."""


@pytest.fixture(autouse=True, scope="session")
def _every_verdict_has_its_form() -> Iterator[None]:
    made = Verdict.__init__

    def checked(self: Verdict, *arguments: Any, **named: Any) -> None:
        made(self, *arguments, **named)
        VALIDATOR.validate(self.to_json())
        shares = [one.probability for one in self.candidates]
        assert sum(shares) + self.other == pytest.approx(1.0)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Verdict, "__init__", checked)
        yield


@pytest.fixture(autouse=True, scope="module")
def _predictors_are_compiled_soon() -> Iterator[None]:
    """They are kept apart from those that are compiled like a user's."""
    folder = cache_folder() / "soon"
    folder.mkdir(mode=0o700, exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(predictor, "LIBRARY_FLAGS", SOON)
        patch.setattr(recipe, "_cache_folder", lambda: folder)
        yield
