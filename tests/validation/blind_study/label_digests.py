"""Seals: the hashes of all labels of a study, committed before a case of it is diagnosed."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from tests.validation.blind_study.cases import generate_cases
from tests.validation.blind_study.plan import Plan
from tests.validation.evidence.evidence_store import ROOT, write_json

SEALS = ROOT / "docs" / "evidence" / "proof_seals.json"


def seals_of(every: Sequence[Plan], seed: int, generator: str) -> dict[str, Any]:
    """Return what is sealed: the seed, and for each plan the hash of its labels."""
    plans = [
        {
            "plan": plan.name,
            "effects": plan.effects,
            "strength": plan.strength,
            "labels": generate_cases(plan, seed, generator).seal,
        }
        for plan in every
    ]
    return {"generator": generator, "seed": seed, "plans": plans}


def write_seals(found: dict[str, Any]) -> None:
    """Write the seals."""
    write_json(SEALS, found)


def is_sealed(found: dict[str, Any]) -> bool:
    """Tell whether these are the seals that were committed."""
    return SEALS.exists() and json.loads(SEALS.read_text()) == found
