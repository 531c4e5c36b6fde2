"""Fixtures of lock-step on random specs."""

from __future__ import annotations

import pytest

from tests.lockstep.chance.healthy import Healthy, healthy

COUNT = 12
TICKS = 200


@pytest.fixture(scope="session")
def random_specs(tmp_path_factory: pytest.TempPathFactory) -> list[Healthy]:
    """Return some random specs that interpreter and C have run."""
    return healthy(COUNT, TICKS, tmp_path_factory.mktemp("random_specs"))
