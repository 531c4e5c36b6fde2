"""Mistakes that are made on purpose on one side: lock-step on random specs sees each of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.lockstep.conftest import TICKS
from tests.lockstep.random_specs.codegen_mutants import GENERATOR
from tests.lockstep.random_specs.interpreter_mutants import INTERPRETER
from tests.lockstep.random_specs.mutant import Mutant
from tests.lockstep.random_specs.reference_runs import ReferenceRun, find_killing_spec

pytestmark = pytest.mark.long

MUTANTS = (*INTERPRETER, *GENERATOR)


@pytest.mark.parametrize("mutant", MUTANTS, ids=[mutant.name for mutant in MUTANTS])
def test_a_mutant_is_killed(
    mutant: Mutant,
    random_specs: list[ReferenceRun],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    assert find_killing_spec(mutant, random_specs, TICKS, monkeypatch, tmp_path)


def test_no_mutant_is_alive_twice() -> None:
    assert len({mutant.name for mutant in MUTANTS}) == len(MUTANTS)


@pytest.mark.parametrize("side", ["interpreter", "generator"])
def test_what_is_no_mutant_lives(
    side: str, random_specs: list[ReferenceRun], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The comparison that kills mutants finds nothing where nothing is wrong."""
    none = Mutant("none", "interpreter" if side == "interpreter" else "generator")
    assert not find_killing_spec(none, random_specs[:4], TICKS, monkeypatch, tmp_path)
