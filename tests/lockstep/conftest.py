"""Fixtures of lock-step on random specs."""

from __future__ import annotations

import pytest

from tests.lockstep.random_specs.reference_runs import ReferenceRun, run_reference_specs

COUNT = 12
TICKS = 200


@pytest.fixture(scope="session")
def random_specs(tmp_path_factory: pytest.TempPathFactory) -> list[ReferenceRun]:
    """Return some random specs that interpreter and C have run."""
    return run_reference_specs(COUNT, TICKS, tmp_path_factory.mktemp("random_specs"))
