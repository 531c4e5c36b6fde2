"""Every verdict that a test of the diagnosis makes has its form, and its probabilities sum to 1."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import jsonschema
import pytest

from diagnosis.dossier import finite
from diagnosis.verdict import Verdict
from tests.language.making import ROOT

SCHEMA = json.loads((ROOT / "spec" / "verdict.schema.json").read_text("utf-8"))
VALIDATOR = jsonschema.Draft7Validator(SCHEMA)


@pytest.fixture(autouse=True, scope="session")
def _every_verdict_has_its_form() -> Iterator[None]:
    made = Verdict.__init__

    def checked(self: Verdict, *arguments: Any, **named: Any) -> None:
        made(self, *arguments, **named)
        VALIDATOR.validate(finite(self.json()))
        shares = [one.probability for one in self.candidates]
        assert sum(shares) + self.other == pytest.approx(1.0)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Verdict, "__init__", checked)
        yield
