"""Label: what is true of a case, kept apart from its recordings."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from tests.generators.open_cases.case import Case
from tests.generators.open_cases.effect_catalogue import LIBRARY

FORMAT = "open-generator-labels/1"


def case_label(case: Case, strength: float) -> dict[str, Any]:
    """Return effects with places and parameters, true base values, sensors, manoeuvres."""
    effects = [
        {"id": chosen.name, "place": LIBRARY[chosen.name].place, "parameters": chosen.parameters}
        for chosen in case.effects
    ]
    kinds = [manoeuvre.kind for manoeuvre in case.manoeuvres]
    return {
        "effects": effects,
        "strength": strength,
        "base": asdict(case.driveline),
        "seed": case.seed,
        "number": case.number,
        "rate_Hz": case.rate,
        "noise_and_quantum": asdict(case.sensors),
        "manoeuvres": {"train": kinds[: case.train], "held_out": kinds[case.train :]},
    }
