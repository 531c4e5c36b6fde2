"""Simpler methods: how often they name the right effect, beside the diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tests.validation.study.case_score import NOTHING, Answer
from tests.validation.study.proportion import Rate, rate_of

METHODS = {
    "sindy": "sparse regression (PySINDy) of what the balances of the fitted base lack",
    "free_gain": "the effect that reduces the error of simulations without corrections most",
}


@dataclass(frozen=True)
class SimplerMethod:
    """A method in words, with its rates on the same cases as the diagnosis."""

    about: str
    right: Rate
    alarms: Rate


def compare_methods(answers: Sequence[Answer]) -> list[SimplerMethod]:
    """Return the diagnosis and all simpler methods, on the cases on which these were run."""
    some = [one for one in answers if one.simpler]
    full, clean = ([one for one in some if one.group == name] for name in ("full", "clean"))
    diagnosis = SimplerMethod(
        "diagnosis", rate_of(one.is_named() for one in full), rate_of(one.is_alarm for one in clean)
    )
    return [diagnosis] + [
        SimplerMethod(
            about,
            rate_of(one.simpler[name] in one.right() for one in full),
            rate_of(one.simpler[name] != NOTHING for one in clean),
        )
        for name, about in METHODS.items()
    ]
