"""What the tests of proofs share."""

from __future__ import annotations

import pytest

from codegen.proofs.acsl.wp import OPTIONS

SECONDS = "2"
"""Of a prover for one goal, where a wrong one is looked for: no prover ends it, and those that
hold are done in a tenth of it."""


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wait less for goals that no prover ends."""
    monkeypatch.setattr("codegen.proofs.acsl.wp.OPTIONS", (*OPTIONS[:-1], SECONDS))
